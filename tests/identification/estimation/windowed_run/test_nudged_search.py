"""A run nudged to the measured velocity: it stays near the log, and the search on it gets there."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from identification.estimation.regression.equation_rows import MotionLog
from identification.estimation.windowed_run.closest import SearchLimits, agree, closer, closest
from identification.estimation.windowed_run.nudged_search import (
    BAND_RANGE,
    CLOSE_RANGE,
    FAR_RANGE,
    GROWTH_RANGE,
    SIDES_RANGE,
    Range,
    judge_nudged,
    less_load,
    limits,
    more_load,
    nudged,
    nudged_search,
    nudging,
)
from identification.estimation.windowed_run.parameters import even, names_of, values_of
from identification.estimation.windowed_run.refinement import refit
from identification.estimation.windowed_run.run_errors import judge, loss, misfit
from identification.estimation.windowed_run.windows import FAST_SHARE, starts
from identification.model.estimates import Drive
from identification.model.karnopp import Karnopp
from identification.model.plant import Plant
from identification.thresholds import COMPLETE
from tests.identification.motor_logs import NINE, made, plant, seen

OFF = Karnopp(3.05, 12.2, 9.9, 81.0, 99.0, 0.004, -0.02, 13.0, -15.5)


def test_a_led_run_stays_near_the_log_where_a_free_one_is_lost() -> None:
    one = seen(made(2))
    wrong = replace(plant(), friction=OFF)
    free = judge(wrong, [one], "command", 1.0)(wrong)
    near = judge_nudged(wrong, [one], "command", 1.0)(wrong)
    assert np.median(np.abs(near)) < 0.4 * np.median(np.abs(free))
    right = judge_nudged(plant(), [one], "command", 1.0)(plant())
    assert loss(right) < 0.3 * loss(near)


def test_noise_does_not_shake_a_led_body() -> None:
    one = seen(made(2))
    tight = nudging(plant(), [one])
    assert tight == pytest.approx(1.5 * NINE.F_vn)
    rough = replace(one, v_noise=1.0)
    assert nudging(plant(), [rough]) == pytest.approx(0.1 * NINE.F_cn)


def test_what_leads_a_body_is_no_kink_of_its_force() -> None:
    one = replace(seen(made(2)), held=False)
    by_velocity = nudged(one, plant(), 500.0)
    assert np.std(by_velocity.log["F"] - one.log["F"]) > np.std(one.log["F"])
    assert np.allclose(by_velocity.driving["F"] - by_velocity.log["F"], one.kinks, atol=1e-9)


@pytest.mark.method
def test_the_search_finds_what_a_gradient_does_not() -> None:
    true = plant({"stribeck": {"F_s": 3.0, "v_s": 0.03}})
    one = seen(made(4, {"stribeck": {"F_s": 3.0, "v_s": 0.03}}))
    wrong = replace(plant({"stribeck": {"F_s": 1.5, "v_s": 0.05}}), friction=OFF)
    by_gradient = refit(wrong, [one], "command", prior=even(wrong), effort="near")
    found = closest([wrong], [one], "command", np.random.default_rng(0))
    assert by_gradient.misfit > 2.0 * COMPLETE
    assert found.misfit <= COMPLETE
    names = names_of(found.plant, "command")
    assert values_of(found.plant, names) == pytest.approx(values_of(true, names), rel=0.06)


@pytest.mark.method
@pytest.mark.slow
def test_where_the_equations_tell_all_but_the_band_no_search_from_afar_is_made(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    ranges = list[Range]()

    def spied(
        plant: Plant, logs: Sequence[MotionLog], drive: Drive, rng: np.random.Generator,
        stages: Sequence[tuple[float, Range]] = ((1.0, FAR_RANGE),),
    ) -> Plant:  # fmt: skip
        ranges.extend(around for _, around in stages)
        return nudged_search(plant, logs, drive, rng, stages)

    monkeypatch.setattr("identification.estimation.windowed_run.closest.nudged_search", spied)
    one = seen(made(4))
    unsure = replace(plant(), friction=replace(NINE, dv_p=0.003, dv_n=-0.003, F_sp=16.2))
    found = closest(
        [unsure], [one], "command", np.random.default_rng(0), SearchLimits(1, identified=True)
    )
    assert ranges[0] == BAND_RANGE and FAR_RANGE not in ranges
    assert found.misfit <= COMPLETE
    assert found.plant.friction.array == pytest.approx(NINE.array, rel=0.06)


@pytest.mark.slow
def test_a_search_close_by_keeps_what_is_right() -> None:
    one = seen(made(2))
    found = nudged_search(
        plant(), [one], "command", np.random.default_rng(0), ((0.0, CLOSE_RANGE),)
    )
    errors_of = judge(plant(), [one], "command", 1.0)
    assert loss(errors_of(found)) <= loss(errors_of(plant()))


def test_friction_by_load_is_searched_apart_from_what_it_scales() -> None:
    loaded = plant({"load_dependent_friction": {"mu": 0.2}})
    acting = loaded.effects[0]
    again = less_load(more_load(loaded), acting)
    assert again.friction.array == pytest.approx(loaded.friction.array)
    assert more_load(loaded).friction.m == pytest.approx(loaded.friction.m / 0.8)
    assert more_load(plant()).friction == plant().friction


def test_an_asymmetry_of_zero_stays() -> None:
    own = plant({"stribeck": {"F_s": 2.0, "v_s": 0.05}})
    names = names_of(own, "command")
    low, high = limits(own, names, 0.005, FAR_RANGE)
    at = names.index("stribeck.asymmetry")
    assert low[at] == high[at] == 0.0


def test_bounds_hold_every_value() -> None:
    own = plant({"stribeck": {"F_s": 2.0, "v_s": 0.05, "asymmetry": 0.3, "delta": 1.5}})
    names = names_of(own, "command")
    for around in (FAR_RANGE, CLOSE_RANGE):
        low, high = limits(own, names, 0.005, around)
        x = values_of(own, names)
        assert np.all((np.minimum(low, high) <= x) & (x <= np.maximum(low, high)))
        at = names.index("stribeck.asymmetry")
        assert low[at] < 0.3 < high[at]
        assert not np.any((low == high) & (np.arange(len(low)) != at))
    wide, close = (
        np.ptp(np.array(limits(own, names, 0.005, a)), axis=0) for a in (FAR_RANGE, CLOSE_RANGE)
    )
    assert np.all(wide >= close)


def test_a_window_in_motion_begins_fast() -> None:
    one = seen(made(3))
    begun = starts(one, "command", 0.3)
    moving = begun.sd[1] > 0.0
    speed = np.abs(one.signals["v"]) * (one.signals["d"] != 0)
    usual = np.median(speed[speed > 0])
    assert np.count_nonzero(moving) > 3
    assert np.mean(np.abs(begun.v[moving][1:]) >= FAST_SHARE * usual) > 0.9


def test_an_asymmetry_is_searched_only_where_it_is_asked_for() -> None:
    effects = {"stribeck": {"F_s": 3.0, "v_s": 0.05}}
    names = names_of(plant(effects), "command")
    at = names.index("stribeck.asymmetry")
    for around, off in ((CLOSE_RANGE, 0.0), (SIDES_RANGE, 0.5)):
        low, high = limits(plant(effects), names, 0.0, around)
        assert (low[at], high[at]) == (-off, off)


@pytest.mark.method
def test_growth_is_searched_with_sliding_held() -> None:
    one = seen(made(2, {"rising_stiction": {"F_r": 3.0, "tau": 0.4}}))
    off = plant({"rising_stiction": {"F_r": 2.2, "tau": 0.25}})
    rng = np.random.default_rng(0)
    found = nudged_search(off, [one], "command", rng, ((0.0, GROWTH_RANGE),))
    assert found.friction.array[:5] == pytest.approx(NINE.array[:5], rel=1e-12)
    near = refit(off, [one], "command", prior=even(off), effort="near")
    assert misfit(found, [one], "command") < 1.1 < near.misfit  # steps of samples have no slope


def test_a_search_that_ends_where_another_did_is_the_last(monkeypatch: pytest.MonkeyPatch) -> None:
    one = seen(made(2, {"spring": {"k": 40.0}}))
    begun: list[Plant] = []

    def nearly(tried: Plant, *_: object) -> Plant:
        begun.append(tried)
        return tried

    monkeypatch.setattr("identification.estimation.windowed_run.closest.nudged_search", nearly)
    rng = np.random.default_rng(0)
    found = closest([plant()] * 4, [one], "command", rng, SearchLimits(0))
    assert found.misfit > 5.0 and len(begun) == 2


def test_a_shape_at_its_default_is_not_searched() -> None:
    for delta, searched in ((2.0, False), (1.5, True)):
        own = plant({"stribeck": {"F_s": 3.0, "v_s": 0.05, "delta": delta}})
        names = names_of(own, "command")
        low, high = limits(own, names, 0.0, FAR_RANGE)
        at = names.index("stribeck.delta")
        assert (low[at] < delta < high[at]) == searched
        assert low[at] <= delta <= high[at]


def test_what_the_equations_tell_is_searched_no_wider() -> None:
    key = "position_dependent_friction"
    one = plant({key: {"c1": 40.0, "period": 0.05}})
    names = names_of(one, "command")
    known = {"F_cp": 0.01, f"{key}.c1": 0.5}
    value = values_of(one, names)
    for around in (FAR_RANGE, CLOSE_RANGE):
        low, high = limits(one, names, 1e-4, around)
        less, more = limits(one, names, 1e-4, replace(around, known=known))
        for i, name in enumerate(names):
            if name in known:
                assert less[i] == pytest.approx(value[i] - known[name])
                assert more[i] == pytest.approx(value[i] + known[name])
            else:
                assert (less[i], more[i]) == (low[i], high[i])


def test_a_size_that_sliding_does_not_call_for_stays_at_none() -> None:
    key = "position_dependent_friction"
    one = plant({key: {"c1": 40.0, "period": 0.05}})
    names = names_of(one, "command")
    low, high = limits(one, names, 1e-4, FAR_RANGE)
    closed = {name for name, a, b in zip(names, low, high, strict=True) if a == b == 0.0}
    assert {f"{key}.{size}" for size in ("c2", "a", "b")} <= closed
    assert f"{key}.c1" not in closed


@pytest.mark.method
def test_a_search_ends_where_another_has_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    one = seen(made(2, {"spring": {"k": 40.0}}))  # which no plain plant follows
    searched = []

    def count(*args: object) -> Plant:
        searched.append(args)
        return plant()

    monkeypatch.setattr("identification.estimation.windowed_run.closest.nudged_search", count)
    rng = np.random.default_rng(0)
    found = closer(plant(), [one], "command", rng, 1)
    assert found.misfit > COMPLETE and len(searched) == 1
    again = closer(plant(), [one], "command", rng, 1, done=found)
    assert agree(found, again) and len(searched) == 1
    closer(plant(), [one], "command", rng, 1, done=replace(found, misfit=0.5 * found.misfit))
    assert len(searched) == 2
    assert not agree(None, found)
