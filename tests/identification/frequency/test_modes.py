"""Resonances and anti-resonances, found where they are and nowhere else."""

from dataclasses import replace

import numpy as np
import pytest

from identification.arrays import Array
from identification.frequency.body import body_response
from identification.frequency.estimate import Response
from identification.frequency.machine import body_by_force
from identification.frequency.modes import fit_modes
from identification.frequency.stretches import ComplexArray
from tests.identification.frequency.linear_loop import (
    DAMPING,
    HERTZ,
    RESONANCE,
    VISCOUS,
    logged,
    true_position,
)

F = np.arange(1.0, 150.0, 0.2)


def exact(H: ComplexArray, f: Array = F, seed: int = 1, noise: float = 0.01) -> Response:
    """A response with noise as its coherence says."""
    rng = np.random.default_rng(seed)
    n = 30.0
    g = 1.0 / (1.0 + 2.0 * n * noise**2)
    off = noise * (rng.standard_normal(len(f)) + 1j * rng.standard_normal(len(f)))
    return Response(f, np.asarray(H * (1.0 + off)), np.full(len(f), g), np.full(len(f), n))


def accelerations(f: Array = F) -> ComplexArray:
    """Of two masses."""
    return np.asarray(-((2 * np.pi * f) ** 2) * true_position(f))


def test_both_peaks_of_two_masses_are_found_in_a_log() -> None:
    found = fit_modes(body_by_force([logged(1)]))
    assert found is not None
    anti, resonance = found.peaks
    assert (anti.kind, resonance.kind) == ("anti-resonance", "resonance")
    assert anti.frequency.value == pytest.approx(HERTZ, rel=0.01)
    assert anti.damping.value == pytest.approx(DAMPING, rel=0.4)
    assert resonance.frequency.value == pytest.approx(RESONANCE, rel=0.01)
    assert abs(anti.frequency.value - HERTZ) < 5.0 * anti.frequency.sd


@pytest.mark.slow
def test_deviations_are_those_of_repeated_noise() -> None:
    every = [fit_modes(exact(accelerations(), seed=seed)) for seed in range(12)]
    found = np.array([[p.frequency.value for p in one.peaks] for one in every if one])
    stated = np.array([[p.frequency.sd for p in one.peaks] for one in every if one])
    assert found.shape == (12, 2)
    np.testing.assert_array_less(found.std(axis=0), 3.0 * stated.mean(axis=0))
    np.testing.assert_allclose(found.mean(axis=0), [HERTZ, RESONANCE], rtol=2e-3)


def test_one_mass_has_no_peak_and_its_lag_is_reported() -> None:
    one = np.asarray(-((2 * np.pi * F) ** 2) * body_response(F, 3.5, VISCOUS, lag=2e-3))
    found = fit_modes(exact(one))
    assert found is not None and found.peaks == ()
    assert found.lag == pytest.approx(2e-3, rel=0.03)
    np.testing.assert_allclose(found.response(F), one, rtol=0.01)
    straight = -((2 * np.pi * F) ** 2) * body_response(F, 3.5, VISCOUS)
    np.testing.assert_allclose(found.undelayed(F), straight, rtol=0.02)


def test_a_peak_where_nothing_is_seen_is_not_reported() -> None:
    response = exact(accelerations())
    around = np.abs(F / HERTZ - 1.0) < 0.15
    hidden = replace(response, coherence=np.where(around, 0.1, response.coherence))
    found = fit_modes(hidden)
    assert found is not None
    assert [one.kind for one in found.peaks] == ["resonance"]
    below = replace(response, coherence=np.where(F > 25.0, 0.1, response.coherence))
    found = fit_modes(below)
    assert found is not None and found.peaks == ()


def test_too_few_points_have_no_modes() -> None:
    f = np.arange(1.0, 6.0, 0.2)
    assert fit_modes(exact(accelerations(f), f)) is None


def test_two_masses_by_their_parameters_are_the_bodys() -> None:
    ratio = HERTZ / RESONANCE
    z = DAMPING / ratio  # of the resonance: z_a w_r = z w_a
    found = body_response(F, 3.5, VISCOUS, second_mass=(RESONANCE, HERTZ, z))
    near = np.abs(np.abs(found / true_position(F)) - 1.0)
    assert np.max(near) < 0.05
    spring = body_response(F, 3.5, 0.0, stiffness=3.5 * (2 * np.pi * 4.0) ** 2)
    assert F[np.argmax(np.abs(spring))] == pytest.approx(4.0)


def test_peaks_in_a_gap_are_felt_by_what_lies_below_and_above() -> None:
    response = exact(accelerations())
    gap = (F > 0.85 * HERTZ) & (F < 1.15 * RESONANCE)
    hidden = replace(response, coherence=np.where(gap, 0.1, response.coherence))
    found = fit_modes(hidden)
    assert found is not None and found.peaks == ()
    anti, resonance = found.felt
    assert (anti.kind, resonance.kind) == ("anti-resonance", "resonance")
    assert anti.frequency.value == pytest.approx(HERTZ, rel=0.02)
    assert resonance.frequency.value == pytest.approx(RESONANCE, rel=0.02)
    below = replace(response, coherence=np.where(F > 0.85 * HERTZ, 0.1, response.coherence))
    alone = fit_modes(below)
    assert alone is not None and alone.felt == ()  # nothing above it is seen
    one = np.asarray(-((2 * np.pi * F) ** 2) * body_response(F, 3.5, VISCOUS))
    stiff = exact(one)
    plain = fit_modes(replace(stiff, coherence=np.where(gap, 0.1, stiff.coherence)))
    assert plain is not None and plain.felt == ()
