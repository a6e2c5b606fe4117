"""What a validation reads from a simulated loop."""

import json
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from design.closed_loop.loop_figures import PRESENT, LoopFigures, references
from design.closed_loop.loop_motion import LimitCycle, limit_cycle, worst_rest
from design.controllers.recommend import compared
from design.controllers.validate import calm_or_missed, validate
from design.loop import LoopRun
from design.machine.design import Recommendation
from design.machine.documents import design_document
from design.machine.model import Model
from design.machine.readable import Display
from design.tune import Asked
from identification.arrays import Array
from tests.chain import EMPS, designed, model_of
from workbench.output import dumps
from workbench.report.chart import Chart
from workbench.report.design_tables import design_sentence
from workbench.report.validation import validation_sentence
from workbench.report.view import view

H = 1e-3
T: Array = H * np.arange(10_000, dtype=np.float64)


def around_target(y: Array) -> LoopRun:
    """A step to 0.1 m at the second sample, and the motion y around it."""
    r = np.full(len(y), 0.1)
    r[0] = 0.0
    zero = np.zeros(len(y))
    return LoopRun(T, r, 0.1 + y, zero, zero, y, zero, zero, np.zeros(len(y), dtype=np.int64))


@pytest.mark.parametrize(("size", "period"), [(1e-3, 0.5), (2e-4, 1.3)])
def test_a_motion_that_goes_on_is_a_limit_cycle(size: float, period: float) -> None:
    found = limit_cycle(around_target(0.5 * size * np.sin(2 * np.pi * T / period)), 1e-5)
    assert found is not None
    assert found.amplitude == pytest.approx(size, rel=1e-3)
    assert found.period == pytest.approx(period, rel=0.15)


def test_stick_slip_is_a_limit_cycle() -> None:
    jumps = 1e-3 * (np.floor(T / 0.7) % 2)
    found = limit_cycle(around_target(jumps), 1e-5)
    assert found is not None
    assert found.period == pytest.approx(1.4, rel=0.05)


def test_a_motion_that_dies_is_none() -> None:
    assert limit_cycle(around_target(1e-2 * np.exp(-T) * np.sin(20 * T)), 1e-5) is None


def test_a_drift_and_a_rest_are_none() -> None:
    assert limit_cycle(around_target(1e-3 * T), 1e-5) is None
    assert limit_cycle(around_target(np.zeros(len(T))), 1e-5) is None


def test_motion_within_the_noise_is_none() -> None:
    wave = 2e-5 * np.sin(20 * T)
    assert limit_cycle(around_target(wave), 1e-5) is None
    assert limit_cycle(around_target(wave), 1e-6) is not None


def test_the_worst_rest_is_the_last_half_after_the_step_that_leaves_most() -> None:
    r = np.repeat([0.0, 0.1, -0.1, 0.0], 100)
    y = r.copy()
    y[260:300] += 2e-3  # after the step down; more, but in the first half after the last one:
    y[310] += 5e-3
    zero = np.zeros(len(r))
    run = LoopRun(
        H * np.arange(400.0), r, y, zero, zero, y, zero, zero, np.zeros(400, dtype=np.int64)
    )
    part, before = worst_rest(run)
    assert (part.start, part.stop) == (250, 300)
    assert (r[before], r[part.start]) == (0.1, -0.1)


@cache
def seen() -> tuple[Model, Mapping[str, LoopFigures]]:
    model = model_of(EMPS, k_a=35.15)
    result, _ = validate(model, designed(model, period=5e-3), np.random.default_rng(0))
    return model, {name: places["model"] for name, places in result.figures.items()}


@pytest.mark.parametrize(
    ("swings", "calm", "missed"),
    [
        ("pid + compensator", "pid", "limit cycle of 2.2 mm every 0.85 s, where PID alone"),
        ("pid", PRESENT, "limit cycle of 2.2 mm every 0.85 s, where the present controller"),
        ("pid", "rst", ""),  # another controller that is calm has not been there before
    ],
)
def test_a_loop_that_swings_where_it_did_not_before_misses_a_limit(
    swings: str, calm: str, missed: str
) -> None:
    _, figures = seen()
    one = replace(figures["pid"], limit_cycle=None, missed=())
    bad = replace(one, limit_cycle=LimitCycle(2.2e-3, 0.85))
    out = calm_or_missed({swings: {"model": bad}, calm: {"model": one}}, Display())
    assert out[calm]["model"].passed
    said = out[swings]["model"].missed
    assert (missed in said[0] and said[0].startswith("swings at rest")) if missed else said == ()


def test_the_recommended_loop_decides_and_is_named_with_its_compensator() -> None:
    model, _ = seen()
    found = designed(model, period=5e-3)
    choice = Recommendation("pid", True, "better with it")
    result, traces = validate(
        model, replace(found, recommended="pid", recommendation=choice), np.random.default_rng(0)
    )
    assert result.judged == "pid + compensator"
    assert validation_sentence(result).startswith("PID with the compensator passes in simulation:")
    titles = [
        panel.title
        for section in view(result, traces, Display()).sections()
        if isinstance(section.content, Chart)
        for panel in section.content.panels
    ]
    assert any(
        "after the step of" in title and "PID with the compensator is furthest off" in title
        for title in titles
        if title
    )


def test_what_design_says_of_a_loop_validate_says_too() -> None:
    model, figures = seen()
    for name, one in compared(model, designed(model, period=5e-3)).items():
        assert one.standstill == figures[name].standstill
        assert (one.settling, one.smooth_rms) == (figures[name].settling, figures[name].smooth_rms)


def test_the_smooth_reference_does_not_depend_on_the_design() -> None:
    model, _ = seen()
    fast, slow = designed(model, period=5e-3), designed(model, Asked((8.0, 0.9)), period=5e-3)
    (steps, smooth, _), (longer, same, _) = (references(model, one, 5e-3) for one in (fast, slow))
    assert np.array_equal(smooth, same) and len(longer) >= len(steps)
    quick = replace(model, log=(replace(model.log[0], speed=0.4),))
    moved = np.max(np.abs(np.diff(references(quick, fast, 5e-3)[1]))) / 5e-3
    assert moved == pytest.approx(0.1, rel=0.05)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({}, ""),
        ({"adequate": False, "chi_square": 9.0}, "the model lacks a force, it leaves more of its"),
        ({"adequate": False, "chi_square": 1.1, "force_relative": 0.002}, ""),
        ({"adequate": False, "chi_square": 1.1, "force_relative": 0.3}, "the model lacks a force"),
    ],
)
def test_what_a_model_lacks_comes_first(changes: dict[str, Any], words: str) -> None:
    model, _ = seen()
    poor = replace(model, fit=replace(model.fit, **changes))
    found = designed(poor, period=5e-3)
    result, _ = validate(poor, found, np.random.default_rng(0))
    said = (poor.lacks, design_sentence(found), validation_sentence(result))
    first = words[:1].upper() + words[1:]
    assert said[0].startswith(words) and bool(said[0]) is bool(words)
    assert all(one.startswith(first) for one in said[1:])
    assert all(("the model's, not the machine's" in one) is bool(words) for one in said[1:])
    assert json.loads(dumps(design_document(found)))["lacks"] == said[0]


def test_a_model_that_no_free_run_follows_is_reported_as_such() -> None:
    model, _ = seen()
    log = replace(model.log[0], position_rms=None)
    alone = replace(model, fit=replace(model.fit, adequate=False, chi_square=1.0), log=(log,))
    assert alone.lacks == (
        "no free run of the model follows its logs, its equation of motion alone does"
    )
