"""Parameter sets that explain whole runs down to white noise about equally, and their mean."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.arrays import Array
from identification.estimation.plain_search.fitted_runs import FittedRun, total_cost
from identification.estimation.plain_search.local_search import (
    Optimum,
    moved_optimum,
    pack,
    refine,
    sample,
    unpack,
)
from identification.estimation.plain_search.problem import Problem
from identification.estimation.plain_search.search_bounds import Box
from identification.progress import Halt, Progress

# What walls of the likelihood add to the spread of a converged cloud, and to the minimum's where
# none converges; chosen for the coverage on seeds 1000 to 3060 of benchmarks/nine_parameters.py.
ROUGH = (1.1, 1.3)


@dataclass(frozen=True)
class Solution:
    """Optimum, equally likely samples (k, free), how it was reached, and the noise [m], [N]."""

    optimum: Optimum
    samples: Array
    chi_square: float
    adequate: bool
    evaluations: int
    noise: tuple[float, float]


def weigh_noise(
    problem: Problem, optimum: Optimum, rng: np.random.Generator, spent: int, report: Progress
) -> Solution:
    """A fit that leaves noise: its level taken from the residual, then the likelihood's cloud.

    Source: adaptive importance sampling, Cappé et al., J. Comput. Graph. Stat. 13 (2004) 907; the
    factors ROUGH are ours.
    """
    runs = list(optimum.runs(problem.long_runs))
    for _ in range(4):
        runs = [reweighed(run, optimum.p) for run in optimum.runs(runs)]
        before = optimum
        optimum = refine(runs, optimum.p, problem.free)
        spent += optimum.evaluations
        if np.allclose(optimum.p, before.p, rtol=1e-6):
            break
    report("weighing", 0.0)
    cloud = sample(runs, optimum, rng)
    spent += cloud.evaluations
    if cloud.converged:
        members = cloud.members[rng.choice(len(cloud.weights), 1024, p=cloud.weights)]
        rough = ROUGH[0]
    else:
        center = pack(runs, optimum.p, optimum.starts, optimum.free)
        members = rng.multivariate_normal(center, optimum.covariance, 1024, check_valid="ignore")
        rough = ROUGH[1]
    members = np.mean(members, axis=0) + rough * (members - np.mean(members, axis=0))
    optimum = _centred(runs, optimum, members)
    # Against the noise seen in the signals themselves, not against that of the residual.
    as_logged = optimum.runs(problem.long_runs)
    chi_square = float(total_cost(as_logged, optimum.p[None], 0.0)[0]) / problem.count
    measured = runs[0].measured
    force = 1.0 / measured.weight_force if measured.weight_force > 0 else 0.0
    noise = (1.0 / measured.weight_y, force)
    adequate = chi_square <= problem.adequate
    return Solution(optimum, members, chi_square, adequate, spent, noise)


def log_cost(runs: Sequence[FittedRun], optimum: Optimum, box: Box) -> Callable[[Array], Array]:
    """Minus twice the log likelihood of unknowns (k, d), infinite outside `box`: of the paper's
    plant with white normal noise.

    Walkers are halted between their steps: of what a cost raises, emcee would print a traceback.
    """
    runs = [replace(run, halt=Halt()) for run in runs]

    def cost(members: Array) -> Array:
        sets, begun = unpack(runs, optimum.p, optimum.starts, optimum.free, members)
        inside = box.holds(sets)
        values = np.full(len(members), np.inf)
        if inside.any():
            begun = np.ascontiguousarray(begun[:, inside])
            values[inside] = total_cost(runs, sets[inside], 0.0, begun)
        return values

    return cost


def reweighed(run: FittedRun, p: Array) -> FittedRun:
    """The run with its noise levels set to what the fit leaves."""
    y = _channel(run, p, True)
    force = _channel(run, p, False) if run.measured.weight_force > 0 else 0.0
    measured = replace(
        run.measured,
        weight_y=1.0 / y,
        weight_force=1.0 / force if force > 0 else 0.0,
    )
    return replace(run, measured=measured)


def _channel(run: FittedRun, p: Array, position: bool) -> float:
    """Root mean square residual of the position [m] or the force [N]."""
    measured = replace(
        run.measured,
        weight_y=1.0 if position else 0.0,
        weight_force=0.0 if position else 1.0,
    )
    one = replace(run, measured=measured)
    return float(np.sqrt(total_cost([one], p[None], 0.0)[0] / len(measured.y)))


def _centred(runs: Sequence[FittedRun], optimum: Optimum, members: Array) -> Optimum:
    """The optimum at the members' mean, or at the best point where the mean falls off a ridge."""
    mean = np.mean(members, axis=0)
    covariance = np.atleast_2d(np.cov(members.T))
    center = moved_optimum(runs, optimum, mean, covariance)
    if center.cost <= optimum.cost + 2.0 * len(mean) + 20.0:
        return center
    sets, begun = unpack(runs, optimum.p, optimum.starts, optimum.free, members)
    costs = total_cost(runs, sets, 0.0, begun)
    best = int(np.argmin(costs))
    if costs[best] < optimum.cost:
        return moved_optimum(runs, optimum, members[best], covariance)
    return replace(optimum, covariance=covariance)
