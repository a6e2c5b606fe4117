"""Reference signals: levels, dwell, power, and that only random steps use the generator."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from identification.arrays import Array
from identification.errors import BadSpecification
from identification.signals.excitation import (
    Multisine,
    Ramps,
    RandomSteps,
    ReferenceSpec,
    Steps,
    Sum,
    reference_signal,
)

T = 0.01 * np.arange(2001, dtype=np.float64)


def signal(spec: ReferenceSpec, seed: int = 0) -> Array:
    return reference_signal(spec, T, np.random.default_rng(seed))


def test_steps_hold_their_levels_and_come_again() -> None:
    r = signal(Steps((0.0, 0.1, -0.2), 5.0))
    assert r[0] == 0.0
    assert r[499] == 0.0
    assert r[500] == 0.1
    assert r[1000] == -0.2
    assert r[1500] == 0.0


def test_random_steps_depend_on_the_seed_alone() -> None:
    spec = RandomSteps(0.3, 0.5)
    assert np.array_equal(signal(spec, 1), signal(spec, 1))
    assert not np.array_equal(signal(spec, 1), signal(spec, 2))
    assert np.max(np.abs(signal(spec))) <= 0.3
    assert len(np.unique(signal(spec))) == 41


@given(st.floats(0.01, 10.0), st.floats(0.01, 10.0))
def test_ramps_keep_rate_and_amplitude(amplitude: float, rate: float) -> None:
    r = signal(Ramps(amplitude, rate))
    assert r[0] == pytest.approx(0.0, abs=1e-12)
    assert np.max(np.abs(r)) <= amplitude * (1 + 1e-12)
    assert np.max(np.abs(np.diff(r))) <= rate * 0.01 * (1 + 1e-9)


def test_multisine_has_the_power_of_its_sine_and_a_small_crest() -> None:
    r = signal(Multisine(0.1, 0.5, 5.0, 10))[:-1]
    assert np.sqrt(np.mean(r**2)) == pytest.approx(0.1 / np.sqrt(2), rel=1e-3)
    assert np.max(np.abs(r)) < 2.2 * np.sqrt(np.mean(r**2))


def test_sum_adds_its_parts() -> None:
    a, b = Steps((0.0, 1.0), 2.0), Ramps(0.5, 1.0)
    np.testing.assert_allclose(signal(Sum((a, b))), signal(a) + signal(b))


@pytest.mark.parametrize(
    "make",
    [
        lambda: Steps((), 1.0),
        lambda: Steps((1.0,), 0.0),
        lambda: RandomSteps(1.0, -1.0),
        lambda: Ramps(0.0, 1.0),
        lambda: Multisine(1.0, 2.0, 1.0),
        lambda: Sum(()),
    ],
)
def test_impossible_signals_are_refused(make: object) -> None:
    assert callable(make)
    with pytest.raises(BadSpecification):
        make()
