"""Several independent ensembles of walkers, each one of emcee's, sampled until they agree.

Affine-invariant ensembles, Goodman, Weare, Commun. Appl. Math. Comput. Sci. 5 (2010) 65, in emcee,
Foreman-Mackey et al., PASP 125 (2013) 306; most moves are of differential evolution, which cross
the ridges of a rough likelihood: ter Braak, Statistics and Computing 16 (2006) 239. R-hat and
effective sample size are arviz's: Vehtari, Gelman, Simpson, Carpenter, Bürkner, Bayesian Analysis
16 (2021) 667.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import repeat
from typing import Any

import numpy as np

from identification.arrays import Array

ENSEMBLES = 4  # as many as Vehtari et al. (2021) ask for, so that one that is caught is seen
R_HAT_MOST = 1.01  # their limits of chains that can be believed: of R-hat,
ESS_LEAST = 400.0  # and of independent draws of each parameter
WARM_STEPS = 100  # before the first steps that may count; each round then doubles the chain
MOST_CHAIN_STEPS = 6400  # of each walker
WALKERS_APIECE = 4  # walkers for each unknown, in whole blocks of the kernels' lanes (twice 16)
WALKER_BLOCK = 32
MOVE_SHARES = (0.67, 0.33)  # of the moves of differential evolution, and of the stretch moves
Cost = Callable[[Array], Array]


@dataclass(frozen=True, eq=False)
class SampledChains:
    """Chains (ensembles, steps, walkers, d) of the last round, and how they agree.

    r_hat, ess (d,): of each unknown; steps: of each walker, of all rounds.
    """

    chains: Array
    r_hat: Array
    ess: Array
    acceptance: float
    steps: int
    evaluations: int

    @property
    def converged(self) -> bool:
        """Whether the ensembles agree, and are worth enough independent draws."""
        agree = np.max(self.r_hat) <= R_HAT_MOST
        return bool(agree and np.min(self.ess) >= ESS_LEAST)


def walkers_for(unknowns: int) -> int:
    """Walkers of one ensemble."""
    return WALKER_BLOCK * max(1, -(-WALKERS_APIECE * unknowns // WALKER_BLOCK))


def independent_ensembles(
    cost: Cost, seeds: Array, rng: np.random.Generator, *, steps: int = MOST_CHAIN_STEPS,
    on_progress: Callable[[float], None] | None = None,
) -> SampledChains:  # fmt: skip
    """Samples of exp(-cost / 2), in rounds that double until the ensembles agree.

    cost: members (k, d) to costs (k,), infinite where a member cannot be; called from a thread for
    each ensemble. seeds (ensembles, walkers, d): where they begin, of finite cost; steps: of a
    walker at most. Only the last round counts. Sources: Goodman, Weare (2010); Foreman-Mackey et
    al. (2013); limits, Vehtari et al. (2021).
    """
    report = on_progress or (lambda _: None)
    samplers = [_sampler(cost, *own.shape) for own in seeds]
    states = [_state(own, one) for own, one in zip(seeds, rng.spawn(len(seeds)), strict=True)]
    shown = [lambda made: report(made / steps), *[lambda _: None for _ in seeds[1:]]]
    done, now = 0, min(WARM_STEPS, steps)
    with ThreadPoolExecutor(len(seeds)) as pool:
        while True:
            states = list(pool.map(_sampled, samplers, states, repeat(now), shown))
            chains = np.array([one.get_chain(discard=done) for one in samplers])
            done += now
            found = _compared(chains, samplers, done)
            if (done > WARM_STEPS and found.converged) or done >= steps:
                break
            now = min(done, steps - done)
    report(1.0)
    return found


def _sampler(cost: Cost, walkers: int, d: int) -> Any:
    """emcee's sampler of exp(-cost / 2)."""
    import emcee

    def log_probability(members: Array) -> Array:
        values = -0.5 * cost(members)
        return np.where(np.isfinite(values), values, -np.inf)

    moves = list(zip((emcee.moves.DEMove(), emcee.moves.StretchMove()), MOVE_SHARES, strict=True))
    return emcee.EnsembleSampler(walkers, d, log_probability, vectorize=True, moves=moves)


def _state(first: Array, rng: np.random.Generator) -> Any:
    """Walkers (walkers, d) with a random state of their own."""
    import emcee

    drawn = np.random.RandomState(int(rng.integers(2**32)))
    return emcee.State(first, random_state=drawn.get_state())


def _sampled(sampler: Any, state: Any, steps: int, report: Callable[[int], None]) -> Any:
    """The state after so many more steps; report: is given the steps made in all."""
    with np.errstate(invalid="ignore"):  # of walkers where none can be
        for after in sampler.sample(state, iterations=steps, skip_initial_state_check=True):
            state = after
            report(sampler.iteration)
    return state


def _compared(chains: Array, samplers: list[Any], steps: int) -> SampledChains:
    """The chains (ensembles, steps, walkers, d) with how they agree."""
    from arviz_stats.base.array import array_stats

    e, n, w, d = chains.shape
    # An ensemble is one chain in order of time; its walkers are separated for how much it is
    # worth, since a draw says little of the next of the same walker.
    whole = chains.reshape(e, n * w, d)
    apart = np.moveaxis(chains, 2, 1).reshape(e * w, n, d)
    axes = {"chain_axis": 0, "draw_axis": 1}
    return SampledChains(
        chains,
        np.nan_to_num(array_stats.rhat(whole, **axes), nan=np.inf),  # of too short chains
        np.nan_to_num(array_stats.ess(apart, **axes, method="bulk")),
        float(np.mean([one.acceptance_fraction for one in samplers])),
        steps,
        e * w * (1 + steps),
    )
