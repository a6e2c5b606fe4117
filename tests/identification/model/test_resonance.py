"""The second mass follows the first below the anti-resonance, and not far above it."""

import numpy as np
import pytest

from identification.model.resonance import load_acceleration

H = 1e-3


@pytest.mark.parametrize(
    ("hertz", "low", "high"), [(1.0, 0.98, 1.03), (12.5, 5.0, 50.0), (100.0, 0.0, 0.05)]
)
def test_how_far_it_follows(hertz: float, low: float, high: float) -> None:
    a = np.asarray(np.sin(2.0 * np.pi * hertz * H * np.arange(8000)), dtype=np.float64)
    behind = load_acceleration(a, H, 25.0, 12.5, 0.05)[4000:]
    assert low <= np.std(behind) / np.std(a[4000:]) <= high
