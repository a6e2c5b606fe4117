"""A file as named columns, which its reader hands out one by one."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.errors import BadLog
from identification.signals.check import SHORTEST_LOG
from workbench.cards.card_tables import FileSpec
from workbench.cards.nearest import nearest

RawColumn = NDArray[Any]

MOST_ROWS = 20_000_000
"""Rows of which a gigabyte of signals can be made."""

BINARY_BYTES = 1_000_000_000
"""Size above which a binary log is not read."""


@dataclass(frozen=True)
class Table:
    """Columns of a file: their names, a function that reads one by number, the first row's number.

    `headed` is false where the file gives no names: then columns go by number alone. `groups`
    names the group of each column where a file holds several, each with a clock of its own; a
    column then also goes by "group/name". `clocks`: the column of a group's clock, where it has a
    name of its own. `units`: what a row below the names says, if there is one. `remarks`: which
    rows were left out, without the name of the file.
    """

    names: tuple[str, ...]
    fetch: Callable[[int], RawColumn]
    first_row: int = 1
    headed: bool = True
    groups: tuple[str, ...] = ()
    clocks: Mapping[str, int] = field(default_factory=dict)
    units: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()

    def column(self, key: str | int, where: str) -> RawColumn:
        """The column named or numbered `key`; raises BadLog with the nearest name."""
        return self.fetch(self.number(key, where))

    def number(self, key: str | int, where: str) -> int:
        """The number from 0 of the column named or numbered `key`; raises BadLog as `column`."""
        count = len(self.names)
        if isinstance(key, int):
            if not 0 <= key < count:
                raise BadLog(
                    f"{where}: no column {key}, there are {count} (0 to {count - 1}, counted "
                    "from 0); correct it in the card"
                )
            return key
        if not self.headed:
            raise BadLog(
                f"{where}: no column {key!r}, the file has no header of its {count} columns; "
                f"name the column by its number (0 to {count - 1}) in the card"
            )
        full = self.full_names()
        found = [k for k, name in enumerate(full) if name == key]
        found = found or [k for k, name in enumerate(self.names) if name == key]
        if not found:
            known = full if len(set(self.groups)) > 1 else self.names
            raise BadLog(f"{where}: no column {key!r}{nearest(key, known)}")
        if len(found) > 1:
            raise BadLog(f"{where}: {self._ambiguous(key, found)}")
        return found[0]

    def full_names(self) -> tuple[str, ...]:
        """The names with their groups, where there are groups."""
        if not self.groups:
            return self.names
        pairs = zip(self.groups, self.names, strict=True)
        return tuple(f"{group}/{name}" for group, name in pairs)

    def _ambiguous(self, key: str, found: Sequence[int]) -> str:
        full = [self.full_names()[k] for k in found[:10]]
        if len(set(full)) > 1:
            return (
                f"{len(found)} groups have a column {key!r}; name it with its group in the card:"
                f" {' or '.join(map(repr, full))}"
            )
        which = " and ".join(str(k) for k in found)
        return (
            f"columns {which} (counted from 0) are all named {key!r}; name the right one by its"
            " number in the card"
        )


def of_vectors(names: Sequence[str], read: Callable[[str], RawColumn], spec: FileSpec) -> Table:
    """A table of vectors that are read by name; a scalar stays one value, which the caller may
    spread."""

    def fetch(number: int) -> RawColumn:
        values = np.ravel(read(names[number]))
        return values[spec.skip_rows :] if values.size > 1 else values

    return Table(tuple(names), fetch, 1 + spec.skip_rows)


def of_array(path: Path, values: RawColumn, spec: FileSpec) -> Table:
    """A table of an array's named fields, or of a matrix: a column a signal; one of a few long rows
    has a row a signal."""
    refuse_long(path, max(values.shape, default=0))
    if values.dtype.names:
        return of_vectors(values.dtype.names, values.__getitem__, spec)
    if values.ndim != 2:
        what = repr(spec.rows) if spec.rows else "the array"
        raise BadLog(f"{path}: {what} has the shape {values.shape}, rows and columns needed")
    if values.shape[0] < SHORTEST_LOG <= values.shape[1]:
        values = values.T
    names = tuple(str(number) for number in range(values.shape[1]))
    return Table(names, lambda k: values[spec.skip_rows :, k], 1 + spec.skip_rows, headed=False)


def text_of(cell: object) -> object:
    """What a cell holds, a text as Python's own."""
    if isinstance(cell, bytes):
        return cell.decode("utf-8", "replace")
    return str(cell) if isinstance(cell, str) else cell


def number_of(cell: object) -> float:
    """The number in a cell, NaN in an empty one; raises TypeError or ValueError on others."""
    text: Any = text_of(cell)
    if text is None or text == "":
        return float("nan")
    if isinstance(text, str) and text.strip().lower() in ("true", "false"):
        return float(text.strip().lower() == "true")
    return float(text)


def refuse_long(path: Path, rows: int) -> None:
    """Raises BadLog where the file has more rows than are read."""
    if rows > MOST_ROWS:
        raise BadLog(
            f"{path}: has {rows} rows, at most {MOST_ROWS} are read; cut the log, or keep every"
            " tenth row"
        )


def damaged(path: Path, form: str, error: Exception) -> BadLog:
    """The one-line error for a file on which its reader failed, which may have two causes."""
    text = " ".join(str(error).split())[:120] or type(error).__name__
    return BadLog(
        f"{path}: cannot be read as a {form} file ({text}): it is damaged or cut off, or laid out"
        " as is not read here; copy it again, or write its columns as CSV"
    )
