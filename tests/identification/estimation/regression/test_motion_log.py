"""The noise of a log: of a motor's force no more than its motion leaves room for."""

import numpy as np
import pytest

from identification.estimation.regression.motion_log import motion_log
from tests.identification.jumping_command import cart_log


@pytest.mark.parametrize("late", [0, 1, 2])
def test_a_command_that_jumps_every_few_rows_is_not_taken_for_noisy_however_late_it_acts(
    late: int,
) -> None:
    one = motion_log(cart_log(0, late), held=True, by_command=False)
    assert one.noise.F < 0.05  # N, of 9; by its third differences 0.5


def test_noise_that_the_motor_is_not_given_is_seen() -> None:
    log = cart_log(0, 0)
    noisy = log["F"] + 0.3 * np.random.default_rng(1).standard_normal(len(log))
    one = motion_log(log.with_signals(F=noisy), held=True, by_command=False)
    assert 0.25 < one.noise.F < 0.9
