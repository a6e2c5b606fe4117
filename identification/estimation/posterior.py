"""Posterior of a fit's parameters by several independent ensembles, started around the fit."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from identification.arrays import Array
from identification.estimation.independent_ensembles import (
    ENSEMBLES,
    ESS_LEAST,
    MOST_CHAIN_STEPS,
    R_HAT_MOST,
    SampledChains,
    independent_ensembles,
    walkers_for,
)
from identification.estimation.likelihood import Likelihood, likelihood_of
from identification.log import Log, Rig
from identification.model.estimates import KarnoppFit

BEGUN_WIDER = 1.5  # times the fit's deviations, about which walkers begin: wider than they end
DRAWN_CLOSER = 0.5  # of that, where too few of them can be
DRAWN_ROUNDS = 12


@dataclass(frozen=True, eq=False)
class Posterior:
    """Chains (ensembles, draws, d) of the parameters `names` (d,), and whether to believe them.

    A chain holds one walker's steps after another's. r_hat: rank-normalised, of the ensembles; ess:
    independent draws that all are worth; both by name. way: on what the likelihood is; evaluations:
    of it, in all; steps: of a walker. `verdict` says in a line whether it has converged.
    """

    names: tuple[str, ...]
    chains: Array
    r_hat: Mapping[str, float]
    ess: Mapping[str, float]
    way: str
    acceptance: float
    walkers: int
    steps: int
    evaluations: int
    converged: bool
    verdict: str

    @property
    def ensembles(self) -> int:
        """How many were sampled independently."""
        return len(self.chains)

    @property
    def samples(self) -> Array:
        """The draws of all ensembles, (k, d)."""
        return self.chains.reshape(-1, len(self.names))

    def interval(self, level: float = 0.95) -> Mapping[str, tuple[float, float, float]]:
        """Median and the bounds of the central `level` interval, by name: (low, median, high).

        Empty where the chains have not converged: their spread is then none of the posterior.
        """
        if not self.converged:
            return MappingProxyType({})
        tails = np.array([0.5 - 0.5 * level, 0.5, 0.5 + 0.5 * level])
        bounds = np.quantile(self.samples, tails, axis=0)
        rows = {name: tuple(bounds[:, i].tolist()) for i, name in enumerate(self.names)}
        return MappingProxyType({name: (a, b, c) for name, (a, b, c) in rows.items()})


def sample_posterior(
    fit: KarnoppFit,
    logs: Sequence[Log],
    rng: np.random.Generator,
    *,
    rig: Rig,
    steps: int = MOST_CHAIN_STEPS,
    on_progress: Callable[[float], None] | None = None,
) -> Posterior:
    """Posterior of a fit's parameters, effects' too, on the logs that it was made from.

    By the likelihood by which the fit has converged, with its noise, under flat priors inside the
    estimator's bounds. steps: of each walker at most; it ends when the ensembles agree. Sources:
    Goodman, Weare (2010), Foreman-Mackey et al. (2013); convergence, Vehtari et al. (2021).
    """
    found = likelihood_of(fit, logs, rig)
    seeding, walking, between = rng.spawn(3)
    seeds = _seeds(found, seeding)
    sampled = independent_ensembles(
        found.cost, seeds, walking, steps=steps, on_progress=on_progress
    )
    chains = np.moveaxis(sampled.chains, 2, 1)
    chains = chains.reshape(len(seeds), -1, len(found.names))
    return Posterior(
        names=found.names,
        chains=chains + found.further * between.standard_normal(chains.shape),
        r_hat=dict(zip(found.names, sampled.r_hat.tolist(), strict=True)),
        ess=dict(zip(found.names, sampled.ess.tolist(), strict=True)),
        way=found.way,
        acceptance=sampled.acceptance,
        walkers=seeds.shape[1],
        steps=sampled.steps,
        evaluations=sampled.evaluations,
        converged=sampled.converged,
        verdict=_verdict(found, sampled),
    )


def _seeds(found: Likelihood, rng: np.random.Generator) -> Array:
    """Where the walkers begin, (ensembles, walkers, u), each where it can be."""
    d = len(found.center)
    count = ENSEMBLES * walkers_for(d)
    values, vectors = np.linalg.eigh(0.5 * (found.covariance + found.covariance.T))
    root = BEGUN_WIDER * vectors * np.sqrt(np.maximum(values, 0.0))
    seeds = np.empty((0, d))
    for _ in range(DRAWN_ROUNDS):
        drawn = found.center + rng.standard_normal((2 * count, d)) @ root.T
        seeds = np.concatenate([seeds, drawn[np.isfinite(found.cost(drawn))]])
        if len(seeds) >= count:
            break
        root *= DRAWN_CLOSER
    # Where hardly any can be they begin at the same few, apart by next to nothing.
    seeds = np.concatenate([seeds, found.center[np.newaxis]])
    picked = seeds[np.arange(count) % len(seeds)]
    size = 1e-9 * np.maximum(np.abs(picked), np.std(seeds, axis=0))
    picked = picked + size * rng.standard_normal(picked.shape)
    return np.asarray(picked.reshape(ENSEMBLES, -1, d))


def _verdict(found: Likelihood, sampled: SampledChains) -> str:
    """One line: whether the ensembles agree, by what figures, and what to do where not."""
    worst, least = int(np.argmax(sampled.r_hat)), int(np.argmin(sampled.ess))
    figures = (
        f"R-hat at most {sampled.r_hat[worst]:.3f} ({found.names[worst]}), at least"
        f" {sampled.ess[least]:.0f} independent draws ({found.names[least]})"
    )
    if sampled.converged:
        return f"converged: {figures}, of {len(sampled.chains)} ensembles on {found.way}"
    return (
        f"not converged, so no interval: {figures}; R-hat up to {R_HAT_MOST} and {ESS_LEAST:.0f}"
        " draws needed: log for longer, or fix what is not identifiable from the logs"
    )
