"""How signals hang together: force, velocity, reference and command distinguished from each
other."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identification.arrays import Array
from identification.signals.relations import (
    actuator_share,
    command_lag,
    derivative,
    force_law,
    lead,
    motion_of,
)

N = 4000
T = np.arange(N) * 1e-3


def swing(rng: np.random.Generator, noise: float = 1e-6) -> Array:
    """A position [m] that goes to and fro at several rates."""
    parts = [a * np.sin(2 * np.pi * f * T + rng.uniform(0, 6)) for a, f in
             ((0.05, 0.6), (0.02, 1.7), (0.005, 4.1))]  # fmt: skip
    return np.asarray(np.sum(parts, axis=0) + noise * rng.standard_normal(N))


def force_of(y: Array, m: float = 2.0, F_v: float = 30.0, F_c: float = 8.0) -> Array:
    """Force [N] that moves a body of that mass and friction along y."""
    motion = motion_of(y)
    assert motion is not None
    v, a = motion.v / 1e-3, motion.a / 1e-6
    return np.asarray(m * a + F_v * v + F_c * np.sign(v))


@settings(max_examples=30)
@given(seed=st.integers(0, 200), scale=st.sampled_from([1e-3, 1.0, 40.0]), sign=st.sampled_from(
    [1.0, -1.0]))  # fmt: skip
def test_a_force_is_reported_with_its_sign_whatever_its_unit(
    seed: int, scale: float, sign: float
) -> None:
    y = swing(np.random.default_rng(seed))
    motion = motion_of(y)
    assert motion is not None
    law = force_law(motion, y, sign * scale * force_of(y))
    assert law is not None
    assert law.share > 0.98
    assert law.way == sign
    assert law.friction is not None and law.friction > 0.01
    assert law.coulomb == pytest.approx(sign * scale * 8.0, rel=0.2)


def test_a_velocity_has_no_friction_and_is_the_derivative() -> None:
    y = swing(np.random.default_rng(1))
    motion = motion_of(y)
    assert motion is not None
    law = force_law(motion, y, 3.0 * motion.v)
    assert law is not None and law.friction is not None and law.friction < 1e-6
    found = derivative(motion, 3.0 * motion.v)
    assert found.share > 0.999
    assert found.factor == pytest.approx(3.0, rel=1e-2)
    assert derivative(motion, force_of(y)).share < 0.9


def test_a_motion_of_one_way_has_no_step_to_tell_friction_by() -> None:
    rng = np.random.default_rng(2)
    y = np.cumsum(1.0 + 0.5 * np.sin(2 * np.pi * T)) + 1e-3 * rng.standard_normal(N)
    motion = motion_of(y)
    assert motion is not None
    law = force_law(motion, y, 5.0 * motion.v + 2.0 * motion.a)
    assert law is not None and law.friction is None
    assert law.share > 0.9


def test_a_body_at_rest_tells_no_force() -> None:
    y = 1e-6 * np.random.default_rng(3).standard_normal(N)
    motion = motion_of(y)
    assert motion is not None
    assert force_law(motion, y, y) is None
    assert motion_of(np.zeros(N)) is None
    assert motion_of(np.arange(10.0)) is None


@settings(max_examples=30)
@given(late=st.integers(0, 60), seed=st.integers(0, 100))
def test_a_reference_is_ahead_by_its_lag(late: int, seed: int) -> None:
    r = swing(np.random.default_rng(seed), 0.0)
    y = np.concatenate([np.full(late, r[0]), r])[:N]
    found = lead(r, y)
    assert found.samples == pytest.approx(late, abs=1.0)
    assert found.likeness > 0.9
    assert lead(y, r).samples == pytest.approx(-late, abs=1.0)


@pytest.mark.parametrize("late", [0, 20, 36])
@pytest.mark.parametrize("period", [250.0, 400.0])
def test_half_a_period_is_no_lag(late: int, period: float) -> None:
    phase = 2.0 * np.pi * (T / 1e-3 + 3e-4 * np.arange(N) ** 2 / 8.0) / period
    r = np.sin(phase)
    y = np.concatenate([np.full(late, r[0]), r])[:N] * (1.0 + 0.3 * np.sin(phase / 2.0) ** 2)
    found = lead(r, y)
    assert found.samples == pytest.approx(late, abs=0.03 * period)
    assert found.likeness > 0.9 and not found.either
    turned = lead(r, -y)
    assert turned.samples == pytest.approx(late, abs=0.03 * period)
    assert turned.likeness < -0.9 and turned.either
    assert lead(y, r).likeness > 0.9


def test_a_reference_that_never_comes_back_has_one_sign() -> None:
    y = np.cumsum(np.cumsum(np.random.default_rng(5).standard_normal(N)))
    found = lead(-y, y)
    assert found.likeness < -0.9 and not found.either


def test_what_is_constant_is_ahead_of_nothing() -> None:
    assert lead(np.ones(N), swing(np.random.default_rng(4))).likeness == 0.0


def test_a_command_drives_its_actuator_and_not_the_other_way_round() -> None:
    rng = np.random.default_rng(5)
    y = swing(rng)
    motion = motion_of(y)
    assert motion is not None
    u = np.asarray(np.interp(T, T[::200], rng.standard_normal(len(T[::200]))))
    F = np.cumsum(20.0 * u - 100.0 * motion.v)
    share, sign = actuator_share(F, motion.v, -u, motion.cutoff)
    back, _ = actuator_share(u, motion.v, F, motion.cutoff)
    assert share > 0.5 > back
    assert sign == -1.0


@settings(max_examples=15)
@given(late=st.integers(0, 30))
def test_the_lag_of_a_command_is_found(late: int) -> None:
    rng = np.random.default_rng(6)
    u = np.asarray(np.interp(T, T[::50], rng.standard_normal(len(T[::50]))))
    v = np.asarray(np.interp(T, T[::80], rng.standard_normal(len(T[::80]))))
    acted = np.concatenate([np.zeros(late), u])[:N]
    found, gain = command_lag(3.0 * acted - v, np.column_stack([v, np.ones(N)]), u, 50)
    assert found == pytest.approx(late, abs=0.6)
    assert gain >= 0.0
    if late > 20:
        assert gain > 0.05
