"""The clock's jitter, estimated from a position whose noise grows with speed."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identification.arrays import Array
from identification.signals.clock_jitter import (
    OF_HALF_A_COUNT,
    beside_their_time,
    position_noise,
)

NOISE = 2e-7  # m


def swinging(h: float, jitter: float, seed: int, count: float = 0.0) -> tuple[Array, Array]:
    """A position that swings at three rates, behind a sensor on a clock that jitters [s]."""
    rng = np.random.default_rng(seed)
    t = h * np.arange(20_000)
    at = t + jitter * rng.standard_normal(len(t))
    waves = ((0.05, 3.0), (0.02, 8.0), (0.01, 17.0))
    y = sum(size * np.sin(w * at + w) for size, w in waves)
    v = sum(size * w * np.cos(w * t + w) for size, w in waves)
    y = y + NOISE * rng.standard_normal(len(t))
    return (count * np.round(y / count) if count else y), np.asarray(v)


@settings(max_examples=20, deadline=None)
@given(
    jitter=st.floats(3e-6, 1e-4), h=st.sampled_from([5e-4, 1e-3, 2e-3]), seed=st.integers(0, 999)
)
def test_the_jitter_is_found(jitter: float, h: float, seed: int) -> None:
    found = position_noise(*swinging(h, jitter, seed))
    assert found is not None
    assert found.jitter == pytest.approx(jitter, rel=0.2)
    assert found.at_rest < 0.1 * jitter + 2.0 * NOISE


@pytest.mark.parametrize("count", [0.0, 2e-6, 2e-5])
@pytest.mark.parametrize("h", [5e-4, 2e-3])
def test_an_even_clock_has_none(h: float, count: float) -> None:
    """Nor do an encoder's counts look like one, which slow motion seldom changes."""
    for seed in range(5):
        assert position_noise(*swinging(h, 0.0, seed, count)) is None


def test_half_a_count_a_sample_leaves_most() -> None:
    """Of a ramp the fifth differences of the counts, over those of white noise of a count."""
    left = [
        np.mean(
            np.diff(np.round(0.3 + part * np.arange(20_000)) - part * np.arange(20_000), 5) ** 2
        )
        for part in (0.05, 0.2, 0.35, 0.5, 0.65, 0.8)
    ]
    most = np.array(left) / (252.0 / 12.0)
    assert np.argmax(most) == 3 and most[3] == pytest.approx(OF_HALF_A_COUNT, rel=1e-6)


@pytest.mark.parametrize("count", [4e-4, 1e-3])
def test_counts_slower_than_one_a_sample_are_no_jitter(count: float) -> None:
    """Half a count a sample leaves three times what white noise of a count would."""
    for seed in range(5):
        assert position_noise(*swinging(5e-4, 0.0, seed, count)) is None


def test_beside_coarse_counts_a_slight_jitter_is_of_no_account() -> None:
    assert position_noise(*swinging(1e-3, 1e-6, 0, count=2e-5)) is None


def test_a_short_log_and_one_without_noise_tell_none() -> None:
    y, v = swinging(1e-3, 1e-4, 0)
    assert position_noise(y[:500], v[:500]) is None
    assert position_noise(np.zeros(20_000), np.zeros(20_000)) is None


def in_part_moving(tau: float, every: int) -> tuple[Array, Array, Array]:
    """Instants [s], a position that rests, moves and rests [rad], where each so many samples were
    taken early by tau [s], and where it was."""
    t = 0.01 * np.arange(400, dtype=np.float64)

    def place(at: Array) -> Array:
        return np.asarray(1.0 - np.cos(2.0 * np.clip(at - 1.0, 0.0, 2.5)))

    early = np.arange(len(t)) % every == 5
    return t, place(t - tau * early), place(t)


def test_samples_taken_early_are_of_the_clock() -> None:
    t, y, place = in_part_moving(0.002, 10)
    said = beside_their_time(t, y, y != place)
    assert said is not None and "some 2 ms: a clock that jitters" in said


def test_what_is_off_its_place_at_rest_too_is_not() -> None:
    t, _, place = in_part_moving(0.0, 10)
    off = np.arange(len(t)) % 10 == 5
    assert beside_their_time(t, place + 0.002 * off, off) is None
