"""Several independent ensembles of walkers, sampled until they agree.

Each is one of emcee's. Half of its moves are along the walkers' own differences, which cross the
ridges of a rough likelihood; the others are drawn from a t-distribution about what the ensemble has
seen so far: where the likelihood is about normal one of those forgets all that was before.

Affine-invariant ensembles, Goodman, Weare, Commun. Appl. Math. Comput. Sci. 5 (2010) 65, in emcee,
Foreman-Mackey et al., PASP 125 (2013) 306; differential-evolution moves, ter Braak, Statistics and
Computing 16 (2006) 239.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from identification.arrays import Array
from identification.estimation.convergence import bulk_ess, rank_r_hat

ENSEMBLES = 4  # as many as Vehtari et al. (2021) ask for, so that one that is caught is seen
R_HAT_MOST = 1.01  # their limits of chains that can be believed: of R-hat,
ESS_LEAST = 400.0  # and of independent draws of each parameter
WARM_STEPS = 100  # before the first steps that may count; each round then doubles the chain
MOST_CHAIN_STEPS = 6400  # of each walker
WALKERS_APIECE = 4  # walkers for each unknown, in whole blocks of the kernels' lanes (twice 16)
WALKER_BLOCK = 32
OWN_FREEDOM = 8.0  # degrees of freedom of the moves drawn about what has been seen
OWN_WIDTH = 1.1  # times the spread seen: narrower tails than the likelihood's would hold walkers
MOVE_SHARES = (0.4, 0.4, 0.2)  # of the own, the differential-evolution and the stretch moves
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
    walker at most. A round begins with moves made to what the one before has seen, and only the
    last round counts. Sources: Goodman, Weare (2010); Foreman-Mackey et al. (2013); limits, Vehtari
    et al. (2021).
    """
    walks = [_Ensemble(cost, own, one) for own, one in zip(seeds, rng.spawn(len(seeds)),
                                                           strict=True)]  # fmt: skip
    done, now = 0, min(WARM_STEPS, steps)
    with ThreadPoolExecutor(len(walks)) as pool:
        while True:
            shares = [0] * len(walks)

            def report(which: int, made: int, counts: list[int] = shares, was: int = done) -> None:
                counts[which] = made
                if on_progress and which == 0:
                    on_progress((was + min(counts)) / steps)

            jobs = [pool.submit(one.round, now, report, i) for i, one in enumerate(walks)]
            chains = np.array([job.result() for job in jobs])
            done += now
            found = _compared(chains, walks, done)
            if (done > WARM_STEPS and found.converged) or done >= steps:
                break
            now = min(done, steps - done)
    if on_progress:
        on_progress(1.0)
    return found


class _Ensemble:
    """One ensemble of walkers, at the place to which its rounds have brought it."""

    def __init__(self, cost: Cost, first: Array, rng: np.random.Generator) -> None:
        import emcee

        self.cost, self.accepted, self.moves = cost, 0.0, 0
        self.evaluations = len(first)
        self.state = emcee.State(
            first, random_state=np.random.RandomState(int(rng.integers(2**32))).get_state()
        )
        self.seen: Array | None = None

    def round(self, steps: int, report: Callable[[int, int], None], which: int) -> Array:
        """The next steps, (steps, walkers, d)."""
        import emcee

        walkers, d = self.state.coords.shape
        sampler = emcee.EnsembleSampler(
            walkers, d, self._log_probability, vectorize=True, moves=self._moves(d)
        )
        chain = sampler.sample(self.state, iterations=steps, skip_initial_state_check=True)
        with np.errstate(invalid="ignore"):  # a walker where none can be compares infinities
            for made, state in enumerate(chain, start=1):
                self.state = state
                report(which, made)
        self.seen = np.asarray(sampler.get_chain(), dtype=np.float64)
        self.accepted += float(np.mean(sampler.acceptance_fraction)) * steps
        self.moves += steps
        return self.seen

    def _log_probability(self, members: Array) -> Array:
        values = -0.5 * self.cost(members)
        self.evaluations += len(members)
        return np.where(np.isfinite(values), values, -np.inf)

    def _moves(self, d: int) -> Sequence[tuple[object, float]]:
        import emcee

        own, evolution, stretch = MOVE_SHARES
        others = [(emcee.moves.DEMove(), evolution), (emcee.moves.StretchMove(), stretch)]
        if self.seen is None:
            return others
        half = self.seen[len(self.seen) // 2 :].reshape(-1, d)
        return [(emcee.moves.MHMove(_OwnDraw(half), ndim=d), own), *others]


class _OwnDraw:
    """Draws from a t-distribution about samples (k, d), whatever the walkers are."""

    def __init__(self, samples: Array) -> None:
        self.center = np.mean(samples, axis=0)
        self.scale = np.maximum(np.std(samples, axis=0), 1e-300)
        covariance = np.atleast_2d(np.cov(((samples - self.center) / self.scale).T))
        values, vectors = np.linalg.eigh(covariance)
        self.root = OWN_WIDTH * vectors * np.sqrt(np.maximum(values, 1e-12 * values[-1]))
        self.inverse = np.linalg.inv(self.root)

    def __call__(self, members: Array, random: np.random.RandomState) -> tuple[Array, Array]:
        """New members (k, d), and the logarithm of how much likelier the way back is, (k,)."""
        normal = random.standard_normal(members.shape)
        drawn = normal * np.sqrt(OWN_FREEDOM / random.chisquare(OWN_FREEDOM, (len(members), 1)))
        new = self.center + self.scale * (drawn @ self.root.T)
        old = ((members - self.center) / self.scale) @ self.inverse.T
        return new, self._log_density(old) - self._log_density(drawn)

    def _log_density(self, at: Array) -> Array:
        square = np.sum(at**2, axis=1) / OWN_FREEDOM
        return np.asarray(-0.5 * (OWN_FREEDOM + at.shape[1]) * np.log1p(square))


def _compared(chains: Array, walks: Sequence[_Ensemble], steps: int) -> SampledChains:
    """The chains (ensembles, steps, walkers, d) with how they agree."""
    e, n, w, d = chains.shape
    # An ensemble is one chain in order of time; its walkers are separated for how much it is
    # worth, since a draw says little of the next of the same walker.
    r_hat = [rank_r_hat(chains[..., k].reshape(e, n * w)) for k in range(d)]
    apart = np.moveaxis(chains, 2, 1)
    ess = [bulk_ess(apart[..., k].reshape(e * w, n)) for k in range(d)]
    return SampledChains(
        chains, np.array(r_hat), np.array(ess),
        float(np.mean([one.accepted / max(one.moves, 1) for one in walks])), steps,
        sum(one.evaluations for one in walks),
    )  # fmt: skip
