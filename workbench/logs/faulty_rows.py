"""Rows of a file that are no samples of its run: a logger's message, a row written twice, a number
that is text; and a clock that begins again where the logger was started anew."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.arrays import Array, BoolArray
from identification.signals.check import SHORTEST_LOG
from workbench.logs.table import number_of, text_of

MOST_FAULTY = 0.01  # of the rows: more is a file that is laid out otherwise
MOST_STARTS = 50  # of a clock in one file


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
    """The numbers in a column of numbers or of cells."""
    if raw.dtype.kind in "fiub":
        return Numbers(np.asarray(raw, dtype=np.float64), np.zeros(len(raw), dtype=bool))
    values, is_text, first = np.full(len(raw), np.nan), np.zeros(len(raw), dtype=bool), ""
    for k, cell in enumerate(raw.tolist()):
        try:
            values[k] = number_of(cell)
        except (TypeError, ValueError):
            is_text[k] = True
            first = first or " ".join(str(text_of(cell)).split())
    return Numbers(values, is_text, first)


def sound_rows(t: Array, others: Sequence[Array]) -> tuple[BoolArray, tuple[str, ...]]:
    """Which rows (n,) are samples, and what is said of the others: rows without a time, where they
    are few, and rows that are the one before once more, in time and all signals."""
    timed: BoolArray = np.isfinite(t)
    remarks = list[str]()
    untimed = int(np.sum(~timed))
    if not are_few(untimed, len(t)):
        return np.ones(len(t), dtype=bool), ()
    if untimed:
        remarks.append(f"{untimed} rows without a time left out")
    twice = np.zeros(len(t), dtype=bool)
    if np.any(t[1:] == t[:-1]):
        same = [np.equal(x[1:], x[:-1]) | (np.isnan(x[1:]) & np.isnan(x[:-1])) for x in others]
        twice[1:] = np.all([t[1:] == t[:-1], *same], axis=0)
    if repeated := int(np.sum(twice)):
        remarks.append(f"{repeated} rows that repeat the row before left out")
    return timed & ~twice, tuple(remarks)


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
