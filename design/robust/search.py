"""The specification that does best over the machines drawn: poles, integrator, compensator.

Loops are placed so that their margins hold on so many of the machines; then their motion with
friction decides. A few machines sort the candidates, all of them test the best few, and what is
promised at last is counted on machines drawn anew, so that the choice has no part in it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from design.closed_loop.driven_loop import DrivenLoop, driven_loop
from design.controllers.design import POLES_PLACED, placed_design
from design.controllers.usual_compensator import excess_compensator, whole_compensator
from design.filters import scaled_filters
from design.machine.compensator import CompensatorValues, FiltersAt
from design.machine.design import Controller, Design, Structure
from design.machine.model import Model
from design.robust.outcomes import DrawnMachines, Motion, Outcomes, outcomes
from design.tracking import integrates
from design.tune import Asked, Goals
from identification.errors import BadSpecification
from identification.progress import Progress

SPEEDS_TRIED = (1.0, 0.7, 0.5)  # of the fastest loop that keeps its margins
# The whole compensator's e_T and its filters' time constants, in units of the usual ones.
WHOLE_TRIED = ((1.0, 1.0), (0.3, 0.3), (0.1, 0.3))
EXCESS_TRIED = (5.0, 20.0)  # e_T of one that gives the excess alone, in the position's noise
FEW = 6  # machines that sort the candidates
FINALISTS = 2  # candidates that all machines test
# Errors below which less is no better: of step and amplitude; a staircase, in the sensor's noise.
ERROR_FLOOR, STAIR_FLOOR = 1e-3, 5.0
WEIGHED = ("standstill", "tracking", "settling", "staircase")


@dataclass(frozen=True, eq=False)
class Candidate:
    """One of a design's controllers, with or without its compensator."""

    design: Design
    name: Structure
    compensator: bool

    @property
    def controller(self) -> Controller:
        """The controller itself."""
        return self.design.controllers[self.name]

    def loop(self, model: Model) -> DrivenLoop:
        """The loop that it closes."""
        value = self.design.compensator.value if self.compensator else None
        return driven_loop(model, self.design, self.controller, value)


@dataclass(frozen=True)
class Placing:
    """What is asked of the poles and margins, and the period [s], None where it is chosen."""

    asked: Asked
    goals: Goals
    period: float | None = None


def searched(
    machines: DrawnMachines, placing: Placing, motion: Motion, limits: dict[str, float],
    probability: float, rng: np.random.Generator, report: Progress,
) -> tuple[Candidate, int]:  # fmt: skip
    """The best of all candidates by their loops on the machines, and how many there were.

    limits: by measure. Raises BadSpecification where no loop can be placed at all.
    """
    model = machines.model
    every = list(candidates(machines, placing, probability, report))
    seeds = rng.spawn(len(machines.plants))

    def ranked(tried: Sequence[Candidate], on: DrawnMachines, stage: str) -> list[Candidate]:
        """The best first: by what the shares of machines that keep each limit are short of the
        probability, then by the motion."""
        ranks = []
        for i, one in enumerate(tried):
            report(stage, i / len(tried))
            found = outcomes(on, one.loop(model), motion, seeds)
            kept = [float(np.mean(one)) for one in found.within(limits).values()]
            short = sum(max(probability - share, 0.0) for share in kept)
            ranks.append((short, _cost(found, model)))
        order = sorted(range(len(tried)), key=lambda i: ranks[i])
        return [tried[i] for i in order]

    few = replace(machines, plants=machines.plants[:FEW])
    best = ranked(every, few, "loops on a few machines")[:FINALISTS]
    return ranked(best, machines, "loops on all machines")[0], len(every)


def candidates(
    machines: DrawnMachines, placing: Placing, probability: float, report: Progress
) -> Iterator[Candidate]:
    """Every loop that is tried. Raises BadSpecification where none can be placed."""
    refusal: BadSpecification | None = None
    asked = placing.asked
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
        top, period = None, placing.period
        if first is not None:
            top = speed * max(one.dominant[0] for one in first.controllers.values())
            period = first.plant.h
        try:
            found = placed_design(
                machines.model, one, goals=replace(placing.goals, fastest=top),
                source="physical", period=period,
                drawn=lambda plant, force: machines.linear(plant.h, force, probability),
            )  # fmt: skip
        except BadSpecification as error:
            refusal = refusal or error
            continue
        fastest.setdefault(one.integrator, found)
        yield from _of_design(machines.model, found)
    if not fastest:
        raise refusal or BadSpecification("no loop could be placed; give --poles W_N,ZETA")


def _of_design(model: Model, found: Design) -> Iterator[Candidate]:
    """Its controllers that keep their goals, each without and with compensators."""
    names = POLES_PLACED
    admissible = [n for n in names if n in found.controllers and not found.controllers[n].missed]
    for name in admissible or [n for n in names if n in found.controllers]:
        yield Candidate(found, name, compensator=False)
        controller = found.controllers[name]
        for own in compensators(model, controller):
            yield Candidate(replace(found, compensator=own), name, compensator=True)


def compensators(model: Model, controller: Controller) -> Iterator[CompensatorValues]:
    """The compensators that are tried around a controller; beside an integrator, which holds the
    sliding friction, also of the excess alone, where the machine has one."""
    h = controller.h
    whole = whole_compensator(model, h)
    for e_T, times in WHOLE_TRIED:
        filters = FiltersAt.of(scaled_filters(h, times), h)
        yield replace(whole, e_T=e_T * whole.e_T, filters=filters)
    friction = whole.value.friction
    excess = max(friction.F_sp - friction.F_cp, -friction.F_sn - friction.F_cn)
    if excess > 0.0 and model.fit.noise_y > 0.0 and integrates(np.ones(1), controller.rst):
        for many in EXCESS_TRIED:
            yield excess_compensator(model, h, many)


def _cost(found: Outcomes, model: Model) -> float:
    """Mean logarithm of what is weighed, each the median over the machines."""
    floors = dict.fromkeys(WEIGHED, ERROR_FLOOR)
    floors |= {"staircase": STAIR_FLOOR * max(model.fit.noise_y, 1e-12), "settling": 1e-6}
    medians = [max(float(np.median(found.values[n])), floors[n]) for n in WEIGHED]
    return float(np.mean(np.log(medians))) if np.all(np.isfinite(medians)) else np.inf
