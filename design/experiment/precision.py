"""The run that makes the parameters asked for surest: D-optimal, by the exact simulation."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from design.experiment.allocation import d_optimal
from design.experiment.limits import Peaks, peaks
from design.experiment.search import Criterion, Evaluated, Joint
from design.loop import LoopRun
from identification.arrays import Array, IntArray
from identification.errors import UserError
from identification.estimation.estimates import Events, events_of
from identification.experiment.information import Information
from identification.thresholds import EVENTS_NEEDED

NO_IDEA = 1e3  # relative deviation of what a run says nothing of
UNKNOWN_RIDGE = 1e-12  # of the information's scale, granted where a run says nothing
# Share of a run that may be sensitive to chance: by the command of an actuator a fit follows it as
# a whole, and loses its way there; where a force drives it, in windows, of which some may be lost.
CHAOTIC_WHOLE, CHAOTIC_WINDOWS = 0.02, 0.3
WANTED_EVENTS = 2 * EVENTS_NEEDED  # events of each kind, of which another machine may lose some
PER_EVENT = 2.0  # log of a deviation, that each of them is worth
PER_CHAOTIC = 300.0  # log of a deviation, that all of a run beyond it is taken to cost


@dataclass(frozen=True, eq=False)
class Machine:
    """A machine in question: what it does along a reference, and what that run identifies of it;
    whole: a fit follows its runs as a whole."""

    run: Callable[[Array], LoopRun]
    information: Callable[[LoopRun], Information]
    whole: bool

    def chance_penalty(self, information: Information) -> float:
        """What it costs that a part of a run is sensitive to chance."""
        return PER_CHAOTIC * max(
            information.chaotic - (CHAOTIC_WHOLE if self.whole else CHAOTIC_WINDOWS), 0.0
        )


def evaluated(
    machines: Sequence[Machine], r: Array
) -> tuple[Peaks, list[Information], list[Events]] | None:
    """Extremes over all machines along r [m], (n,), what each run identifies, and what happens in
    it; None where one cannot be followed."""
    worst: Peaks | None = None
    information, events = [], []
    try:
        for one in machines:
            run = one.run(r)
            own = peaks(run)
            worst = own if worst is None else worst.or_more(own)
            information.append(one.information(run))
            events.append(events_of([run.mode], [run.v]))
    except UserError:
        return None
    assert worst is not None
    return worst, information, events


def precision(machines: Sequence[Machine], asked: Sequence[str]) -> Criterion:
    """The criterion: log-determinant of the information on the asked parameters, the mean over the
    machines for the shares of the time; and for a whole run `worth` on the machine that it
    identifies least of."""

    def evaluate(r: Array) -> Evaluated | None:
        found = evaluated(machines, r)
        if found is None:
            return None
        worst, information, events = found
        places = _places(information[0], asked)
        values = [
            worth(own, places) - one.chance_penalty(own) - PER_EVENT * missing(happens, asked)
            for one, own, happens in zip(machines, information, events, strict=True)
        ]
        return Evaluated(worst, min(values), information)

    def joint(seen: Sequence[Evaluated]) -> Joint:
        information = information_by_segment(seen)
        places = _places(information[0][0], asked)
        matrices = stacked(information)
        first = [one[0] for one in information]

        def measure(times: Array) -> float:
            sums = [np.tensordot(times, M, 1) for M in matrices]
            return float(np.mean([log_det(M, places) for M in sums]))

        def value(times: Array) -> float:
            sums = [np.tensordot(times, M, 1) for M in matrices]
            both = zip(first, sums, strict=True)
            return min(worth(replace(one, matrix=M), places) for one, M in both)

        return Joint(
            lambda seconds, room: d_optimal(matrices, places, seconds, room), measure, value
        )

    return Criterion(evaluate, joint)


def missing(happens: Events, asked: Sequence[str]) -> float:
    """Breakaways and crossings of the band's limit that a fit would want beside those of a run."""
    out = 0.0
    for name in asked:
        side = 1 if name.endswith("n") else 0
        if name.startswith("F_s"):
            out += max(WANTED_EVENTS - happens.breakaways[side], 0)
        elif name.startswith("dv"):
            out += max(WANTED_EVENTS - happens.crossings[side], 0)
    return out


def information_by_segment(seen: Sequence[Evaluated]) -> list[list[Information]]:
    """The information of each segment, a list a machine."""
    each: list[list[Information]] = [one.information for one in seen]  # type: ignore[misc]
    return [list(one) for one in zip(*each, strict=True)]


def stacked(information: Sequence[Sequence[Information]]) -> list[Array]:
    """Their matrices, (k, d, d) a machine."""
    return [np.array([one.matrix for one in own]) for own in information]


def _places(information: Information, asked: Sequence[str]) -> IntArray:
    return np.array([information.names.index(name) for name in asked], dtype=np.int64)


def worth(information: Information, asked: IntArray) -> float:
    """How well a run identifies the asked parameters: minus the log of their mean (geometric)
    relative deviation, and of the largest."""
    mean = 0.5 * log_det(information.matrix, asked) / len(asked)
    least = -float(np.log(min(float(np.max(information.deviations[asked])), NO_IDEA)))
    return mean + least


def log_det(matrix: Array, asked: IntArray) -> float:
    """Log-determinant of the information (d, d) of the asked parameters, all others unknown."""
    ridged = matrix + UNKNOWN_RIDGE * np.eye(len(matrix))
    others = np.setdiff1d(np.arange(len(matrix)), asked)
    whole = np.linalg.slogdet(ridged)[1]
    beside = np.linalg.slogdet(ridged[np.ix_(others, others)])[1] if len(others) else 0.0
    return float(whole - beside)
