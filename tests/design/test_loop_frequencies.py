"""Crossover and bandwidth of a loop, beside its margins and its own curves."""

import numpy as np
import pytest

from design.loop_frequencies import loop_frequencies, open_loop_response
from design.margins import margins, sensitivities
from design.rst import RST

H = 1e-2
A, B = np.array([1.0, -1.8, 0.8]), np.array([0.0, 0.005, 0.0045])
LOOP = RST(np.array([8.0, -7.0]), np.array([1.0, -0.2]), np.array([1.0]), H)


def test_crossover_is_where_the_phase_margin_is() -> None:
    exact, found = margins(A, B, LOOP), loop_frequencies(A, B, LOOP)
    assert exact.phase_w is not None and found.crossover is not None
    assert found.crossover == pytest.approx(exact.phase_w / (2 * np.pi), rel=1e-4)
    L = open_loop_response(A, B, LOOP, np.array([found.crossover]))
    assert abs(L[0]) == pytest.approx(1.0, rel=1e-4)
    lag = np.degrees(np.angle(L[0]))
    assert 180.0 + lag == pytest.approx(exact.phase_deg, abs=0.05)


def test_bandwidth_is_where_the_position_is_3_dB_below_a_slow_reference() -> None:
    found = loop_frequencies(A, B, LOOP)
    assert found.bandwidth is not None
    w = 2 * np.pi * np.array([1e-3, found.bandwidth])
    slow, there = np.abs(sensitivities(A, B, LOOP, w).S_yr)
    assert 20 * np.log10(there / slow) == pytest.approx(-3.01, abs=0.02)


def test_a_loop_below_1_everywhere_has_no_crossover() -> None:
    weak = RST(1e-4 * LOOP.R, LOOP.S, 1e-4 * LOOP.T, H)
    plant = np.array([1.0, -1.2, 0.4])
    assert loop_frequencies(plant, B, weak).crossover is None


def test_disturbances_are_rejected_to_where_the_sensitivity_comes_to_minus_3_dB() -> None:
    found = loop_frequencies(A, B, LOOP)
    assert found.rejection is not None and found.rejection != found.bandwidth
    (there,) = np.abs(sensitivities(A, B, LOOP, np.array([2 * np.pi * found.rejection])).S_yp)
    assert 20 * np.log10(there) == pytest.approx(-3.01, abs=0.02)
