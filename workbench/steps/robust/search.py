"""The specification that does best over the machines drawn: poles, integrator, compensator.

Loops are placed so that their margins hold on so many of the machines; then their motion with
friction decides. A few machines sort the candidates, all of them judge the best few, and what is
promised at last is counted on machines drawn anew, so that the choice has no part in it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from design.filters import CompensatorFilters, scaled_filters
from design.tune import Asked, Goals
from identification.errors import BadSpecification
from identification.progress import Progress
from workbench.documents.design import CompensatorValues, Controller, Design, From, Recommended
from workbench.documents.model import Model
from workbench.steps.closed_loop import DrivenLoop, driven_loop
from workbench.steps.design import placed_design
from workbench.steps.robust.machines import DrawnMachines, some_of
from workbench.steps.robust.outcomes import MEASURES, Motion, Outcomes, outcomes

SPEEDS_TRIED = (1.0, 0.7, 0.5)  # of the fastest loop that keeps its margins
# The compensator's e_T and its filters' time constants, in units of the usual ones; None: without.
COMPENSATIONS: tuple[tuple[float, float] | None, ...] = (None, (1.0, 1.0), (0.3, 0.3), (0.1, 0.3))
FEW = 6  # machines that sort the candidates
FINALISTS = 2  # candidates that all machines judge
# Errors below which less is no better: of step and amplitude; a staircase, in the sensor's noise.
ERROR_FLOOR, STAIR_FLOOR = 1e-3, 5.0
WEIGHED = ("standstill", "tracking", "settling", "staircase")


@dataclass(frozen=True, eq=False)
class Candidate:
    """One of a design's controllers, with or without its compensator, and what came of it."""

    design: Design
    name: Recommended
    compensator: bool
    found: Outcomes | None = None

    @property
    def controller(self) -> Controller:
        """The controller itself."""
        return self.design.controllers[self.name]

    def loop(self, model: Model) -> DrivenLoop:
        """The loop that it closes."""
        value = self.design.compensator.value if self.compensator else None
        return driven_loop(model, self.design, self.controller, value)


@dataclass(frozen=True, eq=False)
class Searched:
    """The candidate chosen, how many were tried, and whether it kept every limit in the search."""

    chosen: Candidate
    tried: int
    keeps: bool


def searched(
    machines: DrawnMachines, asked: Asked, goals: Goals, where: tuple[From | None, float | None],
    motion: Motion, limits: dict[str, float], probability: float, rng: np.random.Generator,
    report: Progress,
) -> Searched:  # fmt: skip
    """The best of all candidates by their loops on the machines.

    where: linear plant and period asked for; limits: by measure. Raises BadSpecification where no
    loop can be placed at all.
    """
    model = machines.model
    every = list(candidates(machines, asked, goals, where, probability, report))
    seeds = rng.spawn(len(machines.plants))
    sorted_by = some_of(machines, min(FEW, len(machines.plants)))
    tried: list[Candidate] = []
    for i, one in enumerate(every):
        report("loops on a few machines", i / len(every))
        found = outcomes(sorted_by, one.loop(model), motion, seeds)
        tried.append(replace(one, found=found))

    def rank(one: Candidate) -> tuple[float, float]:
        return _short(one, limits, probability), _cost(one, model)

    tried.sort(key=rank)
    best: list[Candidate] = []
    for i, one in enumerate(tried[:FINALISTS]):
        report("loops on all machines", i / FINALISTS)
        best.append(replace(one, found=outcomes(machines, one.loop(model), motion, seeds)))
    chosen = min(best, key=rank)
    return Searched(chosen, len(every), _short(chosen, limits, probability) == 0.0)


def candidates(
    machines: DrawnMachines, asked: Asked, goals: Goals, where: tuple[From | None, float | None],
    probability: float, report: Progress,
) -> Iterator[Candidate]:  # fmt: skip
    """Every loop that is tried. Raises BadSpecification where none can be placed."""
    refusal: BadSpecification | None = None
    placed = 0
    wanted = [
        (replace(asked, integrator=integrator), speed)
        for integrator in ((True, False) if asked.integrator else (False,))
        for speed in (SPEEDS_TRIED if asked.dominant is None else (1.0,))
    ]
    fastest: dict[bool, Design] = {}
    for i, (one, speed) in enumerate(wanted):
        report("placing poles", i / len(wanted))
        first = fastest.get(one.integrator)
        if speed < 1.0 and first is None:
            continue
        top = None if first is None else _speed(first) * speed
        period = where[1] if first is None else first.plant.h
        try:
            found = placed_design(
                machines.model, one, goals=replace(goals, fastest=top), source=where[0],
                period=period,
                drawn=lambda plant, force: machines.linear(plant.h, force, probability),
            )  # fmt: skip
        except BadSpecification as error:
            refusal = refusal or error
            continue
        fastest.setdefault(one.integrator, found)
        for candidate in _of_design(found):
            placed += 1
            yield candidate
    if not placed:
        raise refusal or BadSpecification("no loop could be placed; give --poles W_N,ZETA")


def _speed(found: Design) -> float:
    return max(one.dominant[0] for one in found.controllers.values())


def _of_design(found: Design) -> Iterator[Candidate]:
    """Its controllers that keep their goals, each without and with compensators."""
    names: tuple[Recommended, ...] = ("rst", "pid")
    kept = [n for n in names if n in found.controllers and not found.controllers[n].missed]
    for name in kept or [n for n in names if n in found.controllers]:
        for sizes in COMPENSATIONS:
            if sizes is None:
                yield Candidate(found, name, compensator=False)
            else:
                own = compensator_of(found.compensator, *sizes)
                yield Candidate(replace(found, compensator=own), name, compensator=True)


def compensator_of(usual: CompensatorValues, e_T: float, filters: float) -> CompensatorValues:
    """The compensator with e_T and its filters' time constants in units of the usual ones."""
    period = usual.h or 0.0
    own: CompensatorFilters | None = scaled_filters(period, filters) if period else usual.filters
    return replace(usual, e_T=e_T * usual.e_T, filters=own)


def _short(one: Candidate, limits: dict[str, float], probability: float) -> float:
    """By how much the shares of machines that keep each limit fall short of the probability."""
    assert one.found is not None
    kept = one.found.kept(limits)
    return float(sum(max(probability - float(np.mean(k)), 0.0) for k in kept.values()))


def _cost(one: Candidate, model: Model) -> float:
    """Mean logarithm of what is weighed, each the median over the machines."""
    assert one.found is not None
    floors = dict.fromkeys(WEIGHED, ERROR_FLOOR)
    floors |= {"staircase": STAIR_FLOOR * max(model.fit.noise_y, 1e-12), "settling": 1e-6}
    medians = [max(float(np.median(one.found.values[n])), floors[n]) for n in WEIGHED]
    return float(np.mean(np.log(medians))) if np.all(np.isfinite(medians)) else np.inf


def spread_of(found: Outcomes, names: Sequence[str] = ()) -> dict[str, tuple[float, float, float]]:
    """5 %, median and 95 % of each measure over the machines."""
    wanted = names or [one.name for one in MEASURES if one.name in found.values]
    out = {}
    for name in wanted:
        low, middle, high = np.quantile(found.values[name], (0.05, 0.5, 0.95), method="nearest")
        out[name] = (float(low), float(middle), float(high))
    return out
