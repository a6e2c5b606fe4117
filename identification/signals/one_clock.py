"""Groups of signals, each on a clock of its own, brought to the clock of one."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from identification.arrays import Array
from identification.errors import BadLog
from identification.remarks import MinorRemark
from identification.signals.even_clock import LONGEST_GAP, at_times

_SENSED = ("y", "F", "p_p", "p_n")
_SLOWEST = 1.5  # times the clock's period that a measured signal's may be

GroupClock = Callable[[str], Array]


class OneClock(NamedTuple):
    """Signals on the clock of `t`, the first row of it that is kept, and what was done in words."""

    signals: dict[str, Array]
    first: int
    remarks: tuple[str, ...]


def on_one_clock(
    signals: Mapping[str, Array], groups: Mapping[str, str], clock: GroupClock, where: str
) -> OneClock:
    """The signals on the clock of the group of `t`, where all groups have samples.

    groups: the group of each signal; clock: the times [s] of a group. A group of the same times
    passes as it is. Of any other a command is held and the rest interpolated as for an uneven
    clock; nothing is made up across its gaps and missing samples. Raises BadLog where a clock goes
    back, where groups have no time in common, and where a measured signal is slower than the clock.
    """
    base, own = signals["t"], groups["t"]
    usable = np.isfinite(base)
    _check(f"{where}, signals.t", base[usable])
    h = _period(base)
    every, remarks = dict(signals), list[str]()
    members = dict[str, list[str]]()
    for name in signals:
        if groups[name] != own:
            members.setdefault(groups[name], []).append(name)
    for group in members:
        times = clock(group)
        if np.array_equal(times, base, equal_nan=True):
            continue
        known = np.isfinite(times)
        _check(f"{where}, the clock of group {group!r}", times[known])
        period = _period(times)
        for name in members[group]:
            _refuse_slow(f"{where}: signals.{name}", name, group, period, h)
            if len(signals[name]) != len(times):
                raise BadLog(
                    f"{where}: signals.{name} has {len(signals[name])} samples, the clock of its"
                    f" group {group!r} {len(times)}; name another column"
                )
            every[name] = _moved(name, times[known], signals[name][known], base, h)
        usable[usable] &= (base[usable] >= times[known][0]) & (
            base[usable] <= times[known][-1] + period
        )
        remarks.append(
            MinorRemark(
                f"{where}: signals of group {group!r} (every {period:.4g} s) are brought to the"
                f" clock of {own!r} (every {h:.4g} s)"
            )
        )
    if np.count_nonzero(usable) < 2:
        raise BadLog(
            f"{where}: the groups {', '.join(map(repr, (own, *members)))} have no time in common;"
            " name columns of one recording"
        )
    first, last = (int(np.flatnonzero(usable)[k]) for k in (0, -1))
    parts = {name: values[first : last + 1] for name, values in every.items()}
    return OneClock(parts, first, tuple(remarks))


def _period(times: Array) -> float:
    return float(np.median(np.diff(times[np.isfinite(times)])))


def _check(where: str, times: Array) -> None:
    if len(times) < 2:
        raise BadLog(f"{where}: has {len(times)} samples; name columns of another group")
    back = np.flatnonzero(np.diff(times) < 0)
    if back.size:
        raise BadLog(f"{where}: goes back at {times[back[0]]:.6g} s; log one continuous run a file")


def _refuse_slow(where: str, name: str, group: str, period: float, h: float) -> None:
    if name in _SENSED and period > _SLOWEST * h:
        raise BadLog(
            f"{where} is sampled every {period:.4g} s, signals.t every {h:.4g} s; a measured signal"
            f" is not made faster: take signals.t from the group {group!r}, or log both at one rate"
        )


def _moved(name: str, times: Array, values: Array, base: Array, h: float) -> Array:
    """Values at the times `base`; NaN where they are not known on both sides."""
    single = np.append(np.diff(times) > 0, True)  # of several samples at one time the last counts
    times, values = times[single], values[single]
    known = np.isfinite(values)
    out = np.full(base.shape, np.nan)
    if np.count_nonzero(known) < 2:
        return out
    finite = np.isfinite(base)
    out[finite] = at_times(name, times[known], values[known], base[finite], h)
    if name == "u":
        return out
    after = np.clip(np.searchsorted(times, base), 1, len(times) - 1)
    gap = times[after] - times[after - 1] > LONGEST_GAP * _period(times)
    missing = ~known[after] | ~known[after - 1]
    return np.where(gap | missing, np.nan, out)
