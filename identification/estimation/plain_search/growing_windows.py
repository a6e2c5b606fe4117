"""Search on short stretches of the logs, then on ever longer ones.

For logs on which a search over long windows is lost: with many stops, without a rest to restart
from, or driven by a motor, whose position has no spring to bring it back. The stretches' states
are unknowns, so what the short ones leave is noise where the parameters are right, and there the
longer ones begin. The search is by differential evolution with the residual bounded tightly and
widely in turn (either alone fails on some logs), then for one direction's friction alone.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import cycle

import numpy as np

from identification.arrays import Array, IntArray
from identification.estimation.global_search import evolve
from identification.estimation.plain_search.fitted_runs import FittedRun, total_cost
from identification.estimation.plain_search.local_search import Optimum, refine
from identification.estimation.plain_search.problem import Problem
from identification.estimation.plain_search.search_bounds import Box
from identification.estimation.plain_search.short_windows import Stretches, stretches
from identification.estimation.regression.sliding_friction import fit_sliding
from identification.progress import Progress
from identification.simulation.karnopp_step import DV_N, DV_P, F_CN, F_CP, F_SN, F_SP, F_VN, F_VP
from identification.thresholds import ADEQUATE

# Of the first stretches: length at least, number at most
FIRST_SECONDS, FIRST_SAMPLES, FIRST_PARTS = 0.4, 50, 64
JOINED = 3  # stretches made into one at every step
TIGHT = 25.0  # bound of a squared residual, beside the problem's own
SLIDING_SPEEDS = (0.05, 0.3)  # of the largest speed, above which samples are taken to slide
# Range around a regression's sliding parameters: its sd, and at least
SLIDING_DEVIATIONS, LEAST_SLIDING_RANGE = 5.0, 0.02
# Searches in turn: residual bounded tightly or not, sliding close to a regression or anywhere.
CLIMB_ATTEMPTS = ((False, True), (True, True), (True, False))
CLIMB_ROUNDS = 6
WIDER = 3.0  # times the box of a search over long windows
CLIMB_POPULATION, CLIMB_GENERATIONS, NEAR_GENERATIONS = 64, 150, 60
PARAMETERS_OF_SIDE = ((F_CP, F_VP, DV_P, F_SP), (F_CN, F_VN, DV_N, F_SN))
SAME_MINIMUM = 1.002  # relative cost of two searches that have found the same minimum
# The same where nothing fits, and chi-square from which nothing does
SAME_MINIMUM_OF_MISFIT, NOTHING_FITS = 1.05, 1e4
LOST_A_STOP = 3.0  # times the adequate chi-square from which stretches have lost a stop
# Standard deviations around shorter stretches' fit that a longer one may need
REACH_IN_DEVIATIONS = 8.0
LEAST_GAIN_OF_ROUND = 0.003  # relative gain of a round below which there is no other


def climb(problem: Problem, rng: np.random.Generator, report: Progress) -> Optimum:
    """The fit over whole runs that short stretches lead to, or over the longest that it follows.

    Sources: multiple shooting, Bock (1983); differential evolution, Storn, Price (1997); joining of
    stretches and the searches of one direction are ours.
    """
    box = problem.box.wider(WIDER)
    # A motor's first range of the band is narrow; short stretches show more of it.
    box = replace(box, low=np.where(np.isin(box.free, (DV_P, DV_N)), box.low / WIDER, box.low))
    problem = replace(problem, box=box)
    cut = stretches(problem.runs, _length(problem))
    best = _attempted(problem, cut, rng, report)
    if best.cost > NOTHING_FITS * problem.count:
        return best
    for narrow in range(CLIMB_ROUNDS):
        found = _by_side(problem, cut.begun(best.starts), best, 0.3 ** (narrow % 3), rng)
        same = found.cost > best.cost * (1 - LEAST_GAIN_OF_ROUND)
        best = found if found.cost < best.cost else best
        if same and (best.cost <= ADEQUATE * problem.count or narrow >= CLIMB_ROUNDS // 2):
            break
    if best.cost > LOST_A_STOP * ADEQUATE * problem.count:
        return best
    return _joined(problem, cut.begun(best.starts), best, rng)


def _attempted(
    problem: Problem, cut: Stretches, rng: np.random.Generator, report: Progress
) -> Optimum:
    """The best of searches over the stretches until two of them agree on it.

    A single one can be caught beside the minimum with little more than noise left. Where they
    agree on much more than noise, the narrower searches that follow may still find it.
    """
    boxes = cycle(_regressed(problem))
    found: list[Optimum] = []
    for attempt, (tight, close) in enumerate(CLIMB_ATTEMPTS):
        report("searching stretches", attempt / len(CLIMB_ATTEMPTS))
        box, row = next(boxes) if close else (problem.box, problem.row)
        found.append(_searched(problem, box, row, cut, TIGHT if tight else problem.cap, rng))
        found.sort(key=lambda one: one.cost)
        best = found[0].cost / problem.count
        second = found[1].cost / found[0].cost if len(found) > 1 else np.inf
        if best <= ADEQUATE and second < SAME_MINIMUM:
            break
        if best > NOTHING_FITS and second < SAME_MINIMUM_OF_MISFIT:
            break
    return found[0]


def _length(problem: Problem) -> float:
    """Length of the first stretches [s]."""
    longest = max(run.measured.h for run in problem.runs) * FIRST_SAMPLES
    total = sum(len(run.measured.y) * run.measured.h for run in problem.runs)
    return float(max(FIRST_SECONDS, longest, total / FIRST_PARTS))


def _regressed(problem: Problem) -> list[tuple[Box, Array]]:
    """Boxes with mass and sliding friction close to what regressions say, and rows within them."""
    out = []
    for share in SLIDING_SPEEDS:
        fits = [
            fit_sliding(log, first, share, held=problem.hold)
            for log, first in zip(problem.logs, problem.firsts, strict=True)
        ]
        found = [one for one in fits if one is not None]
        if not found:
            continue
        five = np.median([one.five for one in found], axis=0)
        off = np.maximum(
            SLIDING_DEVIATIONS * np.median([one.sd for one in found], axis=0),
            LEAST_SLIDING_RANGE * five,
        )
        known = np.flatnonzero((five > 0) & (off < five))
        low, high, row = problem.box.low.copy(), problem.box.high.copy(), problem.row.copy()
        low[known], high[known], row[known] = (five - off)[known], (five + off)[known], five[known]
        out.append((replace(problem.box, low=low, high=high), row))
    return out or [(problem.box, problem.row)]


def _searched(
    problem: Problem,
    box: Box,
    row: Array,
    cut: Stretches,
    cap: float,
    rng: np.random.Generator,
) -> Optimum:
    """The best of a global search over the stretches, refined with their starts."""
    runs = cut.restarted()
    first = box.around(row, CLIMB_POPULATION, 0.15, rng)
    found = evolve(lambda z: total_cost(runs, box.rows(z), cap), first, CLIMB_GENERATIONS, rng)
    row = box.rows(found.members[:1])[0]
    near = refine(cut.all, row, problem.free, cap=cap)
    return _refined(problem, cut.begun(near.starts), near.p)


def _refined(problem: Problem, cut: Stretches, row: Array) -> Optimum:
    """The nearest minimum over the stretches and their starts, outliers bounded at first."""
    near = refine(cut.all, row, problem.free, cap=problem.cap)
    return refine(cut.begun(near.starts).all, near.p, problem.free)


def _by_side(
    problem: Problem, cut: Stretches, best: Optimum, narrow: float, rng: np.random.Generator
) -> Optimum:
    """Another band and stick limit of either direction, where one fits better.

    What sliding shows is known closely by now; the narrower its range, the better the chance of
    finding the other two, whose minima are narrow and many. narrow: factor on that range.
    """
    misfit = best.cost / problem.count
    share = narrow * float(np.clip(0.02 * np.sqrt(misfit), 0.01, 0.5))
    runs, row = cut.restarted(), best.p
    low, high = problem.box.low, problem.box.high
    for side in PARAMETERS_OF_SIDE:
        free: IntArray = np.array(side, dtype=np.int64)
        sliding = np.abs(row[free[:2]])
        box = Box(
            free,
            np.concatenate([sliding * (1 - share), low[free[2:]]]),
            np.concatenate([sliding * (1 + share), high[free[2:]]]),
            row,
        )
        row = _evolved(problem, box, runs, rng)
    return _refined(problem, cut, row)


def _evolved(
    problem: Problem, box: Box, runs: Sequence[FittedRun], rng: np.random.Generator
) -> Array:
    """Best row (11,) of a search anywhere in a small box, its own row among the first."""
    first = rng.random((CLIMB_POPULATION, len(box.free)))
    first[0] = box.point(box.row)
    found = evolve(
        lambda z: total_cost(runs, box.rows(z), problem.cap), first, NEAR_GENERATIONS, rng
    )
    best: Array = box.rows(found.members[:1])[0]
    return best


def _joined(problem: Problem, cut: Stretches, best: Optimum, rng: np.random.Generator) -> Optimum:
    """The fit carried from the stretches over longer ones, to whole runs where it follows them."""
    enough = ADEQUATE * problem.count
    while not cut.whole:
        longer = cut.longer(JOINED)
        found = _refined(problem, longer, best.p)
        if found.cost > enough:
            row = _evolved(problem, _close(problem, best), longer.restarted(), rng)
            rescued = _refined(problem, longer, row)
            found = rescued if rescued.cost < found.cost else found
        if found.cost > enough and best.cost <= enough:
            longer, found = _kept(problem, cut, best)
            if found.cost > enough or len(longer.all) == len(cut.all):
                break
        best, cut = found, longer.begun(found.starts)
    return best


def _kept(problem: Problem, cut: Stretches, best: Optimum) -> tuple[Stretches, Optimum]:
    """Stretches joined except where that loses a stop that the parts have, and their fit."""
    longer = cut.longer(JOINED)
    costs = [float(total_cost([part], best.p[None], 0.0)[0]) for part in longer.all]
    lost = [
        not cost <= LOST_A_STOP * ADEQUATE * part.measured.count
        for cost, part in zip(costs, longer.all, strict=True)
    ]
    kept = cut.longer(JOINED, lost)
    return kept, _refined(problem, kept, best.p)


def _close(problem: Problem, best: Optimum) -> Box:
    """The box within reach of what the stretches give for each of the nine."""
    free = problem.box.free[:9]
    size = np.abs(best.p[free])
    off = REACH_IN_DEVIATIONS * np.sqrt(np.maximum(np.diag(best.covariance)[:9], 0.0))
    off = np.clip(off, 1e-4 * size, 0.5 * size)
    return Box(free, size - off, size + off, best.p)
