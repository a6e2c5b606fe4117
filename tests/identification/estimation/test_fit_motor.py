"""A motor's fit from a log that begins in full motion, where no rest is to begin from."""

import numpy as np
import pytest

from identification.estimation.fit import fit_plant
from identification.log import Log, Rig
from identification.model.karnopp import Karnopp
from identification.model.plant import Motor, Plant
from identification.simulation.free_run import free_run

SERVO = Karnopp(0.62, 4.1, 5.2, 22.0, 17.0, 0.02, -0.015, 6.3, -7.9)
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


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_motor_that_begins_in_full_motion_is_found(seed: int) -> None:
    fit = fit_plant([motor_log(seed)], np.random.default_rng(seed), rig=RIG)
    assert fit.adequate
    assert fit.chi_square == pytest.approx(1.0, abs=0.2)
    assert np.max(np.abs(fit.friction.array / SERVO.array - 1.0)) < 0.02
