"""The state of a body at a sample of its log."""

import numpy as np
import pytest

from identification.log import Log
from identification.signals.initial_state import measured_start, measured_states


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


def test_a_run_begins_anew_at_the_speed_of_a_body_whose_clock_jitters() -> None:
    rng, n = np.random.default_rng(5), 4000
    t = np.arange(n, dtype=np.float64) * 1e-3
    taken = t + 1e-4 * rng.standard_normal(n)
    w = 4.0 * np.pi
    shown = 12.0 * np.sin(w * taken) + 3e-4 * rng.standard_normal(n)
    at = np.arange(200, n, 170, dtype=np.int64)
    y, v = measured_states(Log("swing", {"t": t, "y": shown}), at)
    assert np.std(y - 12.0 * np.sin(w * t[at])) < 0.01
    assert np.std(v - 12.0 * w * np.cos(w * t[at])) < 1.5


def test_a_body_that_stops_is_looked_at_shortly() -> None:
    t = np.arange(4000, dtype=np.float64) * 1e-3
    y = np.minimum(t, 2.0) + 1e-6 * np.random.default_rng(6).standard_normal(len(t))
    _, v = measured_states(Log("stop", {"t": t, "y": y}), np.array([1000, 1990, 2010, 3000]))
    assert v == pytest.approx([1.0, 1.0, 0.0, 0.0], abs=0.02)
