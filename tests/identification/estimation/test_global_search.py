"""The global search on functions with known minima."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from identification.arrays import Array
from identification.estimation.global_search import evolved


def rugged(z: Array) -> Array:
    """Rastrigin's function in the unit cube: many local minima, the global one at 0.3."""
    x = 10.0 * (z - 0.3)
    return np.asarray(10.0 * z.shape[1] + np.sum(x**2 - 10.0 * np.cos(2 * np.pi * x), axis=1))


def test_leaves_local_minima() -> None:
    rng = np.random.default_rng(1)
    assert np.allclose(evolved(rugged, rng.random((64, 4)), 200, rng), 0.3, atol=0.01)


@given(st.integers(0, 2**31))
def test_the_best_is_in_the_cube_and_no_worse_than_before(seed: int) -> None:
    rng = np.random.default_rng(seed)
    first = rng.random((16, 3))
    best = evolved(rugged, first, 10, rng)
    assert np.all((best >= 0) & (best <= 1))
    assert rugged(best[np.newaxis])[0] <= rugged(first).min()


def test_members_that_cannot_be_are_left() -> None:
    def half(z: Array) -> Array:
        return np.where(z[:, 0] < 0.5, np.nan, (z[:, 0] - 0.6) ** 2)

    rng = np.random.default_rng(2)
    assert abs(evolved(half, rng.random((32, 1)), 60, rng)[0] - 0.6) < 1e-3


def test_stops_when_the_population_has_met() -> None:
    rng = np.random.default_rng(3)
    asked = list[int]()

    def cost(z: Array) -> Array:
        asked.append(len(z))
        return np.asarray(1.0 + np.sum((z - 0.5) ** 2, axis=1))

    evolved(cost, rng.random((32, 2)), 1000, rng)
    assert sum(asked) < 32 * 200
