"""Columns of several clocks in one log brought to one of these."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from identification.arrays import Array
from identification.columns.column import RawColumn
from identification.columns.notation import Notation
from identification.signals.check import SHORTEST_LOG

FAR_SLOWER = 8.0  # times the fastest clock's period, from which a clock is not the one to look by
LEAST_COMMON = 0.5  # of the clock's span, that another one shares


def on_clock_of_most(
    columns: Sequence[RawColumn], clocks: Mapping[str, int], notation: Notation
) -> list[RawColumn]:
    """The columns on the clock of one group: that of most columns, of equal ones the slowest.

    clocks: the column of a group's clock, where that is known; else one that rises, of the same
    name in each. Columns of one group are passed on as they are; those of a group without a clock,
    or whose clock has no time in common, are unusable.
    """
    groups = list(dict.fromkeys(one.group for one in columns))
    times = {
        name: one for name in groups if (one := _clock(name, columns, clocks, notation)) is not None
    }
    if len(groups) < 2 or not times:
        return list(columns)
    period = {name: float(np.nanmedian(np.diff(one.values))) for name, one in times.items()}
    quick = [name for name in times if period[name] <= FAR_SLOWER * min(period.values())]
    many = {name: sum(one.group == name and not one.unusable for one in columns) for name in quick}
    base = times[max(quick, key=lambda name: (many[name], period[name]))]
    known = np.isfinite(base.values)
    moved = [_moved(one, times.get(one.group), base) for one in columns]
    return [replace(one, values=one.values[known]) if len(one.values) == len(known) else one
            for one in moved]  # fmt: skip


def _clock(
    group: str, columns: Sequence[RawColumn], clocks: Mapping[str, int], notation: Notation
) -> RawColumn | None:
    """The clock of a group; None where no column of it rises."""
    if group in clocks:
        return next((one for one in columns if one.number == clocks[group]), None)
    own = [one for one in columns if one.group == group and not one.unusable]
    own = [one for one in own if len(one.values) >= SHORTEST_LOG and _rises(one.values)]

    def of_time(one: RawColumn) -> float:
        return notation.header(one.header, "").means.get("time", 0.0)

    return max(own, key=of_time, default=None)


def _rises(x: Array) -> bool:
    known = x[np.isfinite(x)]
    return len(known) >= SHORTEST_LOG and bool(np.all(np.diff(known) > 0.0))


def _moved(one: RawColumn, own: RawColumn | None, base: RawColumn) -> RawColumn:
    """A column at the times of the base clock, NaN where it has none."""
    if own is None:
        return replace(one, unusable=one.unusable or "has no clock")
    if own is base or one.unusable or np.array_equal(own.values, base.values, equal_nan=True):
        return one
    if len(one.values) != len(own.values):
        return replace(one, unusable="has not the length of its clock")
    known = np.isfinite(own.values) & np.isfinite(one.values)
    if np.count_nonzero(known) < SHORTEST_LOG:
        return replace(one, unusable="has hardly a number beside its clock")
    t, x = own.values[known], one.values[known]
    to = base.values
    values = np.interp(to, t, x, left=np.nan, right=np.nan)
    values[~np.isfinite(to)] = np.nan
    if np.mean(np.isfinite(values)) < LEAST_COMMON:
        why = f"its clock {own.header!r} has hardly a time in common with {base.header!r}"
        return replace(one, values=values, unusable=why)
    if one is own:
        return replace(one, values=values, unusable=f"the clock of {one.group!r}")
    return replace(one, values=values)
