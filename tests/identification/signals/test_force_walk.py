"""The random walk of an actuator's force off its logged command: how large, and when it is none."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identification.arrays import Array
from identification.signals.force_random_walk import corrected_share, force_random_walk

H, N = 2e-3, 20_000
K1, K2 = 2e4, 1e4
NOISE = 0.01  # N, of the measured force


def signals(step: float, seed: int, dead: float = 0.0) -> tuple[Array, Array, Array]:
    """Force, position, and integral of the command, of a force that drifts by so much a sample.

    dead [V]: command that the valve swallows.
    """
    rng = np.random.default_rng(seed)
    t = H * np.arange(N)
    u = 0.3 * np.sin(2 * np.pi * 0.7 * t) + 0.2 * np.sign(np.sin(2 * np.pi * 0.31 * t))
    y = 0.02 * np.sin(2 * np.pi * 0.4 * t + 1.0)
    reached = np.sign(u) * np.maximum(np.abs(u) - dead, 0.0)
    random_walk = np.cumsum(step * rng.standard_normal(N))
    F = K1 * H * np.cumsum(reached) - K2 * y + random_walk + NOISE * rng.standard_normal(N)
    return F, y, H * np.cumsum(u)


@settings(max_examples=20, deadline=None)
@given(step=st.floats(3e-4, 0.1), seed=st.integers(0, 10_000))
def test_the_step_of_a_random_walk_is_found(step: float, seed: int) -> None:
    found = force_random_walk(*signals(step, seed), H, 8 * H)
    assert found == pytest.approx(step, rel=0.3)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_an_exact_command_has_none(seed: int) -> None:
    assert force_random_walk(*signals(0.0, seed), H, 8 * H) == 0.0


def test_what_a_valve_swallows_is_no_noise() -> None:
    for seed in range(5):
        assert force_random_walk(*signals(0.0, seed, dead=0.02), H, 8 * H) == 0.0


def test_a_log_too_short_tells_none() -> None:
    F, y, impulse = (x[:200] for x in signals(0.05, 1))
    assert force_random_walk(F, y, impulse, H, 8 * H) == 0.0


def test_the_corrections_share_is_that_of_the_steady_filter() -> None:
    """Riccati's recursion of the variance comes to the same."""
    q, R, P = 0.03**2, 0.1**2, 1.0
    for _ in range(500):
        P = P - P * P / (P + R) + q
    assert corrected_share(0.03, 0.1) == pytest.approx(P / (P + R), rel=1e-9)
    assert corrected_share(0.0, 0.1) == 0.0 == corrected_share(0.1, 0.0)
