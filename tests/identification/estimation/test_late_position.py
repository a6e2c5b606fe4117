"""A lag between the columns of force and position: found where a run or the equation shows it."""

import numpy as np
import pytest

from identification.estimation.late_position import what_acts_beside
from identification.log import Log, Rig
from identification.model.karnopp import Karnopp
from identification.model.plant import Plant
from identification.simulation.free_run import free_run

H = 2e-3
BODY = Plant(Karnopp(0.15, 0.3, 0.3, 0.05, 0.05, 1e-3, -1e-3, 0.36, -0.36))


def late_log(seconds: float) -> Log:
    """A rotor driven by a torque, whose position is read so many seconds after its torque."""
    t = np.asarray(np.arange(8000) * H, dtype=np.float64)
    torque = 0.9 * np.sin(2 * np.pi * 0.7 * t) + 0.5 * np.sin(2 * np.pi * 1.9 * t + 1.0)
    blank = Log("late", {"t": t, "y": np.zeros(len(t)), "F": torque})
    y = np.asarray(free_run(BODY, blank, (0.0, 0.0, 0.0), "force").y)
    noise = 1e-5 * np.random.default_rng(1).standard_normal(len(t))
    return Log("late", {"t": t, "y": np.interp(t - seconds, t, y) + noise, "F": torque})


@pytest.mark.parametrize("samples", [0.0, 2.0])
def test_a_lag_of_a_measured_force_is_found_to_a_fraction_of_a_sample(samples: float) -> None:
    found = what_acts_beside([late_log(samples * H)], Rig("force", motion="rotary"))
    assert abs(found.lag.value / H - samples) < 0.25


def test_a_current_that_is_logged_late_is_found() -> None:
    log = late_log(-8 * H)
    motor = log.with_signals(u=log["F"])
    found = what_acts_beside([motor], Rig("motor", motion="rotary", force_per_command=1.0))
    assert abs(found.lag.value / H + 8.0) < 0.6  # half a sample: a command is held until the next
