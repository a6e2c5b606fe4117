"""Smoothed derivatives against motions whose derivatives are known."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identification.arrays import Array
from identification.errors import BadLog
from identification.signals.differentiate import (
    Method,
    differentiate,
    low_pass,
    parallel_filter,
    resolution,
    spectrum,
)

h = 1e-3
METHODS: tuple[Method, ...] = ("butterworth", "local")


def two_sines(n: int = 20_000) -> tuple[Array, Array, Array]:
    """Position [m], velocity and acceleration of two sines of 1.3 and 3.1 Hz."""
    t = np.linspace(0.0, (n - 1) * h, n)
    parts = [(0.05, 2 * np.pi * 1.3), (0.02, 2 * np.pi * 3.1)]
    y = sum((A * np.sin(w * t) for A, w in parts), np.zeros(n))
    v = sum((A * w * np.cos(w * t) for A, w in parts), np.zeros(n))
    a = sum((-A * w**2 * np.sin(w * t) for A, w in parts), np.zeros(n))
    return y, v, a


@pytest.mark.parametrize("noise", [1e-7, 1e-5, 1e-3])
def test_noise_level_is_found(noise: float) -> None:
    y, _, _ = two_sines()
    noisy = y + np.random.default_rng(1).normal(0, noise, len(y))
    assert spectrum(noisy, h).noise == pytest.approx(noise, rel=0.05)


def test_quantisation_is_a_twelfth_of_its_square() -> None:
    y, _, _ = two_sines()
    step = 1e-5
    assert spectrum(step * np.round(y / step), h).noise == pytest.approx(step / 12**0.5, rel=0.1)


def test_counts_are_seen_through_another_clock() -> None:
    step, t = 1.5e-3, np.arange(2000) * 5e-3
    counted = step * np.round(0.4 * np.sin(1.5 * t) / step)
    clock = t + 1e-3 * np.random.default_rng(1).uniform(-1.0, 1.0, len(t))
    again = np.interp(t, np.sort(clock), counted)
    assert resolution(counted) == pytest.approx(step)
    assert resolution(again) == pytest.approx(step)


@pytest.mark.parametrize("stuck", [0.0, 0.3])
def test_a_position_with_noise_has_no_counts(stuck: float) -> None:
    t = np.arange(2000) * 5e-3
    y = np.sin(1.5 * t) + 1e-4 * np.random.default_rng(2).standard_normal(len(t))
    y[: round(stuck * len(y))] = y[0]  # a stuck transducer stands at one level
    assert resolution(y) == 0.0


def test_rounding_of_the_last_digit_makes_no_new_level() -> None:
    counts = 1e-5 * np.rint(1e3 * np.sin(np.linspace(0.0, 20.0, 4000)))
    shaken = counts * (1.0 + 1e-15 * np.random.default_rng(1).standard_normal(4000))
    assert resolution(shaken) == pytest.approx(resolution(counts), rel=1e-6)
    # Nor does one absurd value make all the others one.
    assert resolution(np.append(np.random.default_rng(2).standard_normal(100), 1e300)) == 0.0


def test_cutoff_falls_as_the_noise_rises() -> None:
    y, _, _ = two_sines()
    rng = np.random.default_rng(2)
    cutoffs = [spectrum(y + rng.normal(0, s, len(y)), h).cutoff for s in (1e-8, 1e-6, 1e-4)]
    assert cutoffs == sorted(cutoffs, reverse=True)
    assert 3.1 < cutoffs[-1] < 40


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("noise", [1e-6, 1e-4])
def test_velocity_error_is_what_is_said(method: Method, noise: float) -> None:
    """The velocity's error is the noise let through: the smoothing's bias is below it."""
    y, v, _ = two_sines()
    motion = differentiate(y + np.random.default_rng(3).normal(0, noise, len(y)), h, None, method)
    inner = slice(motion.edge, -motion.edge)
    error = float(np.std((motion.v - v)[inner]))
    assert error == pytest.approx(motion.v_noise, rel=0.2 if noise > 1e-5 else 1.0)


@pytest.mark.parametrize("method", METHODS)
def test_acceleration_without_noise(method: Method) -> None:
    y, _, a = two_sines()
    motion = differentiate(y, h, 50.0, method)
    inner = slice(5 * motion.edge, -5 * motion.edge)
    assert float(np.max(np.abs((motion.a - a)[inner]))) < 2e-3 * float(np.max(np.abs(a)))


@pytest.mark.parametrize("method", METHODS)
def test_ramp_and_parabola_keep_their_ends(method: Method) -> None:
    t = np.linspace(0.0, 1999 * h, 2000)
    motion = differentiate(0.1 + 0.2 * t, h, 20.0, method)
    np.testing.assert_allclose(motion.v, 0.2, atol=1e-9)
    parabola = differentiate(0.5 * t**2, h, 20.0, "local")
    np.testing.assert_allclose(parabola.a, 1.0, atol=1e-4)


@pytest.mark.parametrize("method", METHODS)
def test_phase_is_zero(method: Method) -> None:
    """A motion read backwards gives the same velocities with the other sign."""
    y, _, _ = two_sines(4000)
    y = y + np.random.default_rng(4).normal(0, 1e-5, len(y))
    forward, backward = (differentiate(x, h, 30.0, method) for x in (y, y[::-1]))
    np.testing.assert_allclose(forward.v[400:-400], -backward.v[::-1][400:-400], atol=1e-7)


@settings(deadline=None, max_examples=20)
@given(gain=st.floats(-5, 5), factor=st.integers(1, 20))
def test_parallel_filter_is_linear_and_passes_constants(gain: float, factor: int) -> None:
    x = np.random.default_rng(5).normal(size=(600, 2))
    left = parallel_filter(gain * x[:, 0] + x[:, 1] + 1.0, factor)
    right = parallel_filter(x, factor)
    # The passband ripple (0.05 dB, twice) is the gain at zero of an even-order Chebyshev.
    ones = parallel_filter(np.ones(600), factor)
    np.testing.assert_allclose(left, gain * right[:, 0] + right[:, 1] + ones, atol=1e-9)
    np.testing.assert_allclose(ones, 1.0, atol=0.012)


def test_the_caller_keeps_his_array() -> None:
    y, _, _ = two_sines(1000)
    y.flags.writeable = False
    for x in (low_pass(y, h, 20.0), low_pass(y, h, 600.0), parallel_filter(y, 1)):
        assert x is not y
        assert x.flags.writeable


@pytest.mark.parametrize("cutoff", [0.0, -1.0, 500.0, float("nan")])
def test_a_cutoff_outside_the_band_is_refused(cutoff: float) -> None:
    y, _, _ = two_sines(1000)
    with pytest.raises(BadLog, match="cut-off"):
        differentiate(y, h, cutoff)


def test_a_short_log_is_refused() -> None:
    with pytest.raises(BadLog, match="20 samples"):
        differentiate(np.zeros(20), h)


@pytest.mark.parametrize(("counts", "rate"), [(200, 0.3), (500, 0.1), (500, 0.3), (2000, 0.1)])
def test_counts_that_come_seldom_are_noise_below_the_cut_off_too(counts: int, rate: float) -> None:
    """A swing of 1 rad behind so many counts a turn, one count in some ten samples: as white noise
    of a count they left a cut-off of 40 to 390 Hz, and a speed that was all noise."""
    h, step = 1e-3, 2.0 * np.pi / counts
    t = h * np.arange(20_000)
    w = 2.0 * np.pi * rate
    motion = differentiate(step * np.round(np.sin(w * t) / step), h)
    off = motion.v - w * np.cos(w * t)
    assert np.sqrt(np.mean(off**2)) < 0.03 * w
    assert np.sqrt(np.mean(off**2)) < 2.0 * motion.v_noise < 0.1 * w
    assert motion.noise == pytest.approx(step / 12**0.5, rel=0.1)


@pytest.mark.parametrize("digits", [2, 3, 4, 7])
@pytest.mark.parametrize("of", ["decimals", "float32"])
def test_a_counted_position_has_its_step_however_it_was_printed(digits: int, of: str) -> None:
    """Two degrees in which the smallest distance was a rounded one: over the range of the log it
    was off by more than a step, and the position passed for one without."""
    step, t = 360.0 / 2800.0, 0.02 * np.arange(400)
    counted = step * np.round(90.0 * np.sin(1.3 * t) * (1.0 + 0.3 * np.sin(0.7 * t)) / step)
    short = np.round(counted, digits) if of == "decimals" else np.float32(counted)
    shown = np.asarray(short, dtype=np.float64)
    assert resolution(shown) == pytest.approx(step, rel=1e-4)
    assert resolution(np.radians(shown)) == pytest.approx(np.radians(step), rel=1e-4)


@given(st.integers(0, 2**32 - 1), st.integers(30, 2000))
@settings(max_examples=50, deadline=None)
def test_a_position_with_noise_has_no_step(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    y = np.sin(0.01 * rng.uniform(0.2, 5.0) * np.arange(n)) + 1e-3 * rng.standard_normal(n)
    assert resolution(y) == 0.0


@pytest.mark.parametrize(("levels", "off"), [(400, 0.15), (12, 0.05)])
def test_a_level_far_off_a_step_or_few_levels_show_none(levels: int, off: float) -> None:
    y = 0.1 * np.arange(levels, dtype=np.float64)
    y[levels // 2] += 0.1 * off
    assert resolution(np.random.default_rng(5).permutation(y)) == 0.0
