"""Logs cut into windows in which a position is predicted from where it is measured to be."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from identification.arrays import Array, BoolArray, IntArray
from identification.errors import NotIdentifiable
from identification.log import Log
from identification.signals.noise import local_noise
from identification.velocity.model import Valve, moved

AHEAD = 2.0  # s, over which a position is predicted
SHORTLY_AHEAD = 0.2  # s, the same
RUN_IN = 1.0  # s at the start of a log, in which commands act that were given before it
MOST_FOLDS = 5
SLOWEST_PERIOD = 0.2  # s, of which a window has ten
FEWEST_AHEAD = 4  # of all logs, below which no error of them is given


@dataclass(frozen=True, eq=False)
class Run:
    """One log: position y and command u (n,), constant over each period h [s]; z: place (n,) in the
    travel from -0.5 to 0.5, None where no structure asks for it."""

    name: str
    y: Array
    u: Array
    h: float
    z: Array | None = None

    @property
    def begin(self) -> int:
        """The first sample that is compared."""
        return round(RUN_IN / self.h)

    def starts(self, length: float) -> IntArray:
        """First samples of the windows of so many seconds; what is less at the end is left out."""
        size = max(2, round(length / self.h))
        return np.arange(self.begin, len(self.y) - size + 1, size)


@dataclass(frozen=True, eq=False)
class Record:
    """The runs of one machine; u_max: largest size of the command; noise: of the position [m]."""

    runs: tuple[Run, ...]
    u_max: float
    noise: float

    @cached_property
    def windows(self) -> int:
        """Windows of `AHEAD` in all runs."""
        return sum(len(run.starts(AHEAD)) for run in self.runs)

    def errors(self, valve: Valve) -> tuple[Array, ...]:
        """Measured less predicted position (n,) of each run, up to a constant [m]."""
        return tuple(run.y - moved(run.u, run.h, valve, self.u_max, run.z).y for run in self.runs)

    def split(self, errors: Sequence[Array], length: float) -> list[Array]:
        """The errors of the runs, a row for each of their windows of so many seconds."""
        out = []
        for run, e in zip(self.runs, errors, strict=True):
            size = max(2, round(length / run.h))
            out.append(e[run.starts(length)[:, np.newaxis] + np.arange(size)])
        return out

    def squares(self, valve: Valve, length: float = AHEAD) -> Array:
        """Mean square error [m²] of the position in each window of `AHEAD`, (windows,).

        The position is predicted over `length` [s] from where it is measured to be, then anew.
        """
        errors = self.errors(valve)
        out = []
        for run, rows in zip(self.runs, self.split(errors, length), strict=True):
            square = np.mean((rows - rows[:, :1]) ** 2, axis=1)
            size = run.starts(AHEAD)[:, np.newaxis]
            inside = (run.starts(length) >= size) & (
                run.starts(length) < size + round(AHEAD / run.h)
            )
            out.append(inside @ square / np.maximum(inside.sum(axis=1), 1))
        return np.concatenate(out)

    @property
    def travel(self) -> tuple[float, float]:
        """Lowest and highest measured position [m]."""
        low = min(float(run.y.min()) for run in self.runs)
        return low, max(float(run.y.max()) for run in self.runs)

    def placed(self, valve: Valve, travel: tuple[float, float]) -> "Record":
        """The same with the place in the travel [m], as the valve predicts it in each window."""
        low, span, runs = travel[0], travel[1] - travel[0], list[Run]()
        for run, e in zip(self.runs, self.errors(valve), strict=True):
            starts = run.starts(AHEAD)
            at = np.searchsorted(starts, np.arange(len(run.y)), side="right") - 1
            anchor = e[starts[np.maximum(at, 0)]] if len(starts) else e
            runs.append(replace(run, z=(run.y - e + anchor - low) / span - 0.5))
        return replace(self, runs=tuple(runs))


def recorded(logs: Sequence[Log]) -> Record:
    """The record of logs on an even clock, with position `y` and command `u`.

    Raises BadLog where a signal is missing, NotIdentifiable where they are too short, sampled too
    slowly, or the command never changes.
    """
    for log in logs:
        if log.h > SLOWEST_PERIOD:
            raise NotIdentifiable(
                f"{log.name}: sampled every {log.h:.3g} s, at most {SLOWEST_PERIOD:g} s needed to"
                " see how the velocity follows the command; log faster"
            )
    runs = tuple(Run(log.name, log["y"], log["u"], log.h) for log in logs)
    found = Record(
        runs,
        max(float(np.max(np.abs(run.u))) for run in runs),
        max(_noise(run.y) for run in runs),
    )
    if found.windows < FEWEST_AHEAD:
        last = sum(log.duration for log in logs)
        raise NotIdentifiable(
            f"{runs[0].name}: lasts {last:.3g} s, at least {FEWEST_AHEAD * AHEAD + RUN_IN:g} s"
            f" needed ({FEWEST_AHEAD} windows of {AHEAD:g} s); log for longer"
        )
    if not any(np.ptp(run.u) > 0.0 for run in runs):
        raise NotIdentifiable(
            f"{runs[0].name}: the command stays at {runs[0].u[0]:.4g}, so nothing follows it; log"
            " with a command that goes both ways"
        )
    return found


def _noise(y: Array) -> float:
    """Deviation of a sensor's error [m]: its white noise, and the counts of an encoder."""
    return local_noise(y)


def folds(record: Record, count: int) -> IntArray:
    """To which of `count` stretches each window of the record belongs, (windows,)."""
    return np.arange(record.windows) * count // record.windows


def chosen(record: Record, where: BoolArray) -> tuple[BoolArray, ...]:
    """The windows of each run among those `where` (windows,)."""
    counts = np.cumsum([len(run.starts(AHEAD)) for run in record.runs])[:-1]
    return tuple(np.split(where, counts))
