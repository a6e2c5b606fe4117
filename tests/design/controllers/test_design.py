"""The controllers recommended by default, and those that are not, judged as an engineer would."""

from dataclasses import replace

import numpy as np
import pytest

from design.closed_loop.driven_loop import driven_loop, run_driven
from design.controllers.design import reference_demand
from design.controllers.validate import validate
from design.machine.design import Design
from design.machine.model import Model
from design.tune import Asked, Goals
from identification.model.plant import Actuator, Motor
from tests.chain import EMPS, TABLES, designed, model_of
from workbench.report.view import view

ACTUATOR = Actuator(19530.0, 10405.0)
MODELS = {name: model_of(p, ACTUATOR) for name, p in TABLES.items()}
MODELS["emps"] = model_of(EMPS, k_a=35.15)


SLOW = Asked((20.0, 0.9))  # nothing to be searched


def rng() -> np.random.Generator:
    return np.random.default_rng(0)


@pytest.mark.slow
@pytest.mark.parametrize("name", list(MODELS))
def test_defaults_follow_closely_without_overshoot_or_excess_force(name: str) -> None:
    model = MODELS[name]
    found = designed(model)
    assert found.recommended == "rst" and found.rst is not None and found.pid is not None
    result, traces = validate(model, found, rng())
    assert result.passed
    for kind, controller in found.controllers.items():
        one = result.figures[kind]["model"]
        assert controller.missed == ()
        assert controller.margins.modulus >= 0.5
        assert controller.margins.delay_samples is None or controller.margins.delay_samples >= 2.0
        rounding = 1e-13 * float(np.abs(controller.R).sum() + np.abs(controller.T).sum())
        assert sum(controller.T) == pytest.approx(sum(controller.R), rel=1e-9, abs=rounding)
        assert controller.overshoot <= 0.05
        assert one.overshoot <= 0.05
        assert one.force_peak <= 1.05 * model.force_peak
        assert one.command_noise is not None and one.command_noise < 0.05
        # Not by choosing a slow controller: a ramp is followed a few samples behind.
        if kind == found.recommended:
            assert 0.0 < controller.lag < (0.06 if name != "emps" else 0.11)
    assert result.figures["rst"]["model"].smooth_relative < 0.05
    assert ("rst", "model") in traces


@pytest.mark.slow
def test_a_pid_s_weights_are_between_none_and_all_of_the_reference() -> None:
    for model in MODELS.values():
        found = designed(model)
        assert found.pid is not None and found.pid.gains is not None
        for weight in (found.pid.gains.b, found.pid.gains.c):
            assert -1e-9 <= weight <= 1.0 + 1e-9


@pytest.mark.slow
def test_the_reference_is_moved_no_faster_than_the_force_allows() -> None:
    model = MODELS["paper_table2"]
    weak = replace(model, log=(replace(model.log[0], force_peak=100.0),))
    slow, fast = designed(weak), designed(model)
    assert slow.rst is not None and fast.rst is not None
    assert slow.rst.rate is not None and fast.rst.rate is not None
    assert slow.rst.rate < 0.6 * fast.rst.rate
    result, _ = validate(weak, slow, rng())
    assert result.figures["rst"]["model"].force_peak <= 105.0
    assert any("move the reference" in (one.note or "") for one in slow.controllers.values())


@pytest.mark.slow
def test_the_command_limit_bounds_it_too() -> None:
    model = MODELS["paper_table2"]
    limited = replace(model, rig=replace(model.rig, control_limit=0.3))
    found = designed(limited)
    assert found.rst is not None and found.rst.rate is not None
    result, _ = validate(limited, found, rng())
    peak = result.figures["rst"]["model"].command_peak
    assert peak is not None and peak < 0.3
    motor = replace(MODELS["emps"], rig=replace(MODELS["emps"].rig, control_limit=4.0))
    assert isinstance(motor.simulated.actuator, Motor)
    assert reference_demand(motor, None).force == pytest.approx(4.0 * 35.15 - 25.0)


def test_the_run_has_the_reference_as_given() -> None:
    model = MODELS["paper_table2"]
    found = designed(model)
    assert found.rst is not None
    r = np.repeat([0.0, 0.1], 500)
    run = run_driven(model, driven_loop(model, found, found.rst), r, rng())
    assert np.array_equal(run.r, r)
    free = run_driven(model, driven_loop(model, found, replace(found.rst, rate=None)), r, rng())
    assert np.max(np.abs(free.F)) > 2.0 * np.max(np.abs(run.F))


@pytest.mark.method
@pytest.mark.slow
@pytest.mark.parametrize(
    ("asked", "goals"),
    [(Asked((300.0, 0.7)), Goals()), (Asked(), Goals(modulus=0.99)), (Asked((15, 1)), Goals(0.97))],
)
def test_what_misses_the_goals_is_not_recommended(asked: Asked, goals: Goals) -> None:
    found = designed(MODELS["paper_table2"], asked, goals=goals)
    assert found.recommended == "none"
    for name, one in found.controllers.items():
        assert one.missed
        assert any(f"{name.upper()}: {one.missed[0]}" in line for line in found.remarks)
    result, _ = validate(MODELS["paper_table2"], found, rng())
    assert result.judged == "rst"


def test_the_pid_is_recommended_where_only_it_keeps_the_goals() -> None:
    found: Design = designed(
        MODELS["paper_table2"], Asked((36.2, 1.0)), goals=Goals(modulus=0.4, effort=82.0)
    )
    assert found.rst is not None and found.pid is not None
    assert found.rst.missed and not found.pid.missed
    assert found.recommended == "pid"


def failing(model: Model, **changes: float) -> tuple[str, ...]:
    """What the default design misses where it is validated on a changed rig or log."""
    found = designed(model)
    rig = replace(model.rig, control_limit=changes.get("control_limit"))
    log = (replace(model.log[0], force_peak=changes.get("force_peak", model.force_peak)),)
    result, _ = validate(model, found, rng(), plant=replace(model, rig=rig, log=log))
    assert result.passed == (not result.figures["rst"]["plant"].missed)
    return result.figures["rst"]["plant"].missed


@pytest.mark.slow
def test_validation_judges_force_and_command() -> None:
    model = MODELS["paper_table2"]
    assert failing(model) == ()
    (said,) = failing(model, force_peak=120.0)
    assert said.startswith("peak force") and "the logs show 120 at most" in said
    (said,) = failing(model, control_limit=0.4)
    assert said.startswith("the command reaches its limit of 0.4 V, for ")
    assert failing(model, control_limit=5.0) == ()


def test_validation_judges_overshoot() -> None:
    model = MODELS["paper_table2"]
    found = designed(model)
    assert found.pid is not None
    hasty = replace(found.pid, T=found.pid.R, rate=None)
    result, _ = validate(model, replace(found, pid=hasty, recommended="pid"), rng())
    assert result.judged == "pid" and not result.passed
    one = result.figures["pid"]["model"]
    assert one.overshoot > 0.2
    assert any(said.startswith("overshoot") for said in one.missed)
    assert one.settling > 0.2


def test_inertia_is_reported_beside_the_motors() -> None:
    model = model_of(TABLES["paper_table1"], k_a=20.0)
    with_motor = replace(model, rig=replace(model.rig, motor_inertia=0.25))
    said = [line for line in designed(with_motor, SLOW).remarks if line.startswith("inertia")]
    assert said == ["inertia 1 kg, 0.25 kg of it the motor's: the load is 3 times the motor"]
    heavy = replace(model, rig=replace(model.rig, motor_inertia=2.0))
    assert any("check motor_inertia" in line for line in designed(heavy, SLOW).remarks)


def test_a_design_has_crossover_and_bandwidth_of_each_loop() -> None:
    found = designed(model_of(TABLES["paper_table1"], k_a=20.0), SLOW)
    for one in found.controllers.values():
        m = one.margins
        assert m.crossover_hz is not None and m.bandwidth_hz is not None
        assert 0.3 < m.bandwidth_hz / m.crossover_hz < 3.0
        assert m.gain_up is not None and m.gain_db == pytest.approx(20 * np.log10(m.gain_up))
    (head, *rows) = (line.split() for line in view(found).screen().text().splitlines()
                     if "drive's" in line or ("Hz" in line and "deg" in line))  # fmt: skip
    assert "rejects to" in " ".join(head) and "follows to" in " ".join(head)
    assert head[:3] == ["in", "a", "drive's"] and len(rows) == len(found.controllers)
