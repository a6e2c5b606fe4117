"""Stick limits of a motor whose loop is faster than its log: between what two ways find."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from identification.estimation import converged_fit
from identification.estimation.recorded_logs import recorded_logs
from identification.log import Rig
from identification.model.estimates import Estimate
from identification.model.karnopp import Karnopp
from identification.model.plant import Motor, Plant
from identification.model.size import Size
from tests.identification.motor_logs import K_A, made

PLANT = Plant(Karnopp(1.0, 8.0, 8.0, 1.0, 1.0, 1e-3, -1e-3, 10.0, -10.0))
NOISY: Any = SimpleNamespace(may_change_between=True, zoh=True, by_motor=True, logs=(), name="log")
COULOMB = {"F_cp": Estimate(8.0, "N", 0.1, 7.8, 8.2), "F_cn": Estimate(8.0, "N", 0.1, 7.8, 8.2)}


def limits(
    monkeypatch: pytest.MonkeyPatch, found: dict[str, Estimate], risen: dict[str, Size],
    followed: bool = True,
) -> dict[str, Estimate]:  # fmt: skip
    monkeypatch.setattr(converged_fit, "risen_to", lambda logs, plant: risen)
    return converged_fit._of_both({**COULOMB, **found}, PLANT, NOISY, followed=followed)


def test_a_limit_lies_midway_between_the_run_s_and_the_force_at_breakaway(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    run = {
        "F_sp": Estimate(10.0, "N", 0.1, 9.8, 10.2),
        "F_sn": Estimate(-9.0, "N", 0.1, -9.2, -8.8),
    }
    found = limits(monkeypatch, run, {"F_sp": Size(12.0, 0.5), "F_sn": Size(-11.0, 0.5)})
    for name, low, high in (("F_sp", 9.8, 12.98), ("F_sn", -11.98, -8.8)):
        one = found[name]
        assert (one.low, one.high) == pytest.approx((low, high), abs=0.01)
        assert one.value == pytest.approx(0.5 * (low + high), abs=0.01)


def test_where_the_run_has_none_it_lies_above_the_coulomb_level(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    none = {"F_sp": Estimate(None, "N", reason="2 breakaways", assumed=9.0)}
    found = limits(monkeypatch, none, {"F_sp": Size(12.0, 0.5)})
    assert (found["F_sp"].low, found["F_sp"].high) == pytest.approx((7.8, 12.98), abs=0.01)
    assert limits(monkeypatch, none, {"F_sp": Size(12.0, 0.5)}, followed=False) == {}


def test_a_breakaway_that_is_not_above_sliding_friction_shows_none(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    none = {"F_sp": Estimate(None, "N", reason="2 breakaways", assumed=9.0)}
    assert limits(monkeypatch, none, {"F_sp": Size(7.5, 0.1)}) == {}


@pytest.mark.parametrize(("usual", "zoh"), [(10.1, False), (12.0, True)])
def test_a_limit_of_a_held_measured_force_holds_what_most_breakaways_say(
    usual: float, zoh: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Only where that is another one: the run knows more."""
    measured: Any = SimpleNamespace(
        may_change_between=False, zoh=True, by_motor=False, logs=(), name="log"
    )
    run = {"F_sp": Estimate(10.0, "N", 0.1, 9.8, 10.2)}
    monkeypatch.setattr(converged_fit, "risen_to", lambda logs, plant: {})
    monkeypatch.setattr(converged_fit, "usual_limits", lambda *_: ({"F_sp": Size(usual, 0.2)}, 0.0))
    found = converged_fit._of_both({**COULOMB, **run}, PLANT, measured, followed=True)
    assert bool(found) == zoh
    if zoh:
        assert (found["F_sp"].low, found["F_sp"].high) == pytest.approx((9.8, 12.39), abs=0.01)


def test_without_a_rest_that_ends_there_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    run = {"F_sp": Estimate(10.0, "N", 0.1, 9.8, 10.2)}
    found = limits(monkeypatch, run, {})
    assert found["F_sp"].value is None and "starts from rest" in (found["F_sp"].reason or "")


def test_the_motion_of_the_log_is_counted_beside_that_of_the_fitted_run() -> None:
    """Of a plant that sticks where the body moves: the log needs no more motion."""
    recorded = recorded_logs([made(3)], Rig("motor", force_per_command=K_A))
    stuck = Karnopp(1.0, 900.0, 900.0, 1.0, 1.0, 1e-3, -1e-3, 1000.0, -1000.0)
    events = converged_fit._events(Plant(stuck, Motor(K_A)), recorded, 0.5)
    assert max(events.sliding) < 50 <= min(events.moved)


def test_stops_that_come_and_go_leave_no_number_of_a_motor_exact() -> None:
    """A stick limit of a motor behind 8000 counts a turn was 0.02 % off, by 400 of its deviations;
    an actuator's command, which is integrated, makes no steps of the force."""
    quiet = SimpleNamespace(noise=SimpleNamespace(corrected=0.0))
    names, values = ("F_cp", "F_sp"), np.array([8.0, 10.0])
    motor: Any = SimpleNamespace(logs=(quiet,), zoh=True, drive="command")
    actuator: Any = SimpleNamespace(logs=(quiet,), zoh=False, drive="command")
    found = converged_fit.between_samples_sd(names, values, motor)
    assert 2e-4 < found[1] / values[1] < 5e-4 and 0.0 < found[0] / values[0] < found[1] / values[1]
    assert not np.any(converged_fit.between_samples_sd(names, values, actuator))


@pytest.mark.parametrize(("noise", "sd"), [(0.0, 0.1), (0.3, 0.1 * 37.0**0.5)])
def test_a_zero_order_hold_force_says_of_a_limit_no_more_than_its_steps_and_noise_allow(
    noise: float, sd: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A step of 0.35 N is uniform, 0.1 N; a measured one's noise of 0.3 N counts twice."""
    both: Any = lambda *_: {"F_sp": (10.0, 10.0), "F_sn": (-9.0, -9.0)}  # noqa: E731
    monkeypatch.setattr(converged_fit, "stick_ranges", both)
    monkeypatch.setattr(converged_fit, "usual_limits", lambda *_: ({}, 0.12**0.5))
    monkeypatch.setattr(converged_fit, "counts", lambda *_: np.arange(5))
    near: Any = SimpleNamespace(names=("m", "F_sp", "F_sn"), plant=PLANT)
    recorded: Any = SimpleNamespace(
        logs=(), drive="force", noise=(1.0, noise), by_motor=False, may_change_between=False
    )
    covariance = np.array([[1.0, 0.5, 0.0], [0.5, 4.0, 0.0], [0.0, 0.0, 9.0]])
    found = converged_fit._with_stick_ranges(covariance, near, recorded)
    assert np.sqrt(np.diag(found)) == pytest.approx([1.0, sd, sd])
    assert found[0, 1] / np.sqrt(found[1, 1]) == pytest.approx(0.25)
    # Within an identified band a run shows its limit between two steps too; a motor's exact command
    # has no noise.
    near.names = ("dv_p", "F_sp", "F_sn")
    monkeypatch.setattr(converged_fit, "stick_ranges", lambda *_: {"F_sp": (9.9, 10.1)})
    sharp = np.diag([1e-10, 4.0, 9.0])
    recorded.by_motor = True
    found = converged_fit._with_stick_ranges(sharp, near, recorded)
    assert np.sqrt(np.diag(found)) == pytest.approx([1e-5, 0.1 / 1.96, 3.0])
