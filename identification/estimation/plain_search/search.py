"""A plant of the nine parameters by search, where no run follows from what the equations give."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.estimation.global_search import evolve
from identification.estimation.plain_search.cost import START_V, START_Y
from identification.estimation.plain_search.fitted_runs import total_cost
from identification.estimation.plain_search.local_search import Optimum, refine
from identification.estimation.plain_search.problem import Problem, plant_of, pose
from identification.log import Log, Rig
from identification.model.estimates import Drive
from identification.model.plant import Plant
from identification.progress import Halt, Progress
from identification.simulation.karnopp_step import DV_N, DV_P, F_SN, F_SP

SEARCH_POPULATION = 64
SEARCH_GENERATIONS = 150
# Factors on a residual's bound and on the search's box, of each attempt after the first
LOOSER, WIDER_BOX = 25.0, 3.0
WORTH_A_SEARCH = 300.0  # chi-square over windows up to which a fit is worth a closer search


def searched_plant(
    logs: Sequence[Log], rng: np.random.Generator, *, rig: Rig, drive: Drive, report: Progress,
    attempt: int = 0, halt: Halt | None = None,
) -> Plant:  # fmt: skip
    """The plant of one global search for the nine parameters, without intervals.

    drive: "command" (of a motor too) or "force"; attempt: how many have failed before, perhaps
    around a bad first estimate; halt: asked before each run. Raises NotIdentifiable where nothing
    moves, BadLog where a signal is missing. Source: differential evolution, Storn, Price (1997), of
    the paper's plant.
    """
    problem = pose(logs, rig, drive, halt)
    return plant_of(problem, _search(problem, rng, report, attempt))


def opened(problem: Problem) -> Problem:
    """The problem with each run's first position and velocity unknown."""
    runs = tuple(
        replace(run, open=(START_Y, START_V) if run.start[START_V] != 0.0 else (START_Y,))
        for run in problem.runs
    )
    return replace(problem, runs=runs)


def _search(problem: Problem, rng: np.random.Generator, report: Progress, attempt: int) -> Optimum:
    """The best member of a global search over windows, refined over the whole run."""
    cap, runs = problem.cap * LOOSER**attempt, problem.runs
    box = problem.box.wider(WIDER_BOX**attempt)
    # k1 and k2 come from the regression: searched over in the refinement only.
    population = evolve(
        lambda z: total_cost(runs, box.rows(z), cap),
        box.around(problem.row, SEARCH_POPULATION, 0.15, rng),
        SEARCH_GENERATIONS,
        rng,
        lambda share: report("searching", share),
    )
    start = box.rows(population.members[:1])[0]
    near = refine(runs, start, problem.free, cap=cap)
    optimum = near
    for bound in (cap, 0.0):
        optimum = refine(optimum.runs(problem.long_runs), optimum.p, problem.free, cap=bound)
    lost = optimum.cost > problem.adequate * problem.count
    if lost and problem.drive == "command" and near.cost < WORTH_A_SEARCH * problem.count:
        report("searching near", 0.0)
        rescued = _search_near(problem, near, cap, rng)
        optimum = rescued if rescued.cost < optimum.cost else optimum
    return optimum


def _search_near(problem: Problem, near: Optimum, cap: float, rng: np.random.Generator) -> Optimum:
    """The best of a search over whole runs around a fit that follows windows but lost the whole.

    Windows begin with a measured velocity, whose noise shifts their optimum a little: enough to
    make the whole run stop elsewhere, which no gradient mends.
    """
    row = near.p
    values = np.abs(row[problem.box.free])
    close = np.where(np.isin(problem.box.free, (F_SP, F_SN)), 0.2, 0.02)
    close = np.where(np.isin(problem.box.free, (DV_P, DV_N)), 0.5, close)
    low, high = values * (1 - close), values * (1 + close)
    box = replace(problem.box, low=low, high=high, row=row)
    whole = list(near.runs(problem.long_runs))
    found = evolve(
        lambda z: total_cost(whole, box.rows(z), cap),
        box.around(row, SEARCH_POPULATION, 0.2, rng),
        SEARCH_GENERATIONS,
        rng,
    )
    optimum = refine(whole, box.rows(found.members[:1])[0], problem.free, cap=cap)
    return refine(optimum.runs(whole), optimum.p, problem.free)
