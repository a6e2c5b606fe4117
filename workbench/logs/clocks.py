"""Groups of one file, each on a clock of its own, found in one table by a clock before the columns
it is of."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.arrays import Array
from identification.columns.clock_groups import (
    FEWEST_TOPICAL,
    MOSTLY_FULL,
    Timed,
    alike_in_rows,
    by_name,
    clocks_before,
)
from identification.errors import BadLog
from identification.thresholds import HALF
from workbench.logs.layout import is_number
from workbench.logs.notation import NOTATION
from workbench.logs.table import RawColumn, Table, number_of
from workbench.logs.times import is_time, seconds

MOST_NAMES, FEW_NAMES = 500, 3  # in a column that says of what each row is; shown
FIRST_ROWS = 40  # of a table, by which it is known whether it may be one of several in turn
LOOKED_AT = 200  # cells of a column of text, among which one is a number


def clock_groups(table: Table, first: Sequence[Array]) -> Table | None:
    """The table in groups of columns that each begin with their clock; None where there is one
    clock. first: the first numbers of each column, which spare reading the others."""

    def numbers(number: int) -> Array:
        return _numbers(table.fetch(number))

    found = clocks_before(table.names, first, numbers, NOTATION)
    return None if found is None else replace(table, groups=found[0], clocks=found[1])


def topic_groups(table: Table, rows: Sequence[Sequence[str]]) -> Table | None:
    """The table in groups of the columns that have values in the same rows, each on the clock of
    these, where a row has those of one message alone; None where most rows are full.

    rows: the first of them, as text, which spare reading the others.
    """
    full = [sum(bool(cell) for cell in cells) for cells in zip(*rows, strict=False)]
    if len(full) < FEWEST_TOPICAL or full[0] < len(rows) or min(full) > MOSTLY_FULL * len(rows):
        return None
    columns = [np.asarray(table.fetch(k)) for k in range(len(full))]
    if any(x.dtype.kind != "f" for x in columns) or (of := alike_in_rows(columns)) is None:
        return None
    return _in_groups(
        table, table.names[0],
        [(columns[0][at], [(table.names[k], columns[k][at]) for k in own]) for at, own in of],
    )  # fmt: skip


def long_groups(table: Table, rows: Sequence[Sequence[str]]) -> Table | None:
    """The table with a column for each signal of each name, where rows are of several signals or
    axes in turn that one column names, on the clock of its own rows; None of other tables.

    rows: the first of them, as text, which spare reading the others.
    """
    for k, own in enumerate(zip(*rows, strict=False)):
        text = any(own) and not any(is_number(one) or is_time(one) for one in own if one)
        if text or (all(map(str.isdigit, own)) and 1 < len(set(own)) < HALF * len(own)):
            raw = np.asarray(table.fetch(k), dtype=str if text else float)
            names, of = np.unique(raw, return_inverse=True)
            called = [one if text else f"{one:g}" for one in names.tolist()]
            if 1 < len(names) <= MOST_NAMES and (made := _by_name(table, k, called, of)):
                return made
    return None


def named_in_turn(table: Table) -> Table | None:
    """As `long_groups`, of a table that is no text and has one clock."""
    columns = [np.asarray(table.fetch(k)) for k in range(len(table.names))]
    if table.groups or any(len(one) != len(columns[0]) for one in columns):
        return None
    first = zip(*(one[:FIRST_ROWS].tolist() for one in columns), strict=True)
    # A whole number is one, whatever the table's columns are kept as.
    rows = [[f"{one:g}" if isinstance(one, float) else str(one) for one in row] for row in first]
    return long_groups(table, rows)


def _by_name(table: Table, at: int, names: Sequence[str], of: NDArray[Any]) -> Table | None:
    """The table by the names in a column `at`, of which `of` (n,) says each row's; None where these
    do not come in turn, or one after the other over the same times."""

    def numbers(number: int) -> Array:
        return _numbers_or_times(np.asarray(table.fetch(number)))

    found = by_name(table.names, numbers, at, names, of, NOTATION)
    if found is None:
        return None
    shown = ", ".join(map(repr, names[:FEW_NAMES])) + ", ..." * (len(names) > FEW_NAMES)
    said = f"rows are of {len(names)} in turn, which column {table.names[at]!r} names ({shown})"
    clock = found.clock
    unit = "s" if table.fetch(clock).dtype.kind not in "fiu" else ""
    unit = table.units[clock] if table.units and not unit else unit
    table = replace(table, headed=True, remarks=(*table.remarks, f"{said}: a column each"))
    return _in_groups(table, table.names[clock], found.groups, unit)


def _in_groups(table: Table, clock: str, parts: Sequence[Timed], unit: str = "") -> Table:
    """The table of these times, each with the columns that are on them: a group by the first."""
    columns, clocks = list[tuple[str, str, Array, str]](), dict[str, int]()
    for times, own in parts:
        group = own[0][0]
        clocks[group] = len(columns)
        columns += [(group, clock, times, unit), *((group, name, x, "") for name, x in own)]
    groups, names, made, units = zip(*columns, strict=True)
    return replace(table, names=names, fetch=made.__getitem__, groups=groups, clocks=clocks,
                   units=units)  # fmt: skip


def _numbers_or_times(raw: RawColumn) -> Array:
    """A column as numbers or as times [s], NaN where a cell is neither."""
    if raw.dtype.kind in "fiu":
        return np.asarray(raw, dtype=np.float64)
    if not any(map(_has_number, raw[:: 1 + len(raw) // LOOKED_AT].tolist())):
        return np.full(len(raw), np.nan)
    with suppress(BadLog):
        if (times := seconds(raw, "", 0)) is not None:
            return times
    out = np.full(len(raw), np.nan)
    for k, cell in enumerate(raw.tolist()):
        with suppress(TypeError, ValueError):
            out[k] = number_of(cell)
    return out


def _has_number(cell: object) -> bool:
    return isinstance(cell, str) and bool(cell) and (is_number(cell) or is_time(cell))


def _numbers(raw: RawColumn) -> Array:
    """A column of numbers without those that are missing; nothing of one that holds text."""
    x = np.asarray(raw if raw.dtype.kind in "fiu" else [], dtype=np.float64)
    return x[np.isfinite(x)]
