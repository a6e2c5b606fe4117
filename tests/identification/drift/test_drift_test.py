"""Drift test of a log: none, drift with its parameters, another structure, inconclusive."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from benchmarks.drift_machines import active
from identification.arrays import Array
from identification.drift.drift_result import DriftTest
from identification.drift.drift_test import DriftSettings, drift_test, estimate_under_test
from identification.drift.log_estimate import LogEstimate
from identification.drift.mewma import fresh_state
from identification.drift.reference_model import ReferenceModel
from identification.effects._library import built_in
from identification.errors import BadSpecification
from identification.estimation.fit import fit_plant
from identification.log import Log, Rig
from identification.model.karnopp import Karnopp
from identification.model.plant import Plant
from identification.simulation.free_run import free_run
from tests.identification import motor_logs
from tests.identification.plants import ACTUATOR, NOISE_F, NOISE_Y, made_log, table

FORCE = Rig("force")
NINE = table(2)


@cache
def model() -> ReferenceModel:
    fit = fit_plant([made_log(NINE, seed=1)], np.random.default_rng(1), rig=FORCE)
    return active(fit, FORCE, key="first", fastest=0.2)


def verdict_on(log: Log, last: DriftTest | None = None) -> DriftTest:
    return drift_test(model(), log, np.random.default_rng(2), state=last.state if last else None)


def scaled(factor: float, *names: str) -> Karnopp:
    return replace(NINE, **{name: factor * getattr(NINE, name) for name in names})


def with_spring(k: float) -> Log:
    log = made_log(NINE, seed=4)
    plant = Plant(NINE, ACTUATOR, (built_in()["spring"].acting({"k": k}),))
    run = free_run(plant, log, (0.0, 0.0, 0.0), "command")
    rng = np.random.default_rng(5)
    y = run.y + NOISE_Y * rng.standard_normal(len(log))
    return log.with_signals(y=y, F=run.F + NOISE_F * rng.standard_normal(len(log)))


@pytest.mark.slow
def test_the_same_machine_on_another_day_shows_no_drift() -> None:
    found = verdict_on(made_log(NINE, seed=2))
    assert found.verdict == "none"
    assert found.moved == ()
    assert len(found.shifts) == 11
    assert found.single is not None and found.single.value == 0.0
    assert found.chi_square == pytest.approx(1.0, abs=0.2)
    assert found.state.logs == 1


@pytest.mark.slow
def test_table_2_to_table_3_is_found_from_one_log() -> None:
    found = verdict_on(made_log(table(3), seed=3))
    assert found.verdict == "drift"
    assert found.found_by == "log"
    assert {shift.name for shift in found.moved} == set(Karnopp.__dataclass_fields__)
    for shift in found.moved:
        truth = getattr(table(3), shift.name)
        assert shift.after == pytest.approx(truth, rel=0.01)
        assert shift.low < truth < shift.high
    # A jump that is repaired leaves nothing behind.
    assert found.state.logs == 0


@pytest.mark.method
@pytest.mark.slow
def test_a_change_within_the_margin_is_no_drift_however_sure() -> None:
    sure = DriftSettings(variation=0.0)
    log = made_log(scaled(1.015, "F_cp", "F_cn"), seed=6)
    found = drift_test(model(), log, np.random.default_rng(2), settings=sure)
    assert found.verdict == "none"
    assert found.shifts["F_cp"].change == pytest.approx(0.015, abs=2e-3)
    strict = drift_test(
        model(), log, np.random.default_rng(2), settings=replace(sure, margin=0.005)
    )
    assert strict.verdict == "drift"
    assert {shift.name for shift in strict.moved} == {"F_cp", "F_cn"}


@pytest.mark.method
@pytest.mark.parametrize("names", [("F_cp", "F_cn"), ("m",)])
def test_a_drift_of_two_percent_a_log_is_found_within_five(names: tuple[str, ...]) -> None:
    last: DriftTest | None = None
    for k in range(1, 6):
        last = verdict_on(made_log(scaled(1.0 + 0.02 * k, *names), seed=10 + k), last)
        if last.verdict == "drift":
            break
    assert last is not None and last.verdict == "drift"
    assert {shift.name for shift in last.moved} == set(names)


@pytest.mark.method
def test_a_spring_that_joined_is_another_structure() -> None:
    found = verdict_on(with_spring(500.0))
    assert found.verdict == "structure"
    assert "trace" in found.reason
    assert found.state.logs == 0


def shaken(seed: int) -> Log:
    """A motor whose force is noisier than its command: no run follows such a log to its noise."""
    rng, u = np.random.default_rng(seed + 1), motor_logs.strokes(10_000, seed)
    log = motor_logs.made(seed, command=u + 0.03 * rng.standard_normal(len(u)))
    return log.with_signals(u=u, F=motor_logs.K_A * u)


@pytest.mark.slow
def test_a_run_that_gives_way_to_the_equation_is_no_other_structure() -> None:
    """The active plant's own run leaves no more of the new log than of the old."""
    rig = Rig("motor", force_per_command=motor_logs.K_A)
    known = active(fit_plant([shaken(1)], np.random.default_rng(1), rig=rig), rig, "first", 0.3)
    found = drift_test(known, shaken(3), np.random.default_rng(2))
    assert fit_plant([shaken(3)], np.random.default_rng(2), rig=rig, prior=known.plant).prescribed
    assert found.verdict != "structure"


def test_a_log_that_stands_still_is_inconclusive() -> None:
    rng = np.random.default_rng(1)
    log = made_log(NINE, seed=2, seconds=4.0)
    still = log.with_signals(y=NOISE_Y * rng.standard_normal(len(log)))
    found = verdict_on(still)
    assert found.verdict == "not_judged"
    assert "no motion" in found.reason


@pytest.mark.slow
def test_what_a_log_does_not_show_is_inconclusive() -> None:
    t: Array = 1e-3 * np.arange(12000, dtype=np.float64)
    one_way = 0.05 * (np.sin(2 * np.pi * 0.5 * t) > 0.0) + 0.003
    found = verdict_on(made_log(NINE, seed=8, u=np.asarray(one_way)))
    assert {"F_cn", "F_vn", "dv_n", "F_sn"} <= set(found.inconclusive)
    assert "negative direction" in found.inconclusive["F_sn"]
    assert "F_vp" in found.shifts


def two(correlation: float) -> tuple[ReferenceModel, LogEstimate]:
    """A model and a log in which m and F_vp both look 5.5 % larger, known to 1 % each."""
    values = np.array([NINE.m, NINE.F_vp])
    sd = 0.01 * values
    together = np.array([[1.0, correlation], [correlation, 1.0]]) * np.outer(sd, sd)
    known = ReferenceModel(
        Plant(NINE, ACTUATOR), ("m", "F_vp"), values, 1e-6 * np.diag(sd**2), FORCE, "command"
    )
    return known, LogEstimate(np.full(2, 0.055), together / np.outer(values, values), {}, 1.0)


def test_errors_that_go_together_are_one_accident_and_not_two() -> None:
    settings = DriftSettings(variation=0.001)
    for correlation, verdict in ((0.98, "none"), (0.0, "drift")):
        known, log = two(correlation)
        found = estimate_under_test(known, log, "log", fresh_state("", known.names), settings)
        assert found.verdict == verdict


def test_the_models_own_error_counts() -> None:
    known, log = two(0.0)
    settings = DriftSettings(variation=0.001)
    unsure = replace(known, covariance=np.diag((0.03 * known.values) ** 2))
    found = estimate_under_test(unsure, log, "log", fresh_state("", known.names), settings)
    assert found.verdict == "not_judged"


def coulomb(sd: float, changed: float, *names: str) -> tuple[ReferenceModel, LogEstimate]:
    """A model and a log that tell these to a deviation `sd`, all of them changed by a share."""
    values = np.array([getattr(NINE, name) for name in names])
    covariance = 1e-6 * np.diag((sd * values) ** 2)
    known = ReferenceModel(
        Plant(NINE, ACTUATOR), names, values, covariance, FORCE, "command", key="one"
    )
    own = sd**2 * np.eye(len(names))
    return known, LogEstimate(np.full(len(names), changed), own, {}, 1.0)


def test_ten_logs_that_could_not_detect_a_drift_of_ten_percent_do_not_judge() -> None:
    state = fresh_state("one", ("m", "F_cp", "F_cn"))
    for k in range(10):
        known, log = coulomb(0.1, 0.005 * (k + 1), "m", "F_cp", "F_cn")
        found = estimate_under_test(known, log, "log", state, DriftSettings())
        assert found.verdict == "not_judged" and found.tested
        assert "a change of 10 % is below the minimum detectable change (F_cp " in found.reason
        assert all(size > 0.10 for size in found.could_have_seen.values())
        state = found.state


def test_none_needs_both_coulomb_levels_and_no_more() -> None:
    known, log = coulomb(0.002, 0.0, "m", "F_cp", "F_cn")
    assert (
        estimate_under_test(
            known, log, "log", fresh_state("one", known.names), DriftSettings()
        ).verdict
        == "none"
    )
    for name, verdict in (("m", "none"), ("F_cn", "not_judged")):
        i = known.names.index(name)
        covariance = log.covariance.copy()
        covariance[i, i] *= 60.0**2
        found = estimate_under_test(
            known, replace(log, covariance=covariance), "log", fresh_state("one", known.names),
            DriftSettings(),
        )  # fmt: skip
        assert found.verdict == verdict
        assert found.could_have_seen[name] > 0.05 > found.could_have_seen["F_cp"]


@pytest.mark.slow
def test_what_is_seen_is_found() -> None:
    """A change as large as the smallest that could have been seen, of one parameter alone."""
    known, quiet = coulomb(0.003, 0.0, "m", "F_cp", "F_cn")
    state = fresh_state("one", known.names)
    size = estimate_under_test(known, quiet, "log", state, DriftSettings()).could_have_seen["F_cp"]
    rng, alarms = np.random.default_rng(1), 0
    for _ in range(100):
        change = 0.003 * rng.standard_normal(3) + size * np.array([0.0, 1.0, 0.0])
        log = replace(quiet, change=change)
        found = estimate_under_test(known, log, "log", state, DriftSettings())
        alarms += found.verdict == "drift"
    assert alarms >= 85


def test_of_parameters_that_cannot_be_distinguished_none_is_named() -> None:
    known, log = coulomb(0.05, 0.0, "F_cp", "F_vp")
    together = 0.05**2 * np.array([[1.0, -0.999], [-0.999, 1.0]])
    log = replace(log, change=np.full(2, 0.045), covariance=together)
    found = estimate_under_test(known, log, "log", fresh_state("one", known.names), DriftSettings())
    assert found.verdict == "drift"
    assert found.moved == ()
    assert set(found.unsure) == {"F_cp", "F_vp"}


@pytest.mark.parametrize(
    "wrong", [{"margin": -0.1}, {"variation": 1.0}, {"run_length": 3.0}, {"smoothing": 0.0}]
)
def test_wrong_settings_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(BadSpecification, match=next(iter(wrong))):
        DriftSettings(**wrong)
