"""Force that a model says a measured motion needs."""

from dataclasses import replace

import numpy as np
import pytest

from design.machine.model import Model
from design.machine.source import Source
from design.measured import drift_of_logs
from design.measured import predict as predict_step
from design.measured.friction_curve import friction_samples
from design.measured.predict import force_by_model, of_one_instant, predict, seen_moving
from identification.arrays import Array
from identification.effects._library import built_in
from identification.errors import BadLog
from identification.log import Log
from identification.model.estimates import Drive, Estimate
from identification.model.inverse_model import Smoothing
from identification.model.karnopp import Karnopp
from identification.model.plant import Plant
from identification.simulation.inverse_dynamics import force_needed
from tests.chain import model_of
from workbench.cards.card import load_card
from workbench.logs.sources import Sources, card_path

WIDE = Karnopp(1.0, 12.0, 15.0, 30.0, 20.0, 0.5, -0.5, 20.0, -23.0)


def swing() -> Log:
    """A slow swing, at most 0.3 m/s, under no force."""
    t = 1e-3 * np.arange(4000, dtype=np.float64)
    y = 0.1 * np.sin(3.0 * t) + 1e-7 * np.random.default_rng(0).standard_normal(len(t))
    return Log("swing", {"t": t, "y": y, "F": np.zeros(len(t))})


def not_identifiable(model: Model, **values: float) -> Model:
    """The model with these parameters assumed, as no log identified them."""
    friction = {
        name: replace(one, value=None, sd=None, low=None, high=None, reason="no", assumed=x)
        if (x := values.get(name)) is not None
        else one
        for name, one in model.friction.items()
    }
    return replace(model, friction=friction)


def test_a_band_that_no_log_identified_holds_no_body_that_is_seen_to_slide() -> None:
    log, how = swing(), Smoothing()
    identified = model_of(WIDE)
    assumed = not_identifiable(identified, dv_p=0.5, dv_n=-0.5)
    quick = np.abs(0.3 * np.cos(3.0 * log["t"])) > 0.1
    assert np.all(np.abs(force_by_model(identified, log, how)[quick]) < 1.0)  # held by no force
    needed = np.abs(force_by_model(assumed, log, how)[quick])
    assert np.all((needed > 12.0) & (needed < 25.0))
    assert seen_moving(assumed, log).friction.dv_p < 1e-2
    assert seen_moving(identified, log) == identified.simulated
    assert seen_moving(not_identifiable(identified, dv_p=1e-6), log).friction.dv_p == 1e-6


def test_friction_that_falls_with_speed_predicts_and_is_not_simulated() -> None:
    log, how = swing(), Smoothing()
    narrow = replace(WIDE, dv_p=1e-3, dv_n=-1e-3, F_vp=0.0)
    falls = replace(model_of(narrow), falling={"F_vp": Estimate(-20.0, "N s/m", 1.0, -22.0, -18.0)})
    assert falls.karnopp.F_vp == 0.0
    up = 0.3 * np.cos(3.0 * log["t"]) > 0.28
    constant = force_needed(log, falls.simulated, how)
    assert force_by_model(falls, log, how)[up] - constant[up] == pytest.approx(-5.8, abs=0.3)
    steep = replace(falls, falling={"F_vp": Estimate(-1e3, "N s/m", 1.0, -1002.0, -998.0)})
    inertia = log["y"][up] * -9.0
    assert force_by_model(steep, log, how)[up] == pytest.approx(inertia, abs=0.05)  # never drives
    level = {**falls.falling, "F_cp": Estimate(18.0, "N", 0.1, 17.8, 18.2)}  # at rest
    more = force_by_model(replace(falls, falling=level), log, how) - force_by_model(falls, log, how)
    assert more[up] == pytest.approx(6.0)


@pytest.mark.parametrize("mu", [0.1, 0.9])
def test_friction_by_load_is_predicted_from_the_motion_alone(mu: float) -> None:
    """By the measured force it would predict itself; by the force needed, F = S + d mu |F|."""
    log = swing()
    v, a = 0.3 * np.cos(3.0 * log["t"]), -0.9 * np.sin(3.0 * log["t"])
    d = np.sign(v)
    needed = a + d * np.where(d > 0.0, 12.0, 15.0) + np.where(d > 0.0, 30.0, 20.0) * v
    force = np.where(needed * d > 0.0, needed / (1.0 - mu), needed / (1.0 + mu))
    by_load = built_in()["load_dependent_friction"].acting({"mu": mu, "asymmetry": 0.0})
    narrow = Plant(replace(WIDE, dv_p=1e-3, dv_n=-1e-3), None, (by_load,))
    quick = (np.abs(v) > 0.05) & (np.arange(len(v)) > 50) & (np.arange(len(v)) < len(v) - 50)
    for logged in (np.zeros(len(log)), force):
        found = force_needed(log.with_signals(F=logged), narrow, Smoothing())
        np.testing.assert_allclose(found[quick], force[quick], rtol=5e-3)


def late_model(command_period: float | None = None, drive: Drive = "force") -> Model:
    known = model_of(WIDE)
    fit = replace(known.fit, command_period=command_period, drive=drive)
    rig = replace(known.rig, kind="force")
    return replace(known, rig=rig, fit=fit, lag=Estimate(3e-3, "s", 1e-4, 2.8e-3, 3.2e-3))


def test_a_log_is_taken_at_the_lag_of_the_model_and_held_as_its_logs_were() -> None:
    log = swing().with_signals(F=np.arange(4000.0))
    late = of_one_instant(log, late_model())
    assert late["F"][100] == pytest.approx(97.0) and not late.zoh
    assert of_one_instant(log, late_model(command_period=1e-3)).zoh
    assert of_one_instant(log, replace(late_model(), lag=None)) is log
    # Of an actuator it is the period of its command, whose integral is the force.
    assert not of_one_instant(log, late_model(command_period=1e-3, drive="command")).zoh


@pytest.mark.parametrize(("period", "zoh"), [(1e-3, True), (None, False)])
def test_a_zero_order_hold_force_is_so_in_its_prediction(
    period: float | None, zoh: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A line through its samples is half of one ahead: 3 % of a chattering force was left."""
    seen: list[bool] = []

    def force(model: Model, log: Log, how: Smoothing) -> Array:
        seen.append(how.zoh)
        return np.zeros(len(log))

    monkeypatch.setattr(predict_step, "force_by_model", force)
    model = late_model(command_period=period)
    predict_step.predict(model, swing().with_signals(F=np.sin(np.arange(4000.0))))
    assert seen == [zoh] and model.holds_force is zoh


def test_the_friction_of_a_log_is_that_of_the_instants_at_which_its_force_acts() -> None:
    log, model = swing(), late_model()
    F = np.sin(40.0 * log["t"])
    behind = log.with_signals(F=np.append(F[3:], np.full(3, F[-1])))  # 3 ms before its position
    _, on_time = friction_samples(replace(model, lag=None), log.with_signals(F=F))
    _, late = friction_samples(model, behind)
    assert late[50:-50] == pytest.approx(on_time[50:-50], abs=1e-3)


def test_a_log_is_tested_for_drift_at_the_lag_of_the_model(monkeypatch: pytest.MonkeyPatch) -> None:
    """Left in, the lag of an unchanged machine was a structure that had changed."""
    seen: list[Log] = []

    def test(active: object, log: Log, rng: object, **more: object) -> None:
        seen.append(log)
        raise BadLog("enough")

    monkeypatch.setattr(drift_of_logs, "drift_test", test)
    model, log = late_model(), swing().with_signals(F=np.arange(4000.0))
    card = load_card(card_path("paper_table1"))
    sources = Sources(card, model.rig, (Source(log, "a.csv", "0" * 64, len(log)),), ())
    with pytest.raises(BadLog, match="enough"):
        drift_of_logs.drift_of(model, "key", sources.logs)
    assert seen[0]["F"][100] == pytest.approx(97.0)


def test_the_error_off_starts_and_stops_is_that_of_steady_rows() -> None:
    """Strokes at one speed by a force switched on and off, in rows too few to show it speed up."""
    p = Karnopp(0.05, 12.0, 12.0, 30.0, 30.0, 1e-3, -1e-3, 12.5, -12.5)
    t = 0.1 * np.arange(300, dtype=np.float64)
    on = np.repeat([1.0, 0.0, -1.0, 0.0] * 5, 15)
    v, noise = 0.2 * on, np.random.default_rng(5).standard_normal(300)
    y = np.concatenate([[0.0], np.cumsum(0.1 * v[:-1])]) + 1e-5 * noise
    found = predict(model_of(p), Log("strokes", {"t": t, "y": y, "F": 18.0 * on}))
    steady, whole = found.force_steady_rms, found.force_predicted_rms
    assert 0 < np.sum(found.steady) < np.sum(found.sliding)
    assert not np.any(found.steady & ~found.sliding) and not np.any(found.steady & (on == 0.0))
    assert steady is not None and whole is not None and steady < 1.0 < 0.3 * whole
