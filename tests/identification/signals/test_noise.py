"""White noise, and what rows that are lost add to it."""

import numpy as np
import pytest

from identification.arrays import Array
from identification.log import Log
from identification.signals.noise import local_noise, noise_of_lost_rows, rounding_of_force


def test_rows_lost_of_a_line_add_nothing() -> None:
    lost = np.arange(3000) % 13 == 5
    assert noise_of_lost_rows(np.linspace(0.0, 1.0, 3000), lost) < 1e-12
    assert noise_of_lost_rows(np.ones(3000), np.zeros(3000, dtype=bool)) == 0.0


@pytest.mark.parametrize("share", [0.02, 0.1])
def test_rows_lost_of_white_noise_add_half_as_much_again_each(share: float) -> None:
    """A value and the mean of its neighbours differ by a variance of 1.5, and more over longer
    gaps."""
    rng = np.random.default_rng(7)
    lost = rng.random(200_000) < share
    found = noise_of_lost_rows(rng.standard_normal(200_000), lost)
    assert np.sqrt(1.5 * share) * 0.97 < found < np.sqrt(1.6 * share)


def coarse(phase: float) -> tuple[Array, Array]:
    """A slow signal of unit size, and the same in steps of 0.1."""
    x = np.sin(1e-3 * np.arange(20_000) + phase)
    return x, np.asarray(0.1 * np.round(x / 0.1))


def test_noise_is_at_least_that_of_the_step() -> None:
    x, steps = coarse(0.0)
    assert local_noise(steps) == pytest.approx(0.1 / np.sqrt(12.0))
    assert local_noise(steps) == pytest.approx(np.std(steps - x), rel=0.1)


def test_rounded_pressures_make_noise_of_their_force() -> None:
    (p, p_p), (n, p_n) = coarse(0.0), coarse(1.0)
    t = 1e-3 * np.arange(len(p), dtype=np.float64)
    log = Log("air", {"t": t, "p_p": p_p, "p_n": p_n, "F": 3.0 * p_p - 2.0 * p_n + 7.0})
    assert rounding_of_force(log) == pytest.approx(np.hypot(3.0, 2.0) * 0.1 / np.sqrt(12.0))
    assert rounding_of_force(log) == pytest.approx(
        np.std(log["F"] - 3.0 * p + 2.0 * n - 7.0), rel=0.1
    )
    force = Log("force", {"t": t, "F": 3.0 * p_p})
    assert rounding_of_force(force) == pytest.approx(0.3 / np.sqrt(12.0))
