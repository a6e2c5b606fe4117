"""Trace of motors, counted positions, noise in the logged command: what a workshop's logs are."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from identification.effects._library import Library, built_in
from identification.errors import NotIdentifiable
from identification.estimation.recorded_logs import RecordedLogs
from identification.estimation.regressed_plant import _limit
from identification.estimation.regression.effect_rows import UNEXPLAINED, with_effect
from identification.estimation.regression.equation_rows import BREAKAWAY, MECHANICAL
from identification.estimation.regression.row_fit import base_fits, first_stage
from identification.estimation.structure_fit import fitted_structure
from identification.estimation.windowed_run.refinement import Refit, refit
from identification.estimation.windowed_run.run_errors import misfit
from identification.estimation.windowed_run.windows import starts
from identification.log import Log, Rig
from identification.model.plant import Plant
from identification.signals.differentiate import resolution
from identification.thresholds import COMPLETE
from identification.tracing.recorded_rows import driven_only, without_load_dependent
from identification.tracing.result import Trace
from identification.tracing.trace import trace
from tests.identification.motor_logs import K_A, NINE, made, plant, seen

RIG = Rig("motor", force_per_command=K_A)
COUNT = 5e-6


def traced(train: Log, *test: Log, library: Library | None = None) -> Trace:
    return trace([train], list(test), RIG, library or built_in(), np.random.default_rng(0))


def counted(log: Log, step: float = COUNT) -> Log:
    return log.with_signals(y=step * np.round(log["y"] / step))


def test_a_counted_position_has_the_noise_of_its_step() -> None:
    assert resolution(counted(made(2))["y"]) == pytest.approx(COUNT)
    assert resolution(made(2)["y"]) == 0.0
    one = seen(counted(made(2), 1e-4))
    assert one.noise.y >= 0.9 * 1e-4 / np.sqrt(12.0)
    still = np.zeros(200)
    assert resolution(still) == 0.0


@pytest.mark.method
def test_nothing_is_missing_on_a_motor_whose_position_is_counted() -> None:
    found = traced(counted(made(2, n=15_000), 1e-5), counted(made(5), 1e-5))
    assert found.verdict == "none"
    assert found.plant.friction.m == pytest.approx(NINE.m, rel=0.01)


def test_a_dead_zone_that_leaves_a_motor_no_force_explains_nothing() -> None:
    one = seen(made(3, {"cogging": {"a": 4.0, "b": 0.0, "period": 0.02}}))
    stage, _ = first_stage([one], by_command=False)
    zone = built_in()["valve_dead_zone"]
    whole = {"u_d": 2.0 * float(np.max(np.abs(one.log["u"]))), "asymmetry": 0.0}
    rows = with_effect(stage, MECHANICAL, zone, whole, 0, stage.parts[MECHANICAL][0])
    assert np.max(np.abs(rows.b)) > 0.1 * UNEXPLAINED  # not 0 = 0
    small = {"u_d": 1e-3, "asymmetry": 0.0}
    kept = with_effect(stage, MECHANICAL, zone, small, 0, stage.parts[MECHANICAL][0])
    assert -0.01 < kept.lost < 100.0
    assert MECHANICAL in base_fits(stage)


@pytest.mark.method
def test_a_spring_on_a_motor_is_no_dead_zone() -> None:
    effects = {"spring": {"k": 60.0}}
    found = traced(made(3, effects, n=15_000), made(4, effects))
    assert [e.effect.key for e in found.effects] == ["spring"]
    assert found.effects[0].params["k"].value == pytest.approx(60.0, rel=0.02)


def test_noise_of_a_logged_command_is_distinguished_from_what_a_controller_passes() -> None:
    log, rng = made(6), np.random.default_rng(0)
    noise = 0.3 * rng.standard_normal(len(log))
    noisy = log.with_signals(F=log["F"] + noise, u=log["u"] + noise / K_A)
    assert pytest.approx(0.3, rel=0.15) == seen(noisy).noise.F
    assert seen(noisy).has_random_walk("command") and not seen(log).has_random_walk("command")
    filtered = np.convolve(log["y"], [400.0, -300.0, -100.0])[: len(log)]
    passed = log.with_signals(F=log["F"] + filtered, u=log["u"] + filtered / K_A)
    assert seen(passed).noise.F < 0.02


def test_a_plant_that_drifts_more_is_not_forgiven_for_it() -> None:
    log, rng = made(6), np.random.default_rng(0)
    noise = 0.3 * rng.standard_normal(len(log))
    noisy = log.with_signals(F=log["F"] + noise, u=log["u"] + noise / K_A)
    one = replace(seen(noisy), reference=NINE)
    light = replace(plant(), friction=replace(NINE, m=0.02 * NINE.m, F_cp=1e-9, F_cn=1e-9))
    alone = replace(one, reference=None)
    assert misfit(light, [one], "command") > 1.5 * misfit(light, [alone], "command")
    assert len(starts(one, "command").at) > 3


@pytest.mark.slow
def test_a_force_that_never_brakes_is_said_so() -> None:
    one = seen(made(6))
    assert driven_only([one])
    braking = np.where(one.log["t"] % 1.0 < 0.1, -1.0, 1.0) * one.log["F"]
    brakes = replace(one, log=one.log.with_signals(F=braking))
    assert not driven_only([brakes])
    # Friction in proportion to a force that never brakes is a scale of all the rest.
    by_load = {"load_dependent_friction"}
    assert without_load_dependent(built_in(), [one]).keys() == built_in().keys() - by_load
    assert without_load_dependent(built_in(), [brakes]) == built_in()
    assert any("hardly ever opposes" in line for line in traced(made(6)).remarks)


def test_a_machine_that_hardly_moves_is_refused() -> None:
    n = 30_000
    driven = made(11, n=n)
    stands = driven.with_signals(
        y=np.where(np.arange(n) < 1000, driven["y"], driven["y"][999]),
        **{k: np.where(np.arange(n) < 1000, driven[k], 0.0) for k in ("u", "F")},
    )
    noise = 1e-5 * np.random.default_rng(12).standard_normal(n)
    with pytest.raises(NotIdentifiable, match=r"slides for \d\.\d % of the log"):
        traced(stands.with_signals(y=stands["y"] + noise))


@pytest.mark.slow
def test_a_stick_limit_far_above_friction_is_searched_from_what_the_body_bore(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    begun = list[Plant]()

    def spied(start: Plant, *given: Any, **how: Any) -> Refit:
        begun.append(start)
        return refit(start, *given, **how)

    monkeypatch.setattr("identification.estimation.structure_fit.refit", spied)
    high = replace(NINE, F_cp=8.0, F_cn=7.0, F_sp=22.0, F_sn=-19.0)
    one = seen(made(6, friction=high))
    start, first = first_stage([one], by_command=False)
    estimated = {key: found for key, found in first.items() if key != BREAKAWAY}
    model = fitted_structure(
        start, estimated, (), RecordedLogs((one,), RIG, "command"), np.random.default_rng(0)
    )
    assert begun[0].friction.F_sp == pytest.approx(high.F_sp, rel=0.1)
    assert begun[0].friction.F_sn == pytest.approx(high.F_sn, rel=0.1)
    assert model.misfit <= COMPLETE


def test_a_body_pressed_against_a_stop_tells_no_stick_limit() -> None:
    assert _limit(10.0, 500.0) == 30.0
    assert _limit(10.0, 20.0) == 20.0
    assert _limit(10.0, 0.0) == 12.0


@pytest.mark.method
def test_either_stick_limit_has_its_own_share_of_friction_along_the_stroke() -> None:
    values = {"c1": 100.0, "period": 0.05, "at_rest_p": 1.33, "at_rest_n": 0.5}
    effects = {"position_dependent_friction": values}
    found = traced(made(3, effects, n=15_000), made(4, effects))
    assert [e.effect.key for e in found.effects] == ["position_dependent_friction"]
    # A force held over its sample tells a limit by the sample in which the body lets go, so a small
    # change of one may change nothing: it is in the plant, but without an interval.
    params, acting = found.effects[0].params, found.plant.effects[0].values
    for name in ("c1", "at_rest_p", "at_rest_n"):
        assert acting[name] == pytest.approx(values[name], rel=0.1), name
        assert params[name].value in (None, pytest.approx(values[name], rel=0.1)), name
    assert params["c1"].value is not None
