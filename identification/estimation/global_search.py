"""Global search: differential evolution over many parameter sets at once.

The distance between a log and a simulated run with stick and slip has many local minima, and a
gradient stays in the nearest. The population is evaluated in blocks of lanes, on all cores.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.arrays import Array

LEADERS = 8  # members that draw the others
CROSSOVER = 0.9
CONVERGED = 1e-4  # relative spread of the costs at which the population has met


@dataclass(frozen=True)
class Population:
    """Members (k, d) in the unit cube, best first, and their costs (k,)."""

    members: Array
    costs: Array


def evolve(
    cost: Callable[[Array], Array],
    first: Array,
    generations: int,
    rng: np.random.Generator,
    on_progress: Callable[[float], None] | None = None,
) -> Population:
    """Population after at most `generations`, towards one of its leaders at every move.

    cost: members (k, d) to costs (k,), infinite or NaN where a member cannot be; first: members
    (k, d) in the unit cube. Stops when the median member is as good as the best. Sources: Storn,
    Price, J. Global Optim. 11 (1997) 341; drawn to one of the best as in Zhang, Sanderson, IEEE
    Trans. Evol. Comput. 13 (2009) 945.
    """
    z = np.array(first, dtype=np.float64)
    k = len(z)
    costs = _finite(cost(z))
    for generation in range(generations):
        leaders = z[np.argsort(costs)[:LEADERS]]
        one, two = _pairs(k, rng)
        pull = rng.uniform(0.4, 0.9, (k, 1))
        trial = z + pull * (leaders[rng.integers(0, LEADERS, k)] - z) + pull * (z[one] - z[two])
        trial = np.where(rng.random(z.shape) < CROSSOVER, trial, z)
        trial = _reflected(trial)
        found = _finite(cost(trial))
        better = found < costs
        z[better], costs[better] = trial[better], found[better]
        if on_progress:
            on_progress((generation + 1) / generations)
        if np.median(costs) <= costs.min() * (1 + CONVERGED):
            break
    order = np.argsort(costs)
    return Population(z[order], costs[order])


def _pairs(k: int, rng: np.random.Generator) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Two different members for each of `k`."""
    one = rng.integers(0, k, k)
    return one, (one + rng.integers(1, k, k)) % k


def _reflected(z: Array) -> Array:
    """Members outside the unit cube, mirrored back at its faces."""
    return 1.0 - np.abs(1.0 - np.abs(np.remainder(z, 2.0)))


def _finite(costs: Array) -> Array:
    return np.where(np.isfinite(costs), costs, np.inf)
