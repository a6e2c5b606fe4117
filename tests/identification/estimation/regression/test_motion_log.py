"""The noise of a log: of a motor's force no more than its motion leaves room for."""

import numpy as np
import pytest

from identification.arrays import Array
from identification.estimation.regression.motion_log import motion_log
from identification.log import Log
from identification.model.karnopp import Karnopp
from identification.model.plant import Plant
from identification.signals.noise import local_noise
from identification.simulation.free_run import free_run
from tests.identification.jumping_command import cart_log


@pytest.mark.parametrize("late", [0, 1, 2])
def test_a_command_that_jumps_every_few_rows_is_not_taken_for_noisy_however_late_it_acts(
    late: int,
) -> None:
    one = motion_log(cart_log(0, late), zoh=True, by_command=False)
    assert one.noise.F < 0.05  # N, of 9; by its third differences 0.5


def test_noise_that_the_motor_is_not_given_is_seen() -> None:
    log = cart_log(0, 0)
    noisy = log["F"] + 0.3 * np.random.default_rng(1).standard_normal(len(log))
    one = motion_log(log.with_signals(F=noisy), zoh=True, by_command=False)
    assert 0.25 < one.noise.F < 0.9


@pytest.mark.parametrize(("chatter", "of_sensor"), [(1.0, 0.02), (0.0, 0.5)])
def test_what_a_loop_adds_to_a_measured_force_is_no_noise_of_its_sensor(
    chatter: float, of_sensor: float
) -> None:
    """The body has been given it too: by third differences both are noise."""
    rng, h = np.random.default_rng(2), 1e-3
    t: Array = np.asarray(h * np.arange(20000), dtype=np.float64)
    F = 25.0 * np.sin(2 * np.pi * 0.7 * t) + 8.0 * np.sin(2 * np.pi * 2.3 * t)
    F = F + chatter * rng.standard_normal(len(t))
    body = Plant(Karnopp(2.0, 8.0, 9.0, 50.0, 60.0, 3e-3, -3e-3, 11.0, -12.0))
    blank = Log("chatter", {"t": t, "y": np.zeros(len(t)), "F": F})
    y = np.asarray(free_run(body, blank, (0.0, 0.0, 0.0), "force").y)
    y = y + 1e-6 * rng.standard_normal(len(t))
    seen = F + of_sensor * rng.standard_normal(len(t))
    one = motion_log(blank.with_signals(y=y, F=seen), zoh=False, by_command=False)
    known = float(np.hypot(chatter, of_sensor))
    assert local_noise(seen) == pytest.approx(known, rel=0.2)
    if chatter:
        assert of_sensor < one.noise.F < 0.5 * known
    else:
        assert pytest.approx(known, rel=0.2) == one.noise.F


def test_no_position_is_more_exact_than_a_thousand_millionth_of_its_range() -> None:
    """Another program's integration errs by more: of its exact logs an effect seemed to be missing,
    of forces far below any that matters."""
    t: Array = 1e-3 * np.arange(8000, dtype=np.float64)
    y = 0.3 * np.sin(2.0 * t) + 0.1 * np.sin(5.0 * t)
    one = motion_log(Log("exact", {"t": t, "y": y, "F": np.cos(t)}), zoh=False, by_command=False)
    assert one.noise.y == pytest.approx(1e-9 * np.ptp(y), rel=0.1)
