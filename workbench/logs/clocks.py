"""Groups of one file, each on a clock of its own, found in one table by a clock before the columns
it is of."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.arrays import Array
from identification.errors import BadLog
from identification.signals.check import SHORTEST_LOG
from identification.thresholds import HALF, OF_ACCOUNT, TWICE
from workbench.cards.headers import read_header
from workbench.logs.layout import is_number
from workbench.logs.table import RawColumn, Table, number_of
from workbench.logs.times import is_time, seconds

FEWEST_GROUPS, FEWEST_TOPICAL = 2, 3  # groups, and columns with the clock
MOSTLY_FULL = 0.9  # of the rows, in which a column that is no message's own has a value
STEPS_ALIKE = 0.5  # of the median step, that most steps of a clock are off it at most
MOSTLY_EVEN = 0.8  # of the steps of a clock
IN_COMMON = 0.8  # of the longer clock's span, that two clocks of one recording share
MOST_NAMES, FEW_NAMES = 500, 3  # in a column that says of what each row is; shown
FIRST_ROWS = 40  # of a table, by which it is known whether it may be one of several in turn
LOOKED_AT = 200  # cells of a column of text, among which one is a number


def clock_groups(table: Table, first: Sequence[Array]) -> Table | None:
    """The table in groups of columns that each begin with their clock; None where there is one
    clock.

    Either each column has its own clock before it, or each clock is called one. The clocks differ,
    and most of their times are the same. first: the first numbers of each column, which spare
    reading the others.
    """
    rising = [k for k, x in enumerate(first) if len(x) > 2 and _even(x)]
    if len(rising) < FEWEST_GROUPS or rising[0] != 0:
        return None
    names = table.names
    pairs = list(range(0, len(names), 2))
    called = [k for k in rising if "time" in read_header(names[k]).means]
    if not (len(names) % 2 == 0 and set(pairs) <= set(rising)):
        if len(called) < FEWEST_GROUPS or called[0] != 0:
            return None
        pairs = called
    ends = [*pairs[1:], len(names)]
    if any(end - begin < 2 for begin, end in zip(pairs, ends, strict=True)):
        return None
    times = [_numbers(table.fetch(k)) for k in pairs]
    if not _of_one_recording(times):
        return None
    groups = list[str]()
    for begin, end in zip(pairs, ends, strict=True):
        name = names[begin + 1] if end - begin == 2 else names[begin]
        groups += [name] * (end - begin)
    at = {groups[k]: k for k in pairs}
    return replace(table, groups=tuple(groups), clocks=at) if len(at) == len(pairs) else None


def topic_groups(table: Table, rows: Sequence[Sequence[str]]) -> Table | None:
    """The table in groups of the columns that have values in the same rows, each on the clock of
    these, where a row has those of one message alone; None where most rows are full.

    rows: the first of them, as text, which spare reading the others.
    """
    full = [sum(bool(cell) for cell in cells) for cells in zip(*rows, strict=False)]
    if len(full) < FEWEST_TOPICAL or full[0] < len(rows) or min(full) > MOSTLY_FULL * len(rows):
        return None
    columns = [np.asarray(table.fetch(k)) for k in range(len(full))]
    if any(x.dtype.kind != "f" for x in columns) or not np.all(np.diff(columns[0]) >= 0.0):
        return None
    there = [np.isfinite(x) for x in columns]
    members = dict[bytes, list[int]]()
    for k in range(1, len(columns)):
        sparse = np.mean(there[k]) <= MOSTLY_FULL
        members.setdefault(there[k].tobytes() if sparse else b"", []).append(k)
    of = [(own, there[own[0]] if key else there[0]) for key, own in members.items()]
    if len(of) < FEWEST_GROUPS or min(int(at.sum()) for _, at in of) < SHORTEST_LOG:
        return None
    return _in_groups(
        table, table.names[0],
        [(columns[0][at], [(table.names[k], columns[k][at]) for k in own]) for own, at in of],
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
    changes = int(np.sum(np.diff(of) != 0))
    in_turn, in_blocks = changes >= HALF * len(of), changes < TWICE * len(names)
    if not (in_turn or in_blocks):
        return None
    rows = [own for k in range(len(names)) if len(own := np.flatnonzero(of == k)) >= SHORTEST_LOG]
    clocks, values = list[tuple[int, Array]](), list[tuple[int, Array]]()
    for k in (k for k in range(len(table.names)) if k != at):
        x = _numbers_or_times(np.asarray(table.fetch(k)))
        if len(x) != len(of):  # a single value beside the rows
            continue
        steps = [np.diff(x[own][np.isfinite(x[own])]) for own in rows]
        if any(np.any(one != 0.0) for one in steps):
            rises = np.all(np.isfinite(x)) and all(np.all(one >= 0.0) for one in steps)
            (clocks if rises else values).append((k, x))
    if not clocks or not values:
        return None
    of_time = [read_header(table.names[k]).means.get("time", 0.0) for k, _ in clocks]
    clock, t = clocks[int(np.argmax(of_time))]
    in_turn &= not names[0].isdigit() or _are_several(of, t, [x for _, x in values], rows)
    in_blocks &= len(values) == 1 and bool(np.any(np.diff(t) < 0.0))
    if not (in_turn or in_blocks):
        return None
    groups = dict[bytes, list[tuple[str, Array]]]()  # of the same times
    for (k, x), own in product(values, rows):
        known, name = own[np.isfinite(x[own])], names[of[own[0]]]
        if len(known) >= SHORTEST_LOG:
            called = name if len(values) == 1 else f"{name} {table.names[k]}"
            groups.setdefault(t[known].tobytes(), []).append((called, x[known]))
    if sum(map(len, groups.values())) < FEWEST_GROUPS:
        return None
    shown = ", ".join(map(repr, names[:FEW_NAMES])) + ", ..." * (len(names) > FEW_NAMES)
    said = f"rows are of {len(names)} in turn, which column {table.names[at]!r} names ({shown})"
    unit = "s" if table.fetch(clock).dtype.kind not in "fiu" else ""
    unit = table.units[clock] if table.units and not unit else unit
    found = [(np.frombuffer(times), own) for times, own in groups.items()]
    table = replace(table, headed=True, remarks=(*table.remarks, f"{said}: a column each"))
    return _in_groups(table, table.names[clock], found, unit)


def _are_several(
    of: NDArray[Any], t: Array, values: Sequence[Array], rows: Sequence[NDArray[Any]]
) -> bool:
    """Whether rows that numbers distinguish (n,) are of several machines, and the number no signal:
    a value goes by far less from one of them to the next of its own, and is not recognised by the
    number alone; or the numbers come round always alike, at times that repeat."""
    several = len(np.unique(of))
    for x in values:
        own = np.concatenate([np.abs(np.diff(x[at])) for at in rows] or [np.abs(np.diff(x))])
        apart = sum(np.nanvar(x[at]) for at in rows) > OF_ACCOUNT**2 * len(rows) * np.nanvar(x)
        if apart and np.nanmean(own) < HALF * np.nanmean(np.abs(np.diff(x))):
            return True
    return bool(np.all(of[several:] == of[:-several]) and np.any(np.diff(t) <= 0.0))


def _in_groups(
    table: Table, clock: str, parts: Sequence[tuple[Array, Sequence[tuple[str, Array]]]],
    unit: str = "",
) -> Table:  # fmt: skip
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


def _even(x: Array) -> bool:
    """Whether values only go up, by steps mostly alike."""
    step = np.diff(x)
    middle = float(np.median(step))
    if not np.all(step > 0.0):
        return False
    return bool(np.mean(np.abs(step - middle) < STEPS_ALIKE * middle) >= MOSTLY_EVEN)


def _of_one_recording(times: Sequence[Array]) -> bool:
    """Whether these are clocks in one unit over one recording, and not all the same one."""
    if any(len(x) < 2 or not _even(x) for x in times):
        return False
    low, high = (float(f(x[at] for x in times)) for f, at in ((max, 0), (min, -1)))
    longest = max(float(x[-1] - x[0]) for x in times)
    same = all(np.array_equal(x, times[0][: len(x)]) for x in times)
    return high - low > IN_COMMON * longest and not same
