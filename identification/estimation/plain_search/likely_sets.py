"""Parameter sets that explain whole runs about equally, and their mean.

Where white noise is left: the likelihood itself. Where more is left than any parameters explain,
the single best set is an accident, and the mean of all that do about as well is not (measured on
EMPS: single optima give 3.3 to 9.3 mm on PULSES, the mean 3.1 to 3.6).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.arrays import Array
from identification.arx.residual_tests import effective_samples
from identification.estimation.ensemble import ensemble
from identification.estimation.plain_search.cost import START_G, START_V, START_Y
from identification.estimation.plain_search.fitted_runs import FittedRun, total_cost
from identification.estimation.plain_search.local_search import (
    Cloud,
    Optimum,
    moved_optimum,
    pack,
    refine,
    sample,
    unpack,
)
from identification.estimation.plain_search.problem import Problem, simulated
from identification.estimation.plain_search.search_bounds import Box
from identification.progress import Halt, Progress
from identification.simulation.karnopp_step import F_SN, F_SP, K1, K2

# Independent samples granted to a residual that is not noise
LEAST_GRANTED, MOST_GRANTED = 12.0, 400.0
# What walls of the likelihood add to the spread of a settled cloud, and of walkers in one that
# did not settle; chosen for the coverage on seeds 1000 to 3060 of benchmarks/nine_parameters.py.
ROUGH = (1.1, 1.3)
TRUST = 1.5  # factor around the force equation's parameters in which a misfit is averaged
TRUST_STICK = 2.5  # stick limit over Coulomb friction at most
SLIDING_INDICES, STICKING_INDICES = np.arange(0, 5), np.array([F_SP, F_SN])
FIT_WALKERS = 64
WALK_STEPS = 200
LONG_WALK = 1500


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
    """A fit that leaves noise: its level taken from the residual, then the likelihood's cloud."""
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
    if cloud.settled:
        index = rng.choice(len(cloud.weights), 1024, p=cloud.weights)
        members = cloud.members[index]
        rough = ROUGH[0]
    else:
        cost = log_cost(problem, runs, optimum, problem.box.wider(2.0), None)
        members = walk(cost, _seeds(cloud, rng), WALK_STEPS, rng, report)
        members = _widened(members, optimum.covariance)
        rough = ROUGH[1]
        spent += FIT_WALKERS * WALK_STEPS
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


def weigh_misfit(
    problem: Problem,
    optimum: Optimum,
    searched: Array,
    rng: np.random.Generator,
    spent: int,
    report: Progress,
) -> Solution:
    """A fit that leaves more than noise: the mean over all sets that explain the log as well.

    searched: parameters (k, 11) that the search ended with, where half of the walkers begin.
    The residual counts for as many independent samples as its correlation leaves of it, at least
    FEWEST; a set is then as likely as (mean square)^(-n/2).
    """
    box = trusted_box(problem)
    runs = optimum.runs(problem.long_runs)
    chi_square = optimum.cost / problem.count
    granted = granted_samples(problem, optimum)
    rows = searched[: FIT_WALKERS // 2].copy()
    rows[:, [K1, K2]] = np.where(problem.free[-1] == K2, rows[:, [K1, K2]], optimum.p[[K1, K2]])
    seeds = np.array([pack(runs, row, optimum.starts, problem.free) for row in rows])
    around = _jitter(runs, optimum, FIT_WALKERS - len(seeds), rng)
    seeds = np.concatenate([around, _jittered_starts(seeds, problem, runs, rng)])
    shared = len(box.free)
    seeds[:, :shared] = box.moved_inside(seeds[:, :shared])
    cost = log_cost(problem, runs, optimum, box, granted)
    members = walk(cost, seeds, LONG_WALK, rng, report)
    spent += FIT_WALKERS * LONG_WALK
    covariance = np.cov(members.T)
    optimum = moved_optimum(runs, optimum, _central(runs, optimum, members), covariance)
    adequate = chi_square <= problem.adequate
    return Solution(optimum, members, chi_square, adequate, spent, problem.noise)


def trusted_box(problem: Problem) -> Box:
    """The search's box cut to what the force equation, regressed alone, allows by a wide margin.

    A position that drifts for a whole log bounds the parameters poorly; the force does not.
    """
    box = problem.box.wider(2.0)
    found = [first.nine for first in problem.firsts if first.sliding is not None]
    if not found:
        return box
    nine = np.abs(np.median(found, axis=0))
    low, high = box.low.copy(), box.high.copy()
    low[SLIDING_INDICES] = np.maximum(low[SLIDING_INDICES], nine[SLIDING_INDICES] / TRUST)
    high[SLIDING_INDICES] = np.minimum(high[SLIDING_INDICES], nine[SLIDING_INDICES] * TRUST)
    stick = nine[[1, 2]] * TRUST_STICK
    high[STICKING_INDICES] = np.minimum(high[STICKING_INDICES], stick)
    return replace(box, low=low, high=high)


def _central(runs: Sequence[FittedRun], optimum: Optimum, members: Array) -> Array:
    """Mean (d,) of the members, or the nearest good member where the mean itself fits badly.

    The likely sets can lie on a bent ridge, beside which their mean falls.
    """
    sets, begun = unpack(runs, optimum.p, optimum.starts, optimum.free, members)
    costs = total_cost(runs, sets, 0.0, begun)
    mean: Array = np.mean(members, axis=0)
    if moved_optimum(runs, optimum, mean, optimum.covariance).cost <= float(np.median(costs)):
        return mean
    good = members[costs <= np.quantile(costs, 0.25)]
    away = np.sum(((good - mean) / np.maximum(np.std(members, axis=0), 1e-300)) ** 2, axis=1)
    return np.asarray(good[np.argmin(away)])


def walk(
    cost: Callable[[Array], Array],
    seeds: Array,
    steps: int,
    rng: np.random.Generator,
    report: Progress,
) -> Array:
    """At most 1024 samples (k, d) of walkers from `seeds`."""
    sound = seeds[np.all(np.isfinite(seeds), axis=1)]
    seeds = sound[np.arange(len(seeds)) % len(sound)]
    # No two walkers may agree: their differences are the steps.
    size = 1e-9 * np.maximum(np.abs(seeds), np.std(seeds, axis=0))
    seeds = seeds + size * rng.standard_normal(seeds.shape)
    found = ensemble(cost, seeds, steps, rng, lambda share: report("weighing", share))
    keep = rng.choice(len(found.samples), min(1024, len(found.samples)), replace=False)
    return found.samples[keep]


def log_cost(
    problem: Problem, runs: Sequence[FittedRun], optimum: Optimum, box: Box, granted: float | None
) -> Callable[[Array], Array]:
    """Minus twice the log likelihood of unknowns (k, d), infinite outside `box`.

    granted: where the residual is a misfit, for how many independent samples it counts. Walkers are
    halted between their steps: of what a cost raises, emcee would print a traceback.
    """
    runs = [replace(run, halt=Halt()) for run in runs]

    def cost(members: Array) -> Array:
        sets, begun = unpack(runs, optimum.p, optimum.starts, optimum.free, members)
        inside = box.holds(sets)
        values = np.full(len(members), np.inf)
        if inside.any():
            begun = np.ascontiguousarray(begun[:, inside])
            values[inside] = total_cost(runs, sets[inside], 0.0, begun)
        if granted is not None:
            return granted * np.log(values / problem.count)
        return values

    return cost


def granted_samples(problem: Problem, optimum: Optimum) -> float:
    """Independent samples for which a misfit's position residual counts."""
    residuals = [simulated(problem, optimum, i).y - log["y"] for i, log in enumerate(problem.logs)]
    return float(np.clip(effective_samples(residuals), LEAST_GRANTED, MOST_GRANTED))


def _seeds(cloud: Cloud, rng: np.random.Generator) -> Array:
    """Walkers (WALKERS, d) from the best members of a cloud that did not settle."""
    order = np.argsort(cloud.costs)[: FIT_WALKERS // 2]
    members = cloud.members[order]
    pairs = rng.integers(0, len(members), (FIT_WALKERS - len(members), 2))
    between = 0.5 * (members[pairs[:, 0]] + members[pairs[:, 1]])
    return np.concatenate([members, between])


def _widened(members: Array, covariance: Array) -> Array:
    """Samples (k, d) spread, about their mean, at least as widely as `covariance` (d, d).

    Walls in the likelihood can hold walkers in one of its chambers, narrower than the whole.
    """
    mean = np.mean(members, axis=0)
    spread = np.maximum(np.std(members, axis=0), 1e-300)
    factor = np.maximum(1.0, np.sqrt(np.diag(covariance)) / spread)
    return np.asarray(mean + factor * (members - mean))


def _jitter(
    runs: Sequence[FittedRun], optimum: Optimum, count: int, rng: np.random.Generator
) -> Array:
    """Walkers (count, d) a percent around the optimum."""
    theta = pack(runs, optimum.p, optimum.starts, optimum.free)
    return theta + 0.01 * optimum.scale * rng.standard_normal((count, len(theta)))


def _jittered_starts(
    seeds: Array, problem: Problem, runs: Sequence[FittedRun], rng: np.random.Generator
) -> Array:
    """Seeds (k, d) with the runs' starts spread by their noise, so that no two agree."""
    low = len(problem.free)
    out = seeds.copy()
    for run in runs:
        sigma = 1.0 / run.measured.weight_y
        for entry in run.open:
            spread = {START_Y: sigma, START_V: 0.1 * sigma / run.measured.h, START_G: 1e-3}[entry]
            out[:, low] += spread * rng.standard_normal(len(seeds))
            low += 1
    return out


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
