"""Posterior by an ensemble of walkers (emcee) on the vectorised cost, with a verdict.

The likelihood of parameters with stick and slip is rough; walkers that step along each other's
differences cross its ridges. A chain that has not run for 50 autocorrelation times is said to be
unconverged, whatever its intervals look like.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from identification.arrays import Array

LONG_ENOUGH = 50.0  # autocorrelation times that make a chain long enough


@dataclass(frozen=True)
class Ensemble:
    """Samples (k, d) after the first half is left out, and how far they can be trusted.

    autocorrelation: the longest of the unknowns, in steps; acceptance: share of accepted moves;
    `converged` where the chain is at least 50 autocorrelation times long.
    """

    samples: Array
    autocorrelation: float
    acceptance: float
    steps: int
    converged: bool


def ensemble(
    cost: Callable[[Array], Array],
    first: Array,
    steps: int,
    rng: np.random.Generator,
    on_progress: Callable[[float], None] | None = None,
) -> Ensemble:
    """Samples of exp(-cost / 2), from walkers that start at `first` (walkers, d).

    cost: members (k, d) to costs (k,), infinite where a member cannot be. Walkers must be more
    than twice the unknowns. Source: Foreman-Mackey et al., emcee, 2013; differential evolution
    moves of ter Braak 2006.
    """
    import emcee

    def log_probability(members: Array) -> Array:
        values = -0.5 * cost(members)
        return np.where(np.isfinite(values), values, -np.inf)

    walkers, d = first.shape
    sampler = emcee.EnsembleSampler(
        walkers,
        d,
        log_probability,
        vectorize=True,
        moves=[(emcee.moves.DEMove(), 0.7), (emcee.moves.StretchMove(), 0.3)],
    )
    state = np.random.RandomState(int(rng.integers(2**32))).get_state()
    begin = emcee.State(first, random_state=state)
    chain = sampler.sample(begin, iterations=steps, skip_initial_state_check=True)
    # A walker that starts where no member can be compares infinity with infinity, and stays.
    with np.errstate(invalid="ignore"):
        for done, _ in enumerate(chain, start=1):
            if on_progress:
                on_progress(done / steps)
        longest = float(np.max(sampler.get_autocorr_time(tol=0, discard=steps // 2)))
    kept = sampler.get_chain(discard=steps // 2, flat=True)
    length = steps - steps // 2
    return Ensemble(
        samples=np.asarray(kept, dtype=np.float64),
        autocorrelation=longest,
        acceptance=float(np.mean(sampler.acceptance_fraction)),
        steps=steps,
        converged=bool(np.isfinite(longest) and length >= LONG_ENOUGH * longest),
    )
