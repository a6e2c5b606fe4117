"""A noisy signal is averaged where it is smooth, and left alone where it is not."""

import numpy as np
import pytest

from identification.signals.smooth_stretches import smooth_stretches

NOISE = 0.1


def ramp_then_step(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """A slow ramp that falls at once in its middle, and what is measured of it."""
    t = np.linspace(0.0, 1.0, 2000)
    true = np.where(t < 0.5, 4.0 * t, -3.0)
    return true, true + NOISE * np.random.default_rng(seed).standard_normal(len(t))


@pytest.mark.parametrize("seed", range(3))
def test_noise_of_a_smooth_part_is_averaged(seed: int) -> None:
    true, seen = ramp_then_step(seed)
    left = smooth_stretches(seen, NOISE)[100:900] - true[100:900]
    assert float(np.std(left)) < 0.35 * NOISE


@pytest.mark.parametrize("seed", range(3))
def test_a_step_stays_where_it_is(seed: int) -> None:
    true, seen = ramp_then_step(seed)
    out = smooth_stretches(seen, NOISE)
    assert float(np.max(np.abs(out - true)[960:1040])) < 5.0 * NOISE


def test_what_changes_faster_than_a_parabola_is_left_as_measured() -> None:
    fast = np.sin(1.2 * np.arange(500))
    assert np.array_equal(smooth_stretches(fast, NOISE), fast)


def test_a_signal_without_noise_is_left_as_it_is() -> None:
    exact = np.linspace(0.0, 1.0, 300) ** 2
    assert np.array_equal(smooth_stretches(exact, 0.0), exact)


def test_a_signal_too_short_for_a_parabola_is_left_as_it_is() -> None:
    short = np.array([1.0, 2.0, 0.5])
    assert np.array_equal(smooth_stretches(short, NOISE), short)
