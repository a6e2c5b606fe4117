"""The run that makes the parameters asked for surest: D-optimal, by the exact simulation."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from design.experiment.allocation import Allocation, d_optimal
from design.experiment.limits import Peaks, peaks
from design.experiment.search import Criterion, Seen
from design.loop import LoopRun
from identification.arrays import Array, IntArray
from identification.errors import UserError
from identification.experiment.information import Information
from identification.model.plant import Plant

NO_IDEA = 1e3  # relative deviation of what a run says nothing of
UNKNOWN = 1e-12  # of the information's scale, granted where a run says nothing
LOOSE = 0.01  # share of a run that may hang on luck
PER_LOOSE = 300.0  # log of a deviation, that all of a run beyond it is taken to cost


@dataclass(frozen=True, eq=False)
class Machine:
    """A machine in question: what it does along a reference, and what that run tells of it."""

    plant: Plant
    run: Callable[[Array], LoopRun]
    told: Callable[[LoopRun], Information]


def looked_at(machines: Sequence[Machine], r: Array) -> tuple[Peaks, list[Information]] | None:
    """Extremes over all machines along r [m], (n,), and what each run tells; None where one cannot
    be followed."""
    worst: Peaks | None = None
    told = []
    try:
        for one in machines:
            run = one.run(r)
            own = peaks(run)
            worst = own if worst is None else worst.or_more(own)
            told.append(one.told(run))
    except UserError:
        return None
    assert worst is not None
    return worst, told


def precision(machines: Sequence[Machine], asked: Sequence[str]) -> Criterion:
    """The criterion: mean log-determinant of what is told of the asked parameters."""

    def look(r: Array) -> Seen | None:
        found = looked_at(machines, r)
        if found is None:
            return None
        worst, told = found
        places = _places(told[0], asked)
        value = float(np.mean([worth(one, places) for one in told]))
        return Seen(worst, value, told)

    def matrices(seen: Sequence[Seen]) -> list[Array]:
        each: list[list[Information]] = [one.told for one in seen]  # type: ignore[misc]
        return [np.array([told[i].matrix for told in each]) for i in range(len(machines))]

    def places_in(seen: Sequence[Seen]) -> IntArray:
        told: list[Information] = seen[0].told  # type: ignore[assignment]
        return _places(told[0], asked)

    def shared(seen: Sequence[Seen], seconds: Array, room: float) -> Allocation:
        return d_optimal(matrices(seen), places_in(seen), seconds, room)

    def joined(seen: Sequence[Seen], times: Array) -> float:
        places = places_in(seen)
        return float(np.mean([log_det(np.tensordot(times, M, 1), places) for M in matrices(seen)]))

    return Criterion(look, look, shared, joined)


def worth(told: Information, asked: IntArray) -> float:
    """How well a run tells the asked parameters: minus the log of their mean (geometric) relative
    deviation, and of the largest, less what hangs on luck."""
    mean = 0.5 * log_det(told.matrix, asked) / len(asked)
    spread = np.sqrt(np.diag(told.covariance)[asked]) / told.unit[asked]
    least = -float(np.log(min(float(np.max(spread)), NO_IDEA)))
    return mean + least - PER_LOOSE * max(told.loose - LOOSE, 0.0)


def _places(told: Information, asked: Sequence[str]) -> IntArray:
    return np.array([told.names.index(name) for name in asked], dtype=np.int64)


def log_det(matrix: Array, asked: IntArray) -> float:
    """Log-determinant of the information (d, d) of the asked parameters, all others unknown."""
    ridged = matrix + UNKNOWN * np.eye(len(matrix))
    others = np.setdiff1d(np.arange(len(matrix)), asked)
    whole = np.linalg.slogdet(ridged)[1]
    beside = np.linalg.slogdet(ridged[np.ix_(others, others)])[1] if len(others) else 0.0
    return float(whole - beside)
