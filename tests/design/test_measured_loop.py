"""Margins of a loop known at frequencies alone, beside those of its polynomials."""

import numpy as np
import pytest

from design.margins import margins
from design.measured_loop import is_minus_one, measured_margins
from design.polynomial import ComplexArray, evaluate
from design.rst import RST

H = 1e-2
A, B = np.array([1.0, -1.8, 0.8]), np.array([0.0, 0.005, 0.0045])
LOOP = RST(np.array([8.0, -7.0]), np.array([1.0, -0.2]), np.array([1.0]), H)
F = np.geomspace(0.05, 49.0, 4000)


def points() -> ComplexArray:
    z = np.exp(2j * np.pi * F * H)
    forward, back = evaluate(B, z) * evaluate(LOOP.R, z), evaluate(A, z) * evaluate(LOOP.S, z)
    return np.asarray(forward / back)


def test_margins_are_those_of_the_polynomials() -> None:
    exact, found = margins(A, B, LOOP), measured_margins(F, points(), np.ones(len(F), dtype=bool))
    assert exact.phase_deg is not None and exact.phase_w is not None
    assert exact.gain_up is not None and exact.delay_s is not None
    assert found.phase_deg == pytest.approx(exact.phase_deg, abs=0.05)
    assert found.crossover == pytest.approx(exact.phase_w / (2 * np.pi), rel=1e-3)
    assert found.gain_db == pytest.approx(20 * np.log10(exact.gain_up), abs=0.02)
    assert found.delay_s == pytest.approx(exact.delay_s, rel=1e-2)
    assert found.modulus == pytest.approx(exact.modulus, rel=1e-3)


def test_a_crossing_that_is_not_seen_is_not_reported() -> None:
    L = points()
    at = measured_margins(F, L, np.ones(len(F), dtype=bool)).crossover
    assert at is not None
    unseen = np.abs(F / at - 1.0) > 0.02
    found = measured_margins(F, L, unseen)
    assert found.crossover is None and found.phase_deg is None and found.delay_s is None
    assert found.gain_db is not None
    nothing = measured_margins(F, L, np.zeros(len(F), dtype=bool))
    assert nothing == type(nothing)(None, None, None, None, None, None)


def test_a_loop_that_is_not_stable_has_a_negative_phase_margin() -> None:
    found = measured_margins(F, np.asarray(40.0 * points()), np.ones(len(F), dtype=bool))
    assert found.phase_deg is not None and found.phase_deg < 0.0
    assert found.delay_s is None


def test_an_octave_at_minus_one_is_no_loop() -> None:
    L, seen = points(), np.ones(len(F), dtype=bool)
    assert not np.any(is_minus_one(F, L, seen))
    shut = (F > 4.0) & (F < 20.0)
    noise = 0.1 * np.random.default_rng(0).standard_normal((2, len(F)))
    found = is_minus_one(F, np.where(shut, -1.0 + noise[0] + 1j * noise[1], L), seen)
    assert np.mean(found[(F > 5.7) & (F < 14.0)]) > 0.95
    assert not np.any(found[(F < 2.8) | (F > 28.0)])


def test_what_lies_between_two_stretches_at_minus_one_is_no_loop_either() -> None:
    L, shut = points(), (F > 2.0) & (F < 20.0)
    island = (F > 6.0) & (F < 6.6)
    shown = np.where(shut & ~island, -1.0, L)
    found = is_minus_one(F, shown, np.ones(len(F), dtype=bool))
    assert np.all(found[island])
    wide = (F > 4.0) & (F < 9.0)
    assert not np.any(is_minus_one(F, np.where(shut & ~wide, -1.0, L), shut | ~shut)[wide])


def test_a_loop_that_only_passes_minus_one_is_one() -> None:
    L = points()
    at = measured_margins(F, L, np.ones(len(F), dtype=bool)).crossover
    assert at is not None
    near = np.abs(np.log2(F / at)) < 0.2
    assert not np.any(is_minus_one(F, np.where(near, -1.0, L), np.ones(len(F), dtype=bool)))
