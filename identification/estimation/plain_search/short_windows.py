"""A log cut into short stretches, each with its own start, that are then joined to longer ones.

Over a whole log a small error of a parameter makes the body stop elsewhere, so the distance has
many local minima, and the more the longer the log. Over a short stretch it has few. Each stretch
has its own first position and velocity among the unknowns (multiple shooting, Bock 1983), and
joined stretches start from parameters and states that the shorter ones gave.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.arrays import Array, IntArray
from identification.estimation.plain_search.cost import START_G, START_V, START_Y, RestartWindows
from identification.estimation.plain_search.fitted_runs import FittedRun, rest_windows

HALVES = (15, 7)  # samples either side of a moving start that a cubic is put through
CUBIC = 3
CUBIC_FITS = 1.3  # times the noise that the cubic may leave
SURELY_MOVES = 4.0  # sigma of the velocity from which a body moves significantly
PLACES_TRIED = 8  # places tried within the length of a stretch


def stretch_windows(run: FittedRun, seconds: float) -> RestartWindows:
    """Restarts about `seconds` apart, at a rest where there is one, else in smooth motion.

    The first one starts the log. Of the places in motion the one is taken that a cubic follows
    best: its state is a first guess only (multiple shooting, Bock 1983).
    """
    measured = run.measured
    y, h, sigma = measured.y, measured.h, 1.0 / measured.weight_y
    step = max(1, round(seconds / h))
    rests = rest_windows(y, sigma, h, seconds / 2)
    rows = [(0, float(rests.y[0]), 0.0)]
    moving = _moving_starts(y, h, sigma, max(1, step // PLACES_TRIED))
    while (earliest := rows[-1][0] + step) < len(y) - step // 2:
        rest = int(np.searchsorted(rests.at, earliest))
        slot = moving[(moving[:, 0] >= earliest) & (moving[:, 0] < earliest + step)]
        if rest < len(rests.at) and (rests.at[rest] < earliest + step // 2 or not len(slot)):
            rows.append((int(rests.at[rest]), float(rests.y[rest]), 0.0))
        elif len(slot):
            # The first that leaves noise, else the one that leaves least.
            best = slot[int(np.argmin(np.maximum(slot[:, 3], CUBIC_FITS)))]
            rows.append((int(best[0]), float(best[1]), float(best[2])))
        else:
            break
    at, here, speed = zip(*rows, strict=True)
    return RestartWindows(np.array(at, dtype=np.int64), np.array(here), np.array(speed))


def _moving_starts(y: Array, h: float, sigma: float, hop: int) -> Array:
    """Places in motion, every `hop` samples: sample, position, velocity, residual/noise (k, 4)."""
    found: dict[int, tuple[float, float, float]] = {}
    for half in HALVES:
        if len(y) < 4 * half:
            continue
        x = np.arange(-half, half + 1) * h
        basis = np.vander(x / x[-1], CUBIC + 1, increasing=True)
        inverse = np.linalg.pinv(basis)
        sd = sigma * float(np.linalg.norm(inverse[1])) / x[-1]
        middles = np.arange(half, len(y) - half, hop)
        rows = np.lib.stride_tricks.sliding_window_view(y, 2 * half + 1)[::hop]
        theta = rows @ inverse.T
        left = np.sqrt(np.sum((rows - theta @ basis.T) ** 2, axis=1) / (len(x) - CUBIC - 1))
        for k in np.flatnonzero(np.abs(theta[:, 1]) > SURELY_MOVES * sd * x[-1]):
            at, ratio = int(middles[k]), float(left[k]) / sigma
            if at not in found or found[at][2] > CUBIC_FITS:
                found[at] = (float(theta[k, 0]), float(theta[k, 1]) / x[-1], ratio)
    return np.array([[at, *found[at]] for at in sorted(found)]).reshape(-1, 4)


@dataclass(frozen=True)
class Stretches:
    """Whole runs, and the parts of each in their order, every part with its own start."""

    runs: tuple[FittedRun, ...]
    parts: tuple[tuple[FittedRun, ...], ...]

    @property
    def all(self) -> list[FittedRun]:
        """The parts of all runs, one after the other."""
        return [part for parts in self.parts for part in parts]

    @property
    def whole(self) -> bool:
        """Whether every run is in one part."""
        return all(len(parts) == 1 for parts in self.parts)

    def begun(self, starts: Array) -> "Stretches":
        """The same parts with these starts (parts of all runs, 3)."""
        fresh = iter([replace(part, start=s) for part, s in zip(self.all, starts, strict=True)])
        return replace(self, parts=tuple(tuple(next(fresh) for _ in parts) for parts in self.parts))

    def restarted(self) -> list[FittedRun]:
        """The runs with restarts where their parts begin."""
        out = []
        for run, parts in zip(self.runs, self.parts, strict=True):
            starts = np.array([part.start for part in parts])
            windows = RestartWindows(_bounds(parts)[:-1], starts[:, START_Y], starts[:, START_V])
            out.append(replace(run, windows=windows, start=starts[0]))
        return out

    def longer(self, each: int, apart: Sequence[bool] = ()) -> "Stretches":
        """Groups of `each` neighbouring parts as one, begun where the first of them was.

        apart: of every group, in order, whether it stays as it is.
        """
        grouped = []
        group = 0
        for run, parts in zip(self.runs, self.parts, strict=True):
            bounds = _bounds(parts).tolist()
            made: list[FittedRun] = []
            for low in range(0, len(parts), each):
                high = min(low + each, len(parts))
                if apart and apart[group]:
                    made.extend(parts[low:high])
                else:
                    made.append(_part(run, bounds[low], bounds[high], parts[low].start))
                group += 1
            grouped.append(tuple(made))
        return replace(self, parts=tuple(grouped))


def stretches(runs: Sequence[FittedRun], seconds: float) -> Stretches:
    """The runs cut about every `seconds`, where the state is at least roughly known.

    Source: multiple shooting, Bock (1983).
    """
    parts = []
    for run in runs:
        windows = stretch_windows(run, seconds)
        bounds = [*windows.at.tolist(), len(run.measured.y)]
        constant = np.full(len(windows.at), run.start[START_G])
        starts = np.column_stack([windows.y, windows.v, constant])
        starts[0] = run.start
        parts.append(
            tuple(
                _part(run, low, high, start)
                for low, high, start in zip(bounds[:-1], bounds[1:], starts, strict=True)
            )
        )
    return Stretches(tuple(runs), tuple(parts))


def _bounds(parts: Sequence[FittedRun]) -> IntArray:
    """Samples at which the parts of a run begin, and its length."""
    lengths = np.array([len(part.measured.y) for part in parts], dtype=np.int64)
    return np.concatenate([np.zeros(1, dtype=np.int64), np.cumsum(lengths)])


def _part(run: FittedRun, low: int, high: int, start: Array) -> FittedRun:
    """Samples `low` to `high` of the run; the state in motion is unknown, at rest the position."""
    whole = run.measured
    cut = slice(low, high)
    measured = replace(
        whole,
        y=whole.y[cut],
        force=whole.force[cut],
        u=whole.u[cut],
        impulse=whole.impulse[cut],
        slope_y=whole.slope_y[cut],
        slope_force=whole.slope_force[cut],
    )
    opened = [START_Y]
    if start[START_V] != 0.0:
        opened.append(START_V)
    if START_G in run.open:
        opened.append(START_G)
    windows = RestartWindows(np.zeros(1, dtype=np.int64), start[START_Y : START_Y + 1], np.zeros(1))
    return replace(run, measured=measured, windows=windows, start=start, open=tuple(opened))
