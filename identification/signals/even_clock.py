"""A log on an even clock: gaps cut it, lost rows are put back, any other clock is resampled."""

from itertools import pairwise

import numpy as np

from identification.arrays import Array, IntArray
from identification.errors import ShortLog
from identification.log import Log
from identification.signals.check import SHORTEST_LOG
from identification.signals.differentiate import resolution

LONGEST_GAP = 5.0
"""Sampling periods between two samples above which a log is cut in two."""

_HOUR = 3600.0  # s
_EVEN = 1e-3  # part of a period: below the timing error of any logger, above printed rounding
_EVEN_BUT_FOR_LOST = 0.01  # part of a period, of a clock of which rows are lost


def even_clock(log: Log) -> tuple[Log, ...]:
    """The log as runs on an even clock, cut at gaps longer than `LONGEST_GAP` periods.

    A run that is even to 1e-3 of its period is passed on as it is, bit for bit; one that is but for
    lost rows gets these between their neighbours, and any other is resampled at the log's median
    period; where gaps leave no run, as of a logger that writes bursts of rows, at its mean period,
    by which such gaps may be none. Of such a one the command `u` and two-valued signals are held
    (the last value at the middle of the new period); the rest follows a piecewise cubic that keeps
    monotone stretches monotone, so that a step neither rings nor spreads over more than one sample.
    Runs under `SHORTEST_LOG` samples are left out. Raises ShortLog where none is left.
    """
    runs = _runs(log, log.h)
    if not runs:  # rows in bursts, whose holes are none beside the mean period
        runs = _runs(log, _mean_period(log["t"]))
    if not runs:
        gaps = len(gaps_in(log["t"], log.h))
        raise ShortLog(
            f"{log.name}: {gaps} gap{' leaves' if gaps == 1 else 's leave'} no run of"
            f" {SHORTEST_LOG} samples at {log.h:.4g} s; log without gaps"
        )
    return runs


def _mean_period(t: Array) -> float:
    """Mean of the steps of a clock t (n,) [s] that are no gaps beside that mean itself."""
    step = np.diff(t)
    h = float(step.mean())
    while np.any(gaps := step > LONGEST_GAP * h):
        step = step[~gaps]
        h = float(step.mean())
    return h


def _runs(log: Log, h: float) -> tuple[Log, ...]:
    """The log's runs between gaps, of a clock of period h [s]."""
    t, runs = log["t"], []
    for start, stop in pairwise(_borders(t, h)):
        if t[stop - 1] - t[start] < (SHORTEST_LOG - 2) * h:
            continue
        run = log if (start, stop) == (0, len(log)) else log.part(start, stop)
        if not is_even(run["t"]):
            rows = _row_numbers(run["t"], h)
            run = _resample(run, h) if rows is None else _with_lost_rows(run, rows)
        if len(run) >= SHORTEST_LOG:
            runs.append(run)
    return tuple(runs)


def _borders(t: Array, h: float) -> list[int]:
    """First samples of the pieces between gaps, and the end."""
    cuts = np.flatnonzero(np.diff(t) > LONGEST_GAP * h) + 1
    return [0, *cuts.tolist(), len(t)]


def hours_in_words(leaps: Array, h: float) -> str:
    """The end of what is said of leaps of a clock [s] of period h [s], where one is of whole hours,
    as of a clock that was set; else empty."""
    hours = np.rint(leaps / _HOUR)
    whole = (hours != 0.0) & (np.abs(leaps - _HOUR * hours) <= LONGEST_GAP * h)
    return " (whole hours: summer time, or a clock that was set)" if np.any(whole) else ""


def gaps_in(t: Array, h: float) -> Array:
    """The steps of a clock t (n,) [s] that are gaps [s]."""
    step = np.diff(t)
    return np.asarray(step[step > LONGEST_GAP * h])


def is_even(t: Array) -> bool:
    """Whether a clock t (n,) [s] is even to 1e-3 of its period."""
    grid = np.linspace(t[0], t[-1], len(t))
    return bool(np.max(np.abs(t - grid)) <= _EVEN * (t[-1] - t[0]) / (len(t) - 1))


def _resample(log: Log, h: float) -> Log:
    t = log["t"]
    grid = t[0] + h * np.arange(int(np.floor((t[-1] - t[0]) / h + 1e-6)) + 1)
    others = {name: values for name, values in log.signals.items() if name != "t"}
    signals = {name: between_rows(t, values, grid, h) for name, values in others.items()}
    return Log(log.name, {"t": grid, **signals})


def _row_numbers(t: Array, h: float) -> IntArray | None:
    """Row of each sample (n,) on an even clock of which rows are lost; None on another clock."""
    steps = np.rint(np.diff(t) / h).astype(np.int64)
    if np.min(steps) < 1:
        return None
    rows = np.concatenate([[0], np.cumsum(steps)])
    period = (t[-1] - t[0]) / rows[-1]
    uneven = np.max(np.abs(t - t[0] - period * rows))
    return rows if uneven <= _EVEN_BUT_FOR_LOST * period else None


def rows_lost(t: Array, h: float) -> int:
    """How many rows a clock t (n,) [s] of this period has lost, where it is even but for them; not
    in its gaps."""
    if not (h > 0.0 and np.all(np.isfinite(t))):
        return 0
    pieces = [t[a:b] for a, b in pairwise(_borders(t, h)) if b - a > 1]
    every = [_row_numbers(piece, h) for piece in pieces]
    return sum(int(rows[-1]) + 1 - len(rows) for rows in every if rows is not None)


def _with_lost_rows(log: Log, rows: IntArray) -> Log:
    """The log on an even clock, each lost row between its neighbours: of a position on the cubic
    spline through them all, in whole counts of an encoder; of what may jump on the straight
    line."""
    from scipy.interpolate import make_interp_spline

    t, lost = log["t"], np.ones(rows[-1] + 1, dtype=bool)
    lost[rows] = False
    grid = t[0] + (t[-1] - t[0]) / rows[-1] * np.arange(len(lost))
    signals = {"t": grid}
    for name, values in log.signals.items():
        if name == "t":
            continue
        whole = np.empty(len(lost))
        whole[rows] = values
        if name == "y":
            between = make_interp_spline(rows, values, 3)(np.flatnonzero(lost))
            whole[lost] = in_counts(between, values)
        elif _two_valued(values):
            whole[lost] = values[np.searchsorted(rows, np.flatnonzero(lost)) - 1]
        else:
            whole[lost] = np.interp(np.flatnonzero(lost), rows, values)
        signals[name] = whole
    return Log(log.name, signals, lost)


def _two_valued(values: Array) -> bool:
    return bool(np.all((values == values.min()) | (values == values.max())))


def at_times(name: str, t: Array, values: Array, grid: Array, h: float) -> Array:
    """The signal `name` at the times `grid` [s], which are h [s] apart, from its samples at `t`,
    the times of its own clock: a command `u` is held until the next, any other is as
    `between_rows`."""
    return _zoh(t, values, grid, h) if name == "u" else between_rows(t, values, grid, h)


def between_rows(t: Array, values: Array, grid: Array, h: float) -> Array:
    """A signal at the times `grid` [s], which are h [s] apart, from the rows at `t` of all signals.

    One of two values is held, any other follows a piecewise cubic: rows that come unevenly are no
    times at which a loop gives its command. Before the first and after the last sample their values
    stand.
    """
    from scipy.interpolate import PchipInterpolator

    if _two_valued(values):
        return _zoh(t, values, grid, h)
    return np.asarray(PchipInterpolator(t, values)(np.clip(grid, t[0], t[-1])))


def _zoh(t: Array, values: Array, grid: Array, h: float) -> Array:
    """The last value at the middle of each new period."""
    latest = np.searchsorted(t, grid + 0.5 * h, side="right") - 1
    return np.asarray(values[np.maximum(latest, 0)])


def in_counts(values: Array, logged: Array) -> Array:
    """Values on the whole counts of the logged ones, as they are where these count nothing."""
    count = resolution(logged)
    return logged[0] + count * np.rint((values - logged[0]) / count) if count else values
