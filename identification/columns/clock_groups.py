"""Groups of columns in one table, each on a clock of its own: by a clock before the columns it is
of, by the rows that have values, or by a column that says of what each row is."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.arrays import Array, BoolArray
from identification.columns.notation import Notation
from identification.signals.check import SHORTEST_LOG
from identification.thresholds import HALF, OF_ACCOUNT, TWICE

FEWEST_GROUPS, FEWEST_TOPICAL = 2, 3  # groups, and columns with the clock
MOSTLY_FULL = 0.9  # of the rows, in which a column that is no message's own has a value
STEPS_ALIKE = 0.5  # of the median step, that most steps of a clock are off it at most
MOSTLY_EVEN = 0.8  # of the steps of a clock
IN_COMMON = 0.8  # of the longer clock's span, that two clocks of one recording share

Fetch = Callable[[int], Array]
Timed = tuple[Array, Sequence[tuple[str, Array]]]
"""Times, and the columns that are on them, by name."""


def clocks_before(
    names: Sequence[str], first: Sequence[Array], numbers: Fetch, notation: Notation
) -> tuple[tuple[str, ...], Mapping[str, int]] | None:
    """The group of each column, and the column of each group's clock, where columns each begin with
    their clock; None where there is one clock.

    Either each column has its own clock before it, or each clock is called one. The clocks differ,
    and most of their times are the same. first: the first numbers of each column, which spare
    reading the others; numbers: those of a column without what is missing.
    """
    rising = [k for k, x in enumerate(first) if len(x) > 2 and _even(x)]
    if len(rising) < FEWEST_GROUPS or rising[0] != 0:
        return None
    pairs = list(range(0, len(names), 2))
    called = [k for k in rising if "time" in notation.header(names[k], "").means]
    if not (len(names) % 2 == 0 and set(pairs) <= set(rising)):
        if len(called) < FEWEST_GROUPS or called[0] != 0:
            return None
        pairs = called
    ends = [*pairs[1:], len(names)]
    if any(end - begin < 2 for begin, end in zip(pairs, ends, strict=True)):
        return None
    if not _of_one_recording([numbers(k) for k in pairs]):
        return None
    groups = list[str]()
    for begin, end in zip(pairs, ends, strict=True):
        name = names[begin + 1] if end - begin == 2 else names[begin]
        groups += [name] * (end - begin)
    at = {groups[k]: k for k in pairs}
    return (tuple(groups), at) if len(at) == len(pairs) else None


def alike_in_rows(columns: Sequence[Array]) -> list[tuple[BoolArray, list[int]]] | None:
    """The columns that have values in the same rows, and these (n,), beside the first, the clock;
    None where that does not go on, or one has too few."""
    if not np.all(np.diff(columns[0]) >= 0.0):
        return None
    there = [np.isfinite(x) for x in columns]
    members = dict[bytes, list[int]]()
    for k in range(1, len(columns)):
        sparse = np.mean(there[k]) <= MOSTLY_FULL
        members.setdefault(there[k].tobytes() if sparse else b"", []).append(k)
    of = [(there[own[0]] if key else there[0], own) for key, own in members.items()]
    if len(of) < FEWEST_GROUPS or min(int(at.sum()) for at, _ in of) < SHORTEST_LOG:
        return None
    return of


@dataclass(frozen=True, eq=False)
class InTurn:
    """Rows that are of several names in turn: the column of their clock, and a column for each
    signal of each name on the times of its own rows."""

    clock: int
    groups: Sequence[Timed]


def by_name(
    headers: Sequence[str],
    numbers: Fetch,
    at: int,
    called: Sequence[str],
    of: NDArray[Any],
    notation: Notation,
) -> InTurn | None:
    """The rows by the names in a column `at`, of which `of` (n,) says each row's; None where these
    do not come in turn, or one after the other over the same times.

    numbers: a column as numbers or times, NaN where a cell is neither; called: the names.
    """
    changes = int(np.sum(np.diff(of) != 0))
    in_turn, in_blocks = changes >= HALF * len(of), changes < TWICE * len(called)
    if not (in_turn or in_blocks):
        return None
    rows = [own for k in range(len(called)) if len(own := np.flatnonzero(of == k)) >= SHORTEST_LOG]
    clocks, values = list[tuple[int, Array]](), list[tuple[int, Array]]()
    for k in (k for k in range(len(headers)) if k != at):
        x = numbers(k)
        if len(x) != len(of):  # a single value beside the rows
            continue
        steps = [np.diff(x[own][np.isfinite(x[own])]) for own in rows]
        if any(np.any(one != 0.0) for one in steps):
            rises = np.all(np.isfinite(x)) and all(np.all(one >= 0.0) for one in steps)
            (clocks if rises else values).append((k, x))
    if not clocks or not values:
        return None
    of_time = [notation.header(headers[k], "").means.get("time", 0.0) for k, _ in clocks]
    clock, t = clocks[int(np.argmax(of_time))]
    in_turn &= not called[0].isdigit() or _are_several(of, t, [x for _, x in values], rows)
    in_blocks &= len(values) == 1 and bool(np.any(np.diff(t) < 0.0))
    if not (in_turn or in_blocks):
        return None
    groups = dict[bytes, list[tuple[str, Array]]]()  # of the same times
    for (k, x), own in product(values, rows):
        known, name = own[np.isfinite(x[own])], called[of[own[0]]]
        if len(known) >= SHORTEST_LOG:
            whole = name if len(values) == 1 else f"{name} {headers[k]}"
            groups.setdefault(t[known].tobytes(), []).append((whole, x[known]))
    if sum(map(len, groups.values())) < FEWEST_GROUPS:
        return None
    return InTurn(clock, [(np.frombuffer(times), own) for times, own in groups.items()])


def _are_several(
    of: NDArray[Any], t: Array, values: Sequence[Array], rows: Sequence[NDArray[Any]]
) -> bool:
    """Whether rows that numbers tell apart (n,) are of several machines, and the number no signal:
    a value goes by far less from one of them to the next of its own, and is not recognised by the
    number alone; or the numbers come round always alike, at times that repeat."""
    several = len(np.unique(of))
    for x in values:
        own = np.concatenate([np.abs(np.diff(x[at])) for at in rows] or [np.abs(np.diff(x))])
        apart = sum(np.nanvar(x[at]) for at in rows) > OF_ACCOUNT**2 * len(rows) * np.nanvar(x)
        if apart and np.nanmean(own) < HALF * np.nanmean(np.abs(np.diff(x))):
            return True
    return bool(np.all(of[several:] == of[:-several]) and np.any(np.diff(t) <= 0.0))


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
