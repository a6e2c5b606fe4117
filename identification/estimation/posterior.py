"""Posterior of the fitted parameters by an ensemble of walkers, started from the global optimum."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from identification.arrays import Array
from identification.estimation.ensemble import ensemble
from identification.estimation.plain_search.likely_sets import granted_samples, log_cost, reweighed
from identification.estimation.plain_search.local_search import pack, refine
from identification.estimation.plain_search.problem import pose
from identification.estimation.recorded_logs import recorded_logs
from identification.log import Log, Rig
from identification.model.estimates import KarnoppFit
from identification.model.plant import Actuator
from identification.simulation.karnopp_step import K2, kernel_parameters

POSTERIOR_WALKERS = 64
POSTERIOR_STEPS = 6000


@dataclass(frozen=True)
class Posterior:
    """Samples (k, d) of the parameters `names` (d,), and whether the chain can be believed.

    autocorrelation: the longest, in steps; `converged` where the kept half of the chain is at
    least 50 of them long; `verdict` says so in words.
    """

    names: tuple[str, ...]
    samples: Array
    autocorrelation: float
    acceptance: float
    walkers: int
    steps: int
    converged: bool
    verdict: str

    def interval(self, level: float = 0.95) -> Mapping[str, tuple[float, float, float]]:
        """Median and the bounds of the central `level` interval, by name: (low, median, high)."""
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
    walkers: int = POSTERIOR_WALKERS,
    steps: int = POSTERIOR_STEPS,
    on_progress: Callable[[float], None] | None = None,
) -> Posterior:
    """Posterior of a fit's parameters on the logs it was made from, under flat priors.

    The walkers start around the fit. Where the fit leaves more than noise, a set's likelihood is
    that of as many independent samples as the residual's correlation leaves.
    """
    problem = pose(recorded_logs(logs, rig, fit.drive).plain, rig, fit.drive)
    k1, k2 = 0.0, float(problem.row[K2])
    if problem.drive == "command":
        assert isinstance(fit.actuator, Actuator)
        k1, k2 = fit.actuator.k1, fit.actuator.k2
    row = kernel_parameters(fit.friction.array, k1, k2)
    optimum = refine(problem.long_runs, row, problem.free)
    runs = optimum.runs(problem.long_runs)
    granted = None
    if fit.adequate and problem.drive == "command":
        runs = [reweighed(run, optimum.p) for run in runs]
        optimum = refine(runs, optimum.p, problem.free)
    else:
        granted = granted_samples(problem, optimum)
    center = pack(runs, optimum.p, optimum.starts, optimum.free)
    spread = np.sqrt(np.diag(optimum.covariance)) if granted is None else 0.01 * optimum.scale
    first = center + spread * rng.standard_normal((walkers, len(center)))
    cost = log_cost(problem, runs, optimum, problem.box.wider(4.0), granted)
    walk = ensemble(cost, first, steps, rng, on_progress)
    names = tuple(fit.free)
    samples = walk.samples[:, : len(names)]
    return Posterior(
        names=names,
        samples=samples,
        autocorrelation=walk.autocorrelation,
        acceptance=walk.acceptance,
        walkers=walkers,
        steps=steps,
        converged=walk.converged,
        verdict=_verdict(walk.converged, steps, walk.autocorrelation),
    )


def _verdict(converged: bool, steps: int, autocorrelation: float) -> str:
    if not np.isfinite(autocorrelation):
        return "not converged: the chain is too short to tell; take more steps"
    length = f"{steps - steps // 2} kept steps are {(steps - steps // 2) / autocorrelation:.0f}"
    if converged:
        return f"converged: {length} autocorrelation times long"
    return f"not converged: {length} autocorrelation times long, 50 needed; take more steps"
