"""White noise, and what rows that are lost add to it."""

import numpy as np
import pytest

from identification.signals.noise import noise_of_lost_rows


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
