"""The stamps of a log's rows: rows that are no samples of its run (without a time, or written
twice), even rows whose stamps are rounded or late, and a clock that begins again where the logger
was started anew."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.arrays import Array, BoolArray
from identification.signals.check import SHORTEST_LOG
from identification.signals.differentiate import resolution
from identification.signals.even_clock import LONGEST_GAP, hours_in_words
from identification.thresholds import HALF, OF_ACCOUNT

MOST_FAULTY = 0.01  # of the rows: more is a file that is laid out otherwise
MOST_STARTS = 50  # of a clock in one file
_MOST_OF_A_TICK = 1.01  # that a rounded stamp is off
_MOST_DIGITS = 15
_OF_ROUNDING = 8.0  # times the step between two numbers, that differences of times are rounded to
_TOGETHER, _FEWEST_AT_A_TIME = 0.25, 1.5  # period below which rows came together; such rows
_ROWS_OF_A_MEAN = 50  # over which the jitter of stamps is gone, and a lost row is not


def are_few(faulty: int, rows: int) -> bool:
    """Whether so many faulty rows of all may be left out."""
    return faulty <= MOST_FAULTY * rows


def sound_rows(t: Array, others: Sequence[Array]) -> tuple[NDArray[Any], tuple[str, ...]]:
    """Which rows are samples, by number, in the order of time, and what is said of the others: rows
    without a time or with nothing else, where they are few, and rows that are the one before once
    more, in time and all signals. others: the columns beside the time."""
    timed: BoolArray = np.isfinite(t)
    number, remarks = np.arange(len(t)), list[str]()
    untimed = int(np.sum(~timed))
    if not are_few(untimed, len(t)):
        return number, ()
    if len(t) > 1 and np.all(np.diff(t[timed]) < 0.0):
        number = number[::-1]
        remarks.append("rows stand from the last to the first: read the other way round")
    if untimed:
        remarks.append(f"{rows_of(untimed)} without a time left out")
    bare = np.all([~np.isfinite(x) for x in others], axis=0) & timed
    if np.any(bare) and are_few(int(np.sum(bare)), len(t)):
        remarks.append(f"{rows_of(int(np.sum(bare)))} with nothing but a time left out")
        timed &= ~bare
    twice = np.zeros(len(t), dtype=bool)
    if np.any(t[1:] == t[:-1]):
        same = [np.equal(x[1:], x[:-1]) | (np.isnan(x[1:]) & np.isnan(x[:-1])) for x in others]
        twice[1:] = np.all([t[1:] == t[:-1], *same], axis=0)
    if repeated := int(np.sum(twice)):
        remarks.append(f"{rows_of(repeated)} that repeat the row before left out")
    return number[(timed & ~twice)[number]], tuple(remarks)


def even_stamps(t: Array) -> tuple[Array, str]:
    """The times (n,) of even rows whose stamps are rounded to whole ticks, or of which some came
    late, together with the next, or all several at a time, as who reads a port finds them in its
    buffer, and what is said of that; other times as they are.

    Rows are even where their stamps follow the count of the rows: but for a tick; or without a
    step, as a row that was lost would shift all behind it by a period, or by those of a buffer.
    """
    step = np.diff(t)
    if len(t) < SHORTEST_LOG or not np.all(step >= 0.0):
        return t, ""
    same, line = step == 0.0, _line(t)
    period = float(line[1] - line[0])
    together = step < _TOGETHER * period
    at_a_time = len(t) / (1 + int(np.sum(~together)))
    # As no sampler is.
    uneven = np.any(together) and float(np.ptp(step[together])) > MOST_FAULTY * period
    buffered = uneven and _FEWEST_AT_A_TIME < at_a_time < _ROWS_OF_A_MEAN
    if not buffered and not np.any(same):
        return _without_rounding(t, step)
    if not buffered and np.mean(same) >= OF_ACCOUNT:
        return t, ""
    blocks = max(1, len(t) // _ROWS_OF_A_MEAN)
    late = [float(np.mean(one)) for one in np.array_split(t - line, blocks)]
    if np.ptp(late) > period * (at_a_time if buffered else HALF):
        waited = int(np.argmin(together))  # rows that were in the buffer before it was first read
        rest, said = even_stamps(t[waited:]) if waited > SHORTEST_LOG else (t, "")
        before = np.arange(-waited, 0) * (rest[1] - rest[0]) + rest[0]
        remark = f"{rows_of(waited)} that waited before the first are put before it; {said}"
        return (np.concatenate([before, rest]), remark) if said else (t, "")
    if buffered:
        return line, f"rows stamped about {at_a_time:.0f} at a time, late: taken as even rows"
    said = f"{rows_of(int(np.sum(same)))} with the time of the row before and other values"
    return line, f"{said}: stamped late, taken as even rows"


def _without_rounding(t: Array, step: Array) -> tuple[Array, str]:
    """As `even_stamps`, of stamps in whole ticks that are off even rows by one at most."""
    digits = min(int(-np.log10(_OF_ROUNDING * np.spacing(np.max(np.abs(t))))), _MOST_DIGITS)
    tick, usual = resolution(np.round(step, digits)), float(np.median(step))
    pieces = np.split(t, np.flatnonzero(step > LONGEST_GAP * usual) + 1)
    lines = [_line(one) if len(one) > 2 else one for one in pieces]
    off = max(float(np.ptp(one - line)) for one, line in zip(pieces, lines, strict=True))
    lost = tick > HALF * usual and are_few(int(np.sum(step > HALF * tick + usual)), len(step))
    if not 0.0 < off < _MOST_OF_A_TICK * tick or not MOST_FAULTY * usual < tick <= usual or lost:
        return t, ""
    return np.concatenate(lines), f"stamps in whole ticks of {tick:.3g}: taken as even rows"


def _line(t: Array) -> Array:
    """Even times as near to these (n,) as can be."""
    row = np.arange(len(t))
    period, start = np.polyfit(row, t - t[0], 1)
    return np.asarray(t[0] + start + period * row)


def rows_of(count: int) -> str:
    """So many rows in words."""
    return "a row" if count == 1 else f"{count} rows"


def starts_in_words(t: Array, parts: Sequence[slice]) -> str:
    """What the clock does between the parts that `stretches` made of it."""
    h = float(np.median(np.diff(t)))
    back = np.array([t[one.start - 1] - t[one.start] for one in parts if one.start])
    if any(abs(t[one.start] - t[0]) <= LONGEST_GAP * h for one in parts[1:]):
        return f"clock begins again: {len(parts)} runs"
    said = f"clock goes back by {np.max(back):.4g} s{hours_in_words(back, h)}"
    return f"{said}: {len(parts)} runs"


def stretches(t: Array) -> list[slice]:
    """The runs of a clock (n,) that begins again: from each start to the next, those long enough
    for a log; the whole of one that does not, or too often to be the starts of a logger."""
    starts = np.flatnonzero(t[1:] < t[:-1]) + 1
    if not 0 < len(starts) < MOST_STARTS:
        return [slice(0, len(t))]
    borders = [0, *starts.tolist(), len(t)]
    long = [slice(a, b) for a, b in pairwise(borders) if b - a >= SHORTEST_LOG]
    kept = sum(one.stop - one.start for one in long)
    return long if long and are_few(len(t) - kept, len(t)) else [slice(0, len(t))]


def at_rows(signals: Mapping[str, Array], rows: BoolArray | slice) -> dict[str, Array]:
    """The signals at these rows."""
    return {name: x[rows] for name, x in signals.items()}
