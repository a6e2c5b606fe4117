"""Ensembles on known densities: their spread, when they stop, and what they say if they differ."""

import numpy as np
import pytest

from identification.arrays import Array
from identification.estimation.independent_ensembles import (
    ENSEMBLES,
    WALKER_BLOCK,
    SampledChains,
    independent_ensembles,
    walkers_for,
)

SPREAD = np.array([1.0, 0.1, 5.0])


def bowl(members: Array) -> Array:
    return np.asarray(np.sum((members / SPREAD) ** 2, axis=1))


def seeds(seed: int, d: int = 3) -> Array:
    rng = np.random.default_rng(seed)
    drawn = rng.standard_normal((ENSEMBLES, walkers_for(d), d))
    return np.asarray(2.0 * drawn * SPREAD[:d])


def test_spread_of_a_normal_density() -> None:
    shares: list[float] = []
    found = independent_ensembles(
        bowl, seeds(1), np.random.default_rng(1), on_progress=shares.append
    )
    assert found.converged
    assert np.std(found.chains.reshape(-1, 3), axis=0) == pytest.approx(SPREAD, rel=0.05)
    assert shares[-1] == 1.0 and shares == sorted(shares)
    assert found.evaluations > found.chains[..., 0].size


@pytest.mark.slow
def test_a_bent_density_is_sampled_until_the_ensembles_agree() -> None:
    def banana(x: Array) -> Array:
        return np.asarray(x[:, 0] ** 2 + 25.0 * (x[:, 1] - x[:, 0] ** 2) ** 2)

    found = independent_ensembles(banana, seeds(2, 2), np.random.default_rng(2))
    assert found.converged
    first, second = found.chains.reshape(-1, 2).T
    assert np.std(first) == pytest.approx(1.0, rel=0.05)
    assert np.mean(second) == pytest.approx(1.0, rel=0.1)


@pytest.mark.slow
def test_ensembles_in_different_places_do_not_converge() -> None:
    def two(x: Array) -> Array:
        return np.asarray(np.minimum(np.sum((x - 30.0) ** 2, axis=1), np.sum((x + 30.0) ** 2, 1)))

    begun = np.sign(np.arange(ENSEMBLES) - 1.5)[:, np.newaxis, np.newaxis] * 30.0
    first = begun + np.random.default_rng(3).standard_normal((ENSEMBLES, WALKER_BLOCK, 2))
    found = independent_ensembles(two, first, np.random.default_rng(4), steps=400)
    assert not found.converged
    assert found.steps == 400
    assert np.min(found.r_hat) > 1.05


def test_forbidden_regions_are_not_entered() -> None:
    def half(z: Array) -> Array:
        return np.where(np.all(z > 0, axis=1), bowl(z), np.inf)

    found = independent_ensembles(half, np.abs(seeds(5)), np.random.default_rng(5))
    assert np.all(found.chains > 0)
    assert np.mean(found.chains, axis=(0, 1, 2)) == pytest.approx(
        SPREAD * np.sqrt(2.0 / np.pi), rel=0.05
    )


@pytest.mark.slow
def test_the_same_seed_gives_the_same_chains() -> None:
    def once() -> Array:
        rng = np.random.default_rng(6)
        return independent_ensembles(bowl, seeds(6), rng, steps=150).chains

    assert np.array_equal(once(), once())


def test_what_is_asked_of_the_figures_decides() -> None:
    def chains(r_hat: float, ess: float) -> SampledChains:
        return SampledChains(np.zeros((4, 1, 1, 1)), np.array([r_hat]), np.array([ess]), 0.3, 1, 1)

    assert chains(1.009, 450.0).converged  # limits halved to 1.005, doubled to 800, would refuse it
    assert not chains(1.018, 450.0).converged
    assert not chains(1.009, 250.0).converged
    assert not chains(float("nan"), 450.0).converged


def test_walkers_are_many_times_the_unknowns_in_whole_blocks() -> None:
    assert [walkers_for(d) for d in (1, 8, 9, 14, 17)] == [32, 32, 64, 64, 96]
