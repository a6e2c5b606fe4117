"""A motor's fit from a log that begins in full motion, where no rest is to begin from, and from
steps."""

from dataclasses import replace
from typing import Literal

import numpy as np
import pytest

from benchmarks.drives_rig import make
from identification.errors import NotIdentifiable
from identification.estimation.fit import fit_plant
from identification.estimation.recorded_logs import recorded_logs
from identification.log import Log, Rig, RigKind
from identification.model.karnopp import Karnopp
from identification.model.plant import Motor, Plant
from identification.simulation.free_run import free_run
from tests.identification.motor_logs import K_A as STROKES_K_A
from tests.identification.motor_logs import NINE, made

SERVO = Karnopp(0.62, 4.1, 5.2, 22.0, 17.0, 0.02, -0.015, 6.3, -7.9)
SMALL = Karnopp(4e-3, 0.08, 0.08, 0.045, 0.045, 0.01, -0.01, 0.12, -0.12)
K_A, H = 6.4, 2e-3
RIG = Rig("motor", force_per_command=K_A)


def motor_log(seed: int = 0, seconds: float = 10.0) -> Log:
    """A motor's log that begins in full motion: sine and steps of force, noise 1e-5 m."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(seconds / H), dtype=np.float64) * H
    steps = np.repeat(rng.uniform(-1.0, 1.0, 60), 1 + len(t) // 60)[: len(t)]
    u = (9.0 * np.sin(2 * np.pi * 0.7 * t) + 7.0 * steps) / K_A
    blank = Log("motor", {"t": t, "y": np.zeros(len(t)), "u": u})
    run = free_run(Plant(SERVO, Motor(K_A)), blank, (0.1, 0.35, K_A * u[0]), "command")
    y = run.y + 1e-5 * rng.standard_normal(len(t))
    return Log("motor", {"t": t, "y": y, "u": u, "F": K_A * u})


@pytest.mark.parametrize(("motion", "unit"), [("linear", "m/s"), ("rotary", "rad/s")])
def test_a_motor_that_stands_still_is_reported_in_its_units(
    motion: Literal["linear", "rotary"], unit: str
) -> None:
    log = made(3, n=2000)
    still = log.with_signals(y=1e-3 * np.random.default_rng(1).standard_normal(2000))
    with pytest.raises(NotIdentifiable, match=rf"noise of the velocity \([0-9.]+ {unit}\)"):
        recorded_logs([still], replace(RIG, motion=motion))


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_motor_that_begins_in_full_motion_is_found(seed: int) -> None:
    fit = fit_plant([motor_log(seed)], np.random.default_rng(seed), rig=RIG)
    assert fit.adequate
    assert fit.chi_square == pytest.approx(1.0, abs=0.2)
    assert np.max(np.abs(fit.friction.array / SERVO.array - 1.0)) < 0.02


@pytest.mark.slow
@pytest.mark.parametrize("seed", [3, 4])
def test_a_noisy_command_neither_bends_sliding_friction_nor_narrows_the_stick_limits(
    seed: int,
) -> None:
    """Mass and sliding friction are the equation's; an interval of a stick limit holds the run's
    and what the force had risen to."""
    log = made(seed)
    noise = 0.4 * np.random.default_rng(seed).standard_normal(len(log))
    noisy = log.with_signals(F=log["F"] + noise, u=log["u"] + noise / STROKES_K_A)
    fit = fit_plant(
        [noisy], np.random.default_rng(0), rig=Rig("motor", force_per_command=STROKES_K_A)
    )
    for name in ("m", "F_cp", "F_cn", "F_vp", "F_vn"):
        one = fit.estimates[name]
        assert one.value is not None and one.sd is not None
        assert abs(one.value - getattr(NINE, name)) < 3.0 * one.sd
    for name in ("F_sp", "F_sn"):
        one = fit.estimates[name]
        if one.low is not None and one.high is not None:
            assert one.low < getattr(NINE, name) < one.high


def steps(levels: tuple[float, ...], follows: bool = True) -> list[Log]:
    """A motor's runs of 0.6 s from rest, each by a constant command, noise 0.003 rad; follows: by
    it, else at a speed that is none of its."""
    rng, out, t = np.random.default_rng(1), [], np.arange(110, dtype=np.float64) * 6e-3
    for u in levels:
        log = Log(f"by {u:g}", {"t": t, "y": np.zeros(len(t)), "u": np.full(len(t), u)})
        run = free_run(Plant(SMALL, Motor(1.0)), log, (0.0, 0.0, u), "command")
        y = run.y if follows else np.sign(u) * (0.2 + 9.0 * t + np.sin(40.0 * t) / 8.0)
        out.append(log.with_signals(y=y + 3e-3 * rng.standard_normal(len(t)), F=log["u"]))
    return out


def test_runs_by_steps_are_fitted_by_their_runs_alone() -> None:
    """The equation of motion, of a force without errors, would draw mass and viscous friction to
    nothing, and a lag, which a constant force does not show, would be the start's."""
    rig = Rig("motor", force_per_command=1.0, motion="rotary")
    fit = fit_plant(steps((1.0, -1.0, 0.6, -0.6)), np.random.default_rng(0), rig=rig)
    assert fit.adequate and not fit.prescribed and not fit.surroundings.lag.value
    for name in ("m", "F_cp", "F_cn", "F_vp", "F_vn"):
        one = fit.estimates[name]
        assert one.low is not None and one.high is not None
        assert one.low < getattr(SMALL, name) < one.high < 1.1 * getattr(SMALL, name)


@pytest.mark.parametrize("kind", ["force", "motor"])
def test_steps_that_no_run_follows_identify_nothing(kind: RigKind) -> None:
    """A motor whose run was 2.7 rad off had "F_cn 59.88 to 60.12"."""
    logs = [replace(log, signals={k: log[k] for k in ("tyF" if kind == "force" else "tyuF")})
            for log in steps((1.0, -1.0, 0.6, -0.6), follows=False)]  # fmt: skip
    rig = Rig(kind, motion="rotary", force_per_command=1.0 if kind == "motor" else None)
    with pytest.raises(
        NotIdentifiable, match="nothing is identifiable from the equation of motion of steps"
    ):
        fit_plant(logs, np.random.default_rng(0), rig=rig)


@pytest.mark.slow
def test_values_of_the_equation_that_do_not_follow_the_log_are_not_taken() -> None:
    """Of a coarse command the equation errs by 6 % of F_vn, and with that no run follows."""
    machine = make("motor", ("none",), 1404, 0.2)
    found = fit_plant([machine.train], np.random.default_rng(0), rig=machine.machine.rig)
    assert found.friction.F_vn == pytest.approx(machine.machine.nine.F_vn, rel=5e-3)
    assert found.friction.m == pytest.approx(machine.machine.nine.m, rel=2e-3)
