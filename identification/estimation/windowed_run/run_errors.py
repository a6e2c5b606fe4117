"""What a plant's free run in windows leaves of the logs, and the robust costs made of it."""

from collections.abc import Callable, Sequence

import numpy as np

from identification.arrays import Array, BoolArray, IntArray
from identification.estimation.regression.equation_rows import MotionLog
from identification.estimation.windowed_run.parameters import is_unanchored
from identification.estimation.windowed_run.windows import (
    RUN_WINDOW,
    WHOLE,
    Freed,
    freed,
    left_in_windows,
    starts,
    window_of,
    window_residual,
)
from identification.model.estimates import Drive
from identification.model.plant import Plant
from identification.thresholds import ADEQUATE, CHANCE_WINDOWS

NOISE_LOSS = 0.8732  # mean robust square of white noise of unit variance
CANNOT_BE_FOLLOWED = 1e6  # error of a run that cannot be followed
ROBUST_FROM = 3.0  # residual in noise units from which it counts less
Judge = Callable[[Plant], Array]


def judge(
    plant: Plant, logs: Sequence[MotionLog], drive: Drive, seconds: float, *, every: bool = False
) -> Judge:
    """Errors of a plant like this one, in units of the sensors' noise: position (and, driven by the
    command, force) over all logs, less what the windows' uncertain states account for.

    Windows that this plant loses by chance (`misfit`) are left out: 0; every: none is. Sources:
    windows, Bock (1983); states, Robinson (1991): `README.md`, (1), (2).
    """
    free = [freed(plant, one, drive, starts(one, drive, seconds)) for one in logs]
    sizes = [len(one.log) * (1 if one.is_forced(drive) else 2) for one in logs]
    lost = [
        _lost(plant, one, drive, None if every else own)
        for one, own in zip(logs, free, strict=True)
    ]

    def errors_of(tried: Plant) -> Array:
        parts = []
        for one, own, size, out in zip(logs, free, sizes, lost, strict=True):
            r = window_residual(tried, one, drive, own)
            if r is None or not np.all(np.isfinite(r)):
                parts.append(np.full(size, CANNOT_BE_FOLLOWED))
                continue
            r = np.where(out, 0.0, np.clip(r, -CANNOT_BE_FOLLOWED, CANNOT_BE_FOLLOWED))
            parts.append(r.ravel())
        return np.concatenate(parts)

    return errors_of


def _lost(plant: Plant, one: MotionLog, drive: Drive, own: Freed | None) -> BoolArray:
    """Samples (n,) of the windows that the plant loses by chance, as far as `misfit` excludes
    them."""
    out = np.zeros(len(one.log), dtype=np.bool_)
    r = window_residual(plant, one, drive, own) if is_unanchored(plant, drive) and own else None
    if own is None or r is None or not np.all(np.isfinite(r)):
        return out
    window = window_of(own.begun, len(one.log))
    each, kept = _by_window(r[0], window, one.signals["d"] != 0)
    lost = np.setdiff1d(np.flatnonzero(each > ADEQUATE), kept)
    return np.isin(window, lost)


def loss(r: Array) -> float:
    """Robust cost: Cauchy's (Holland, Welsch, Commun. Stat. A 6 (1977) 813)."""
    return float(np.sum(np.log1p((r / ROBUST_FROM) ** 2)) * ROBUST_FROM**2)


def soft(r: Array, far: float = ROBUST_FROM) -> Array:
    """Errors whose square sum is a robust cost: those beyond `far` count ever less.

    Source: Cauchy's function, Holland, Welsch (1977).
    """
    return np.asarray(np.sign(r) * np.sqrt(np.log1p((r / far) ** 2)) * far)


def misfit(
    plant: Plant, logs: Sequence[MotionLog], drive: Drive, *,
    every: bool = False, weighed_by: Plant | None = None,
) -> float:  # fmt: skip
    """What the free run leaves of that signal of that log which it follows worst.

    Robust mean square in units of the sensors' noise: 1 where noise alone is left. Where
    nothing brings the position back, a breakaway that the force only just reaches is a matter
    of chance and takes its window with it: the worst windows do not count, unless every one is
    to. weighed_by: plant whose drift by the noise of force and command weighs the errors, by
    default the run's own: two plants are compared at the weights of one, or the one that drifts
    more would be the better. Robust as Cauchy's function (Holland, Welsch 1977); `README.md`,
    (4).
    """
    worst = 0.0
    free = is_unanchored(plant, drive) and not every
    for one in logs:
        least = CANNOT_BE_FOLLOWED  # a short window may begin badly, a long one lose a stop
        whole = drive == "command" and not one.has_random_walk(drive)
        for seconds in (RUN_WINDOW, WHOLE) if whole else (RUN_WINDOW,):
            r = left_in_windows(plant, one, drive, seconds, weighed_by=weighed_by)
            if r is not None:
                begun = starts(one, drive, seconds)
                window = window_of(begun, len(one.log)) if free else None
                moves = one.signals["d"] != 0
                least = min(least, max(mean_loss(own, window, moves) for own in r))
        worst = max(worst, least)
    return worst


def mean_loss(r: Array, window: IntArray | None = None, moves: BoolArray | None = None) -> float:
    """Robust mean square (Holland, Welsch 1977) of errors (n,), 1 for noise; window (n,): stretches
    of which the worst do not count, of those in which the body moves (n,) at all, so many of
    them."""
    if window is None:
        return loss(r) / len(r) / NOISE_LOSS
    each, kept = _by_window(r, window, moves)
    return float(np.average(each[kept], weights=np.bincount(window)[kept]))


def _by_window(r: Array, window: IntArray, moves: BoolArray | None) -> tuple[Array, IntArray]:
    """Robust mean square of each window, and the windows that count."""
    square = np.log1p((r / ROBUST_FROM) ** 2) * ROBUST_FROM**2 / NOISE_LOSS
    size = np.bincount(window)
    each = np.bincount(window, square) / np.maximum(size, 1)
    moving = len(size) if moves is None else int(np.count_nonzero(np.bincount(window, moves)))
    lost = round(CHANCE_WINDOWS * moving)
    kept = np.argsort(each)[: max(1, len(size) - lost)]
    return np.asarray(each, dtype=np.float64), kept.astype(np.int64)
