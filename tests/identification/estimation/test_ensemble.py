"""The walkers on a known density, and the verdict on short chains."""

import numpy as np
import pytest

from identification.arrays import Array
from identification.estimation.ensemble import ensemble

SPREAD = np.array([1.0, 0.1, 5.0])


def bowl(members: Array) -> Array:
    return np.asarray(np.sum((members / SPREAD) ** 2, axis=1))


@pytest.mark.slow
def test_spread_of_a_normal_density() -> None:
    rng = np.random.default_rng(1)
    found = ensemble(bowl, SPREAD * rng.standard_normal((32, 3)), 3000, rng)
    assert found.converged
    assert np.std(found.samples, axis=0) == pytest.approx(SPREAD, rel=0.15)


def test_a_short_chain_is_called_unconverged() -> None:
    rng = np.random.default_rng(2)
    found = ensemble(bowl, SPREAD * rng.standard_normal((32, 3)), 40, rng)
    assert not found.converged


def test_forbidden_regions_are_not_entered() -> None:
    rng = np.random.default_rng(3)
    first = np.abs(SPREAD * rng.standard_normal((32, 3)))
    found = ensemble(lambda z: np.where(np.all(z > 0, axis=1), bowl(z), np.inf), first, 200, rng)
    assert np.all(found.samples > 0)


def test_the_same_seed_gives_the_same_chain() -> None:
    def once() -> Array:
        rng = np.random.default_rng(4)
        return ensemble(bowl, rng.standard_normal((16, 3)), 50, rng).samples

    assert np.array_equal(once(), once())
