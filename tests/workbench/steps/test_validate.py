"""What a validation reads from a simulated loop."""

import numpy as np
import pytest

from design.loop import LoopRun
from identification.arrays import Array
from workbench.steps.loop_motion import limit_cycle

H = 1e-3
T: Array = H * np.arange(10_000, dtype=np.float64)


def held(y: Array) -> LoopRun:
    """A step to 0.1 m at the second sample, and the motion y around it."""
    r = np.full(len(y), 0.1)
    r[0] = 0.0
    zero = np.zeros(len(y))
    return LoopRun(T, r, 0.1 + y, zero, zero, y, zero, zero, np.zeros(len(y), dtype=np.int64))


@pytest.mark.parametrize(("size", "period"), [(1e-3, 0.5), (2e-4, 1.3)])
def test_a_motion_that_goes_on_is_a_limit_cycle(size: float, period: float) -> None:
    found = limit_cycle(held(0.5 * size * np.sin(2 * np.pi * T / period)), 1e-5)
    assert found is not None
    assert found.amplitude == pytest.approx(size, rel=1e-3)
    assert found.period == pytest.approx(period, rel=0.15)


def test_stick_slip_is_a_limit_cycle() -> None:
    jumps = 1e-3 * (np.floor(T / 0.7) % 2)
    found = limit_cycle(held(jumps), 1e-5)
    assert found is not None
    assert found.period == pytest.approx(1.4, rel=0.05)


def test_a_motion_that_dies_is_none() -> None:
    assert limit_cycle(held(1e-2 * np.exp(-T) * np.sin(20 * T)), 1e-5) is None


def test_a_drift_and_a_rest_are_none() -> None:
    assert limit_cycle(held(1e-3 * T), 1e-5) is None
    assert limit_cycle(held(np.zeros(len(T))), 1e-5) is None


def test_motion_within_the_noise_is_none() -> None:
    wave = 2e-5 * np.sin(20 * T)
    assert limit_cycle(held(wave), 1e-5) is None
    assert limit_cycle(held(wave), 1e-6) is not None
