"""Which column of an unknown log is its clock, and which are others of the kind."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.arrays import Array
from identification.columns.column import Column
from identification.errors import BadLog
from identification.signals.check import SHORTEST_LOG
from identification.signals.even_clock import LONGEST_GAP
from identification.signals.stamps import MOST_STARTS
from identification.signals.summed import summed
from identification.thresholds import TWICE

OFTEN_REPEATED = 0.1  # share of the steps of a clock, that do not move it
MOST_UNEVEN = 0.2  # steps that are off the median by more than half of it, of a clock
ROW_NUMBERS = 2.5  # for a clock that goes up by one a row, beside others
THOUSANDTHS, OFF_WHOLE = 1000.0, 1e-3  # of a clock's unit; off a whole one by binary fractions
SECOND_CLOCK = 2e-3  # of its range, that a clock is off another one at most


def clock_of(
    where: str, usable: Sequence[Column], others: Sequence[Column], single: Sequence[Column]
) -> Column:
    """The column that holds the time, or the sum of the time from row to row; others: those that
    are no signals; single: columns of one value that is called a period.

    where: what the log is called by. Raises BadLog where there is none.
    """
    steady = [one for one in others if "time" in one.header.means]
    rows = len(usable[0].values) if usable else 0
    steady += [] if any(map(ticks, usable)) else single
    steady = [one for one in steady if len(one.values) == rows]
    texts = [one for one in others if one.raw.unusable]
    return _of_steps(usable, steady) or _rising_one(where, usable, texts)


def ticks(one: Column) -> bool:
    """Whether a column only goes up, by steps that are mostly alike or called times."""
    means, unit = one.header.means, one.header.unit
    other = {"position", "velocity", "force", "pressure"} & set(means) and "time" not in means
    other = other or ("command" in means and not {"time", "count"} & set(means))  # a ramp of it
    if not _rises(one) or other or (unit and unit.quantity not in ("time", "count")):
        return False
    step = np.diff(one.values)
    middle = float(np.median(step))
    even = np.mean(np.abs(step - middle) > 0.5 * middle) < MOST_UNEVEN
    return bool(even) or "time" in one.header.means


def is_second(one: Column, clock: Column) -> bool:
    """Whether a column is one more clock, or counts rows or ticks, be it as unevenly as the rows
    come."""
    means = one.header.means
    going = ticks(one)
    if np.array_equal(one.values, clock.values) or (going and {"time", "count"} & set(means)):
        return True
    counts = (
        one.whole and _rises(one) and all(means[what] < 1.0 for what in means if what != "count")
    )
    if not (counts or going):
        return False
    line = np.polyfit(clock.values, one.values, 1)
    off = float(np.max(np.abs(one.values - np.polyval(line, clock.values))))
    most = LONGEST_GAP * float(np.median(np.diff(one.values))) if counts else 0.0
    return off < max(most, SECOND_CLOCK * float(np.ptp(one.values)))


def counts_thousandths(t: Array) -> bool:
    """Whether the times (n,) of a clock are whole thousandths of its unit, and more uneven than
    rounding makes them: a counter of milliseconds in s. Those of a clock in ms would be whole."""
    if not np.all(np.isfinite(t)):
        return False
    fine = THOUSANDTHS * t
    whole = np.all(np.abs(fine - np.round(fine)) < OFF_WHOLE)
    if not whole or np.all(np.round(fine) % 10.0 == 0.0):
        return False
    rows = np.arange(len(t))
    return bool(np.max(np.abs(fine - np.polyval(np.polyfit(rows, fine, 1), rows))) > 1.0)


def gone_back(one: Column) -> str:
    """What is said of a column that is called a time, but falls in some of its rows; else empty."""
    falls = np.diff(one.values) < 0.0
    if set(one.header.means) != {"time"} or not 0.0 < np.mean(falls) < MOST_UNEVEN:
        return ""
    return f"is called a time, but goes back in data row {int(np.argmax(falls)) + 2}"


def _rises(one: Column) -> bool:
    """Whether a column goes up from each row to the next."""
    return bool(np.all(np.isfinite(one.values)) and np.all(np.diff(one.values) > 0.0))


def _rising_one(where: str, columns: Sequence[Column], texts: Sequence[Column]) -> Column:
    """The column that holds the time; texts: columns that hold no numbers.

    Raises BadLog where there is none.
    """
    ticking = [one for one in columns if ticks(one)]
    rising = [one for one in columns if _rises(one)]
    same = all(np.array_equal(one.values, rising[0].values) for one in rising)
    if not ticking and rising and same:  # a clock that is uneven, or called something else
        return rising[0]
    if not ticking:
        named = [one for one in columns if "time" in one.header.means]
        found = "no column goes up evenly from row to row"
        if named:
            found = f"column {named[0].shown} {_wrong_with_clock(named[0].values)}"
        elif texts:
            found = f"column {texts[0].shown} holds {texts[0].raw.unusable}"
        raise BadLog(
            f"{where}: no clock: {found}; log a column of times, or of sample numbers, that"
            " increases from row to row"
        )

    def likely(one: Column) -> float:
        means, unit = one.header.means, one.header.unit
        counted = one.whole and float(np.median(np.diff(one.values))) == 1.0
        return (
            means.get("time", 0.0)
            - means.get("count", 0.0)
            + (4.0 if unit and unit.quantity == "time" else 0.0)
            - (ROW_NUMBERS if counted else 0.0)
        )

    return max(ticking, key=likely)


def _of_steps(columns: Sequence[Column], steady: Sequence[Column]) -> Column | None:
    """The clock of a log that has the time since the row before, summed, where no column is called
    a time and goes up: of columns called a time the one that may hold that, of a log without any
    names and clock the only one; None where none may. steady: columns of one value called so."""
    ticking = [one for one in columns if ticks(one)]
    named = [*steady, *(one for one in columns if "time" in one.header.means)]
    nameless = [one for one in columns if not (ticking or one.raw.header) and one.noisy]
    found = [one for one in named or nameless if _are_steps(one.values)]
    if len(found) != 1 or any("time" in one.header.means for one in ticking):
        return None
    whole = summed(found[0].values)
    return replace(found[0], values=whole, x=whole, summed=True)


def _are_steps(x: Array) -> bool:
    """Whether values (n,) may be times from row to row: above 0, few far from their middle, about
    which they go up and down."""
    if not (np.all(np.isfinite(x)) and np.all(x > 0.0)):
        return False
    up, down = (np.sum(sign * np.diff(x) > 0.0) for sign in (1.0, -1.0))
    far = np.mean(x > LONGEST_GAP * np.median(x))
    return bool(TWICE * down >= up and TWICE * up >= down and far < MOST_UNEVEN)


def _wrong_with_clock(t: Array) -> str:
    """Why times (n,) are none of a clock, and where."""
    step = np.diff(t)
    wrong = np.flatnonzero(~(step > 0.0))
    row = int(wrong[0]) + 2 if len(wrong) else 2
    if np.mean(step == 0.0) > OFTEN_REPEATED:
        return f"repeats its times (data row {row}): they are coarser than the rows"
    if 0 < len(wrong) < MOST_STARTS and np.all(
        t[wrong + 1] <= t[0] + LONGEST_GAP * np.median(step)
    ):
        return (
            f"begins again in data row {row}, as that of several runs in one file, and not all are"
            f" of {SHORTEST_LOG} rows; give longer runs"
        )
    return f"does not go up evenly (see data row {row})"
