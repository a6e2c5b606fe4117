"""Rows of a file that are no samples of its run: a logger's message, a row written twice, a number
that is text; and a clock that begins again where the logger was started anew."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.arrays import Array, BoolArray
from identification.signals.check import SHORTEST_LOG
from identification.signals.even_clock import LONGEST_GAP, told_of_hours
from identification.thresholds import HALF, OF_ACCOUNT
from workbench.logs.table import number_of, text_of

MOST_FAULTY = 0.01  # of the rows: more is a file that is laid out otherwise
MOST_STARTS = 50  # of a clock in one file
_ROWS_OF_A_MEAN = 50  # over which the jitter of stamps is gone, and a lost row is not
_MOST_AXES, _SHOWN_AXES, _LOOKED_AT = 50, 4, 1000  # axes of one file, named; rows looked at first


@dataclass(frozen=True, eq=False)
class Numbers:
    """A column's cells as numbers (n,), NaN where a cell is empty or text; where it is text, and
    the first of these."""

    values: Array
    is_text: BoolArray
    first_text: str = ""

    @property
    def few(self) -> bool:
        """Whether the text is a few cells' among numbers, and no header or unit."""
        return not self.is_text[0] and are_few(int(np.sum(self.is_text)), len(self.values))


def are_few(faulty: int, rows: int) -> bool:
    """Whether so many faulty rows of all may be left out."""
    return faulty <= MOST_FAULTY * rows


def numbers_in(raw: NDArray[Any]) -> Numbers:
    """The numbers in a column of numbers or of cells; those of a column of text as far as it takes
    to see that it is one."""
    if raw.dtype.kind in "fiub":
        return Numbers(np.asarray(raw, dtype=np.float64), np.zeros(len(raw), dtype=bool))
    values, is_text, first, faulty = np.full(len(raw), np.nan), np.zeros(len(raw), bool), "", 0
    for k, cell in enumerate(raw.tolist()):
        try:
            values[k] = number_of(cell)
        except (TypeError, ValueError):
            is_text[k] = True
            first, faulty = first or " ".join(str(text_of(cell)).split()), faulty + 1
            if not are_few(faulty, len(raw)):
                break
    return Numbers(values, is_text, first)


def sound_rows(t: Array, others: Sequence[Array]) -> tuple[BoolArray, tuple[str, ...]]:
    """Which rows (n,) are samples, and what is said of the others: rows without a time or with
    nothing else, where they are few, and rows that are the one before once more, in time and all
    signals. others: the columns beside the time."""
    timed: BoolArray = np.isfinite(t)
    remarks = list[str]()
    untimed = int(np.sum(~timed))
    if not are_few(untimed, len(t)):
        return np.ones(len(t), dtype=bool), ()
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
    return timed & ~twice, tuple(remarks)


def late_stamps(t: Array) -> tuple[Array, str]:
    """The times (n,) of even rows of which some were stamped late, together with the next, and what
    is said of that; other times as they are.

    The rows are even where their stamps follow the count of the rows without a step: a row that
    was lost would shift all behind it by a period.
    """
    step = np.diff(t)
    same = step == 0.0
    if not np.any(same) or np.any(step < 0.0) or np.mean(same) >= OF_ACCOUNT:
        return t, ""
    row = np.arange(len(t))
    period, start = np.polyfit(row, t, 1)
    blocks = max(1, len(t) // _ROWS_OF_A_MEAN)
    late = [float(np.mean(one)) for one in np.array_split(t - start - period * row, blocks)]
    if np.ptp(late) > HALF * period:
        return t, ""
    said = f"{rows_of(int(np.sum(same)))} with the time of the row before and other values"
    return start + period * row, f"{said}: stamped late, taken as even rows"


def several_axes(t: Array, columns: Iterable[tuple[str, NDArray[Any]]]) -> str:
    """What is said of a log whose rows are of several axes in turn, by a column that names the axis
    of each row: the times (n,) go up in the rows of each; else empty.

    columns: what each is called, and its cells (n,).
    """
    if np.all(np.diff(t) > 0.0):
        return ""
    for name, cells in columns:
        axes = _axes_in_turn(t, cells) if len(cells) == len(t) else ()
        if axes:
            shown = ", ".join(repr(one) for one in axes[:_SHOWN_AXES])
            return (
                f"the rows are of {len(axes)} axes in turn ({shown} in column {name}); give each"
                " axis a file of its own rows"
            )
    return ""


def _axes_in_turn(t: Array, cells: NDArray[Any]) -> tuple[str, ...]:
    """The axes that cells name, where rows of each come again and again, in the order of time."""

    def texts(some: NDArray[Any]) -> list[str]:
        return [str(text_of(cell)) for cell in some.tolist()]

    first, apart = cells[:_LOOKED_AT], cells[:: 1 + len(cells) // _LOOKED_AT]
    if len(set(texts(first))) < 2 or len(set(texts(first) + texts(apart))) > _MOST_AXES:
        return ()
    axes, of = np.unique(np.asarray(texts(cells)), return_inverse=True)
    again = np.sum(of[1:] != of[:-1]) >= len(axes)  # else they are runs
    if not again or len(axes) > _MOST_AXES or np.min(np.bincount(of)) < SHORTEST_LOG:
        return ()
    rise = all(np.all(np.diff(t[of == k]) > 0.0) for k in range(len(axes)))
    return tuple(axes.tolist()) if rise else ()


def rows_of(count: int) -> str:
    """So many rows in words."""
    return "a row" if count == 1 else f"{count} rows"


def told_of_starts(t: Array, parts: Sequence[slice]) -> str:
    """What the clock does between the parts that `stretches` made of it."""
    h = float(np.median(np.diff(t)))
    back = np.array([t[one.start - 1] - t[one.start] for one in parts if one.start])
    if any(abs(t[one.start] - t[0]) <= LONGEST_GAP * h for one in parts[1:]):
        return f"clock begins again: {len(parts)} runs"
    said = f"clock goes back by {np.max(back):.4g} s{told_of_hours(back, h)}"
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
