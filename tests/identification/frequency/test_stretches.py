"""Stretches: length by the logs, exact derivatives, nothing where a log does not reach."""

import numpy as np
import pytest

from identification.errors import BadSpecification, NotIdentifiable
from identification.frequency.stretches import (
    CYCLES_IN_STRETCH,
    LONGEST_STRETCH,
    REACHES,
    Band,
    bands,
    coefficients,
    hold,
    second_derivative,
)


def test_stretches_follow_the_logs_length_and_halve_with_frequency() -> None:
    found = bands([60.0], [1e-3], None)
    assert found[0].length == pytest.approx(7.5)
    inner = [one.f[REACHES[-1] : -REACHES[-1]] for one in found]
    assert inner[0][0] == pytest.approx(6 / 7.5)
    for one, f, after in zip(found, inner, inner[1:], strict=False):
        assert f[-1] * one.length < 2.0 * CYCLES_IN_STRETCH <= after[0] * one.length + 1.0
    every = np.concatenate(inner)
    assert np.all(np.diff(every) > 0) and every[-1] <= 400.0
    assert bands([1e4], [1e-3], None)[0].length == LONGEST_STRETCH
    assert bands([30.0, 30.0], [1e-3, 2e-3], None)[0].length == pytest.approx(7.5)


def test_the_lowest_frequency_asked_for_sets_the_longest_stretch() -> None:
    assert bands([60.0], [1e-3], 0.5)[0].length == pytest.approx(12.0)
    with pytest.raises(BadSpecification, match=r"lowest frequency 0.1 Hz: stretches of 60 s"):
        bands([60.0], [1e-3], 0.1)
    with pytest.raises(NotIdentifiable, match="stretches of 64 samples needed"):
        bands([0.4], [1e-3], None)


def test_a_second_derivative_is_exact_at_every_frequency() -> None:
    h, length = 1e-2, 2.0
    band = Band(length, np.arange(4, 70) / length)
    t = h * np.arange(1000)
    for f in (3.0, 11.0, 33.0):
        wave = np.cos(2 * np.pi * f * t)
        k = int(np.argmin(np.abs(band.f - f)))
        plain = coefficients(wave[1:-1], h, band)[:, k]
        found = second_derivative(wave, h, band)[:, k]
        np.testing.assert_allclose(found, -((2 * np.pi * f) ** 2) * plain, rtol=1e-9)


def test_coefficients_are_zero_where_a_log_does_not_reach() -> None:
    band = Band(1.0, np.arange(0.0, 50.0))
    noise = np.random.default_rng(1).standard_normal(1000)
    found = coefficients(noise, 1e-2, band)
    assert found.shape == (19, 50)
    assert np.all(found[:, 2:41] != 0) and not np.any(found[:, 41:]) and not np.any(found[:, :2])
    assert coefficients(noise[:50], 1e-2, band).shape == (0, 50)


def test_a_hold_delays_by_half_a_sample() -> None:
    f = np.array([0.0, 1.0, 100.0])
    found = hold(f, 1e-3)
    assert found[0] == 1.0
    np.testing.assert_allclose(np.angle(found), -np.pi * f * 1e-3)
    exact = -np.expm1(-2j * np.pi * f[1:] * 1e-3) / (2j * np.pi * f[1:] * 1e-3)
    np.testing.assert_allclose(found[1:], exact)
