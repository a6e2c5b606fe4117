"""Columns of one table that stand on clocks of their own: a clock before the columns it is of."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from identification.arrays import Array
from workbench.cards.headers import read_header
from workbench.logs.table import RawColumn

FEWEST_GROUPS = 2
STEPS_ALIKE = 0.5  # of the median step, that most steps of a clock are off it at most
MOSTLY_EVEN = 0.8  # of the steps of a clock
IN_COMMON = 0.8  # of the longer clock's span, that two clocks of one recording share


class ClockGroups(NamedTuple):
    """The group of each column, and the column of each group's clock."""

    groups: tuple[str, ...]
    clocks: Mapping[str, int]


def clock_groups(
    names: Sequence[str], first: Sequence[Array], fetch: Callable[[int], RawColumn]
) -> ClockGroups | None:
    """Groups of columns that each begin with their clock; None where there is one clock.

    Either each column has its own clock before it, or each clock is called one. The clocks differ,
    and most of their times are the same. first: the first numbers of each column, which spare
    reading the others.
    """
    rising = [k for k, x in enumerate(first) if len(x) > 2 and _even(x)]
    if len(rising) < FEWEST_GROUPS or rising[0] != 0:
        return None
    pairs = list(range(0, len(names), 2))
    called = [k for k in rising if "time" in read_header(names[k]).means]
    if not (len(names) % 2 == 0 and set(pairs) <= set(rising)):
        if len(called) < FEWEST_GROUPS or called[0] != 0:
            return None
        pairs = called
    ends = [*pairs[1:], len(names)]
    if any(end - begin < 2 for begin, end in zip(pairs, ends, strict=True)):
        return None
    times = [_numbers(fetch(k)) for k in pairs]
    if any(one is None for one in times) or not _of_one_recording(
        [x for x in times if x is not None]
    ):
        return None
    groups = list[str]()
    for begin, end in zip(pairs, ends, strict=True):
        name = names[begin + 1] if end - begin == 2 else names[begin]
        groups += [name] * (end - begin)
    at = {groups[k]: k for k in pairs}
    return ClockGroups(tuple(groups), at) if len(at) == len(pairs) else None


def _numbers(raw: RawColumn) -> Array | None:
    """A column of numbers without those that are missing; None where it holds text."""
    if raw.dtype.kind not in "fiu":
        return None
    x = np.asarray(raw, dtype=np.float64)
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
