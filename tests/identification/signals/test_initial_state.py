"""The first state of a log."""

import numpy as np
import pytest

from identification.log import Log
from identification.signals.initial_state import measured_start


@pytest.mark.parametrize("v", [0.0, 0.05, -0.3])
def test_position_and_velocity_of_a_ramp(v: float) -> None:
    t = np.arange(2000, dtype=np.float64) * 1e-3
    noise = 1e-5 * np.random.default_rng(1).standard_normal(len(t))
    log = Log("ramp", {"t": t, "y": 0.1 + v * t + noise, "F": 3.0 + 0 * t})
    y, velocity, force = measured_start(log)
    assert y == pytest.approx(0.1, abs=3e-5)
    assert velocity == pytest.approx(v, abs=5e-3)
    assert force == 3.0


def test_rest_is_exactly_zero() -> None:
    t = np.arange(2000, dtype=np.float64) * 1e-3
    log = Log("rest", {"t": t, "y": 1e-5 * np.random.default_rng(3).standard_normal(len(t))})
    assert measured_start(log)[1:] == (0.0, 0.0)
