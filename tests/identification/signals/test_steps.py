"""Small jumps and spikes are distinguished from kinks, impacts and encoders; the callers' arrays
stay."""

import numpy as np
import pytest

from identification.arrays import Array, frozen
from identification.signals.steps import (
    jump_size,
    local_noise,
    small_jumps,
    small_spikes,
    white_noise,
)

H, NOISE = 1e-3, 1e-5
T = H * np.arange(6000.0)


def way(seed: int = 0) -> Array:
    """A smooth motion with reversals, behind a noisy sensor."""
    y = 0.05 * np.sin(2.0 * np.pi * T)
    return np.asarray(y + NOISE * np.random.default_rng(seed).standard_normal(len(T)))


@pytest.mark.parametrize("at", [1250, 2000, 3100])
@pytest.mark.parametrize("size", [20.0, -30.0, 1000.0])
def test_a_small_jump_is_found_in_motion_and_in_reversals(at: int, size: float) -> None:
    y = way()
    y[at:] += size * NOISE
    y = frozen(y)
    assert small_jumps(T, y).tolist() == [at - 1]
    assert jump_size(y, at - 1) == pytest.approx(size * NOISE, abs=4.0 * NOISE)


@pytest.mark.parametrize("at", [2000, 3100])
def test_a_sample_that_was_read_twice_is_no_jump(at: int) -> None:
    """The body stays for a sample where it was and goes on: no offset of the sensor."""
    y = way()
    assert not len(small_jumps(T, np.insert(y, at, y[at])[: len(T)]))


@pytest.mark.parametrize("at", [1250, 2000, 3100])
@pytest.mark.parametrize("length", [1, 2, 3])
def test_a_small_spike_is_found_in_motion_and_in_reversals(at: int, length: int) -> None:
    y = way()
    y[at : at + length] += 15.0 * NOISE
    found = small_spikes(frozen(y))
    assert np.flatnonzero(found).tolist() == list(range(at, at + length))


@pytest.mark.parametrize("seed", range(10))
def test_noise_and_an_impact_are_neither(seed: int) -> None:
    """A body that hits a stop within a sample and comes back with half its speed."""
    y = way(seed)
    y[2000:] += -1.5 * 0.05 * 2.0 * np.pi * (T[2000:] - T[2000] + 0.4 * H)
    assert not len(small_jumps(T, y))
    assert not np.any(small_spikes(y))


@pytest.mark.parametrize("count", [1e-6, 2e-5, 1e-3])
def test_an_encoder_s_counts_are_neither(count: float) -> None:
    y = count * np.round(0.05 * np.sin(2.0 * np.pi * T) / count)
    assert not len(small_jumps(T, y))
    assert not np.any(small_spikes(y))


def test_noise_is_reported_beside_motion() -> None:
    assert white_noise(way()) == pytest.approx(NOISE, rel=0.15)


def jittering(seed: int) -> Array:
    """The same motion with rests, by a clock that jitters: 30 times as noisy in fast motion."""
    rng = np.random.default_rng(seed)
    t = T + 1e-6 * rng.standard_normal(len(T))
    y = 0.05 * np.clip(1.3 * np.sin(2.0 * np.pi * t), -1.0, 1.0)
    return np.asarray(y + 1e-8 * rng.standard_normal(len(T)))


@pytest.mark.parametrize("seed", range(10))
def test_a_clock_that_jitters_makes_no_spikes(seed: int) -> None:
    y = jittering(seed)
    assert not np.any(small_spikes(y))
    assert 1.0 < np.max(local_noise(y)) / (0.05 * 1.3 * 2.0 * np.pi * 1e-6) < 1.7
    y[1990:1993] += 20.0 * np.max(local_noise(y))
    assert np.flatnonzero(small_spikes(y)).tolist() == [1990, 1991, 1992]


def test_a_body_that_sticks_for_a_moment_as_it_turns_has_no_spike() -> None:
    """Coarsely sampled, it lies off the parabola of its motion; a spike comes and goes at once."""
    turning = [3.17, 2.62, 2.045, 1.46, 0.855, 0.24, -0.045, -0.695, -1.45, -1.995, -2.465, -2.885]
    before, after = 3.17 + 0.5 * np.arange(50.0, 0.0, -1.0), -2.885 - 0.35 * np.arange(1.0, 50.0)
    turned = np.round(np.cumsum([*before, *turning, *after]) / 0.015) * 0.015
    assert not np.any(small_spikes(turned))
    spoilt = turned.copy()
    spoilt[80] += 2.0
    assert np.flatnonzero(small_spikes(spoilt)).tolist() == [80]
