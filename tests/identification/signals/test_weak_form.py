"""Weak form: exact on what it should be exact on, with the noise that it says."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identification.signals.weak_form import all_windows, noise_gain, sliding_windows, weights

H = 2e-3


@settings(max_examples=30, deadline=None)
@given(st.floats(-1, 1), st.floats(-5, 5), st.floats(-50, 50), st.sampled_from([16, 24, 30, 40]))
def test_derivatives_of_a_parabola_are_exact(a: float, b: float, c: float, length: int) -> None:
    t = H * np.arange(200)
    x = a + b * t + 0.5 * c * t**2
    w = all_windows(len(t), length, H)
    middle = t[w.middle]
    np.testing.assert_allclose(w.first @ x, b + c * middle, atol=1e-9)
    np.testing.assert_allclose(w.second @ x, c, atol=1e-7)


def test_a_constant_and_a_kinked_signal_are_integrated_as_they_are() -> None:
    rng = np.random.default_rng(1)
    u = rng.normal(size=300)
    whole = H * np.concatenate([[0.0], np.cumsum(u)[:-1]])
    w = all_windows(300, 30, H)
    # The weak derivative of the integral is the mean of the held signal.
    fine = 200
    t = np.linspace(0.0, 1.0, 30 * fine + 1)
    bump = (1.0 - (2.0 * t - 1.0) ** 2) ** 5
    bump /= np.sum(bump[:-1])
    start = int(w.start[3])
    repeated = np.repeat(u[start : start + 30], fine)
    assert (w.zoh @ u)[3] == pytest.approx(float(bump[:-1] @ repeated), abs=2e-4)
    line = np.interp(np.arange(30 * fine) / fine, np.arange(31), whole[start : start + 31])
    assert (w.kinked @ whole)[3] == pytest.approx(float(bump[:-1] @ line), abs=1e-7)


def test_noise_of_a_row_is_what_its_weights_say() -> None:
    rng = np.random.default_rng(2)
    noise = rng.normal(size=200_000)
    w = all_windows(len(noise), 30, H)
    for operator, row in zip((w.mean, w.first, w.second), weights(30, H), strict=False):
        assert np.var(operator @ noise) == pytest.approx(noise_gain(row), rel=0.03)


def test_sliding_windows_lie_in_one_direction() -> None:
    d = np.repeat([0.0, 1.0, -1.0, 0.0, 1.0], [20, 60, 15, 10, 40])
    w = sliding_windows(d, 16, H)
    assert len(w.start)
    for start in w.start:
        part = d[start : start + 17]
        assert part[0] != 0 and np.all(part == part[0])
