"""A plant of the nine parameters by search, where no run follows from what the equations give."""

from collections.abc import Sequence

import numpy as np

from identification.estimation.global_search import evolve
from identification.estimation.plain_search.fitted_runs import total_cost
from identification.estimation.plain_search.problem import plant_of, pose
from identification.log import Log
from identification.model.estimates import Drive
from identification.model.plant import Plant
from identification.progress import Halt, Progress

SEARCH_POPULATION = 64
SEARCH_GENERATIONS = 150
# Factors on a residual's bound and on the search's box, of each attempt after the first
LOOSER, WIDER_BOX = 25.0, 3.0


def searched_plant(
    logs: Sequence[Log], rng: np.random.Generator, *, drive: Drive, report: Progress,
    attempt: int = 0, halt: Halt | None = None,
) -> Plant:  # fmt: skip
    """The plant of one global search for the nine parameters, without intervals.

    drive: "command" (not of a motor) or "force"; attempt: how many have failed before, perhaps
    around a bad first estimate; halt: asked before each run. Raises NotIdentifiable where nothing
    moves, BadLog where a signal is missing. Source: differential evolution, Storn, Price (1997), of
    the paper's plant.
    """
    problem = pose(logs, drive, halt)
    cap, box = problem.cap * LOOSER**attempt, problem.box.wider(WIDER_BOX**attempt)
    # k1 and k2 come from the regression: what refines the plant moves them.
    population = evolve(
        lambda z: total_cost(problem.runs, box.rows(z), cap),
        box.around(problem.row, SEARCH_POPULATION, 0.15, rng),
        SEARCH_GENERATIONS,
        rng,
        lambda share: report("searching", share),
    )
    return plant_of(problem, box.rows(population.members[:1])[0])
