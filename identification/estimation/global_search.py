"""Global search: differential evolution over many parameter sets at once.

The distance between a log and a simulated run with stick and slip has many local minima, and a
gradient stays in the nearest. The population is evaluated in blocks of lanes, on all cores.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.optimize import differential_evolution

from identification.arrays import Array

MUTATION = (0.4, 0.9)  # of the differences, drawn anew in each generation
CROSSOVER = 0.9
CONVERGED = 1e-4  # relative spread of the costs at which the population has met


def evolved(
    cost: Callable[[Array], Array], first: Array, generations: int, rng: np.random.Generator
) -> Array:
    """The best member (d,) after at most `generations`.

    cost: members (k, d) to costs (k,), infinite or NaN where a member cannot be; first: members
    (k, d) in the unit cube. Stops when the members are alike. Sources: Storn, Price, J. Global
    Optim. 11 (1997) 341; drawn to the best as in Zhang, Sanderson, IEEE Trans. Evol. Comput. 13
    (2009) 945.
    """

    def cost_of(z: Array) -> Array:
        return np.nan_to_num(cost(z.T), nan=np.inf, posinf=np.inf)

    search: Any = differential_evolution  # its stubs know no vectorised cost
    found = search(
        cost_of, [(0.0, 1.0)] * first.shape[1], init=first, maxiter=generations,
        strategy="currenttobest1bin", mutation=MUTATION, recombination=CROSSOVER, tol=CONVERGED,
        polish=False, vectorized=True, updating="deferred", rng=rng,
    )  # fmt: skip
    return np.asarray(found.x, dtype=np.float64)
