"""Columns of a log made comparable: at the rows of one run, unwrapped, on one even grid, each
signal once."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations, pairwise, product

import numpy as np

from identification.arrays import Array
from identification.columns.clock import ticks
from identification.columns.column import Column
from identification.columns.header import is_position, words_of
from identification.columns.pairs import correlation
from identification.log import Log
from identification.signals.check import SHORTEST_LOG
from identification.signals.even_clock import LONGEST_GAP
from identification.signals.offsets import OF_TURN, unwrapped
from identification.signals.renewal import LONGEST_HOLD, USUAL_FROM, hold_length, new_values
from identification.signals.stamps import even_stamps, sound_rows, starts_in_words, stretches
from identification.thresholds import OF_ACCOUNT, TWICE

MOST_MISSING = 0.1  # of a column that is used
SAME_SIGNAL = 1.5  # times their rounding, that two columns of one signal are apart at most
NEARLY_ALIKE = 0.999  # correlation of two columns that may be one signal
ANGLES_WRAP = (2.0 * np.pi, 360.0, 2e3 * np.pi, 3600.0, 36000.0)  # rad, deg, and parts of them
COUNTERS_WRAP = tuple(2.0**bits for bits in range(8, 33))
MOST_ROUNDED = 0.02  # of a signal, that its rounding is
SAME_MOTION = 0.95  # correlation from which two positions are one axis with two sensors


def motor_phases(columns: Sequence[Column]) -> tuple[Column, ...]:
    """Three currents of about one size, whose sum is 0: those of a motor's phases."""
    currents = [one for one in columns if one.current]
    for three in combinations(currents, 3):
        sizes = [float(np.std(one.x)) for one in three]
        left = float(np.std(np.sum([one.x for one in three], axis=0)))
        if max(sizes) < TWICE * min(sizes) and left < OF_ACCOUNT * min(sizes):
            return three
    return ()


def at_sound_rows(columns: Sequence[Column]) -> tuple[list[Column], tuple[str, ...]]:
    """The columns at the rows of one run, where a time among them goes up but for rows without a
    time, rows written twice, or a logger that was started anew; and what is said of it."""
    named = [one for one in columns if "time" in one.header.means]
    if not any(map(ticks, named or columns)):  # beside a time a number of rows is none
        for one in named or [one for one in columns if not one.header.means]:
            beside = [other.values for other in columns if other is not one]
            rows, said = sound_rows(one.values, beside)
            runs = stretches(one.values[rows])
            longest = max(runs, key=lambda run: run.stop - run.start)
            at = rows[longest]
            even, late = even_stamps(one.values[at])
            clock = replace(one, values=even, x=even)
            if late or ((said or len(at) < len(rows)) and ticks(clock)):
                if len(runs) > 1:
                    starts = starts_in_words(one.values[rows], runs)
                    said = (*said, f"the {starts}, of which this is what the longest shows")
                return [clock if c is one else replace(c, values=c.values[at], x=c.values[at])
                        for c in columns], (*said, late)  # fmt: skip
    return list(columns), ()


def ways_gone(columns: Sequence[Column]) -> dict[int, str]:
    """What is said of columns that only go up, by the steps of another one whichever way that goes,
    as the way that a wheel has rolled."""
    steps = {one.raw.number: np.diff(one.values) for one in columns}
    rising = [one for one in columns if np.all(steps[one.raw.number] >= 0.0)]
    gone = dict[int, str]()
    for one, other in product(rising, columns):
        of = steps[other.raw.number]
        both = np.column_stack([steps[one.raw.number], np.abs(of)])
        if np.min(of) < 0.0 < np.max(of) and correlation(both)[0, 1] > SAME_MOTION:
            gone[one.raw.number] = f"is the way that {other.shown} goes, both ways together"
    return gone


def longest_piece(t: Array) -> slice | None:
    """The longest run between the gaps of a clock, where these last longer than the runs."""
    step = np.diff(t)
    gaps = step > LONGEST_GAP * np.median(step)
    if 2.0 * np.sum(step[gaps]) <= t[-1] - t[0]:
        return None
    pieces = pairwise([0, *(np.flatnonzero(gaps) + 1).tolist(), len(t)])
    return slice(*max(pieces, key=lambda piece: piece[1] - piece[0]))


def why_unusable(one: Column) -> str:
    """Why a column cannot be a signal, empty where it can."""
    if one.raw.unusable:
        return one.raw.unusable
    finite = np.isfinite(one.values)
    if np.mean(~finite) > MOST_MISSING:
        return f"{np.mean(~finite):.0%} of its values are missing"
    if np.ptp(one.values[finite]) == 0.0:
        return f"is always {one.values[finite][0] + 0.0:g}"
    steps = np.diff(one.values[finite])
    unit, means = one.header.unit, one.header.means
    events = unit.quantity == "count" if unit else not {"time", "position"} & set(means)
    if events and one.whole and np.all((steps == 0.0) | (steps == 1.0)) and np.any(steps == 0.0):
        return "counts something: from row to row it stays, or goes up by one"
    return ""


def unwrapped_column(t: Array, one: Column) -> tuple[Array, str]:
    """A column (n,), unwrapped as whoever reads a position by a card does where it is a counter or
    an angle that wraps, and what is said of that; any other as it is."""
    known = np.isfinite(one.values)
    if not _may_be_position(one) or np.sum(known) < SHORTEST_LOG:
        return one.values, ""
    made, found = unwrapped(Log("", {"t": t[known], "y": one.values[known]}), rotary=True)
    size = found[0].size if found else None
    counter = size is not None and size in COUNTERS_WRAP
    if not size or not (counter or any(abs(size / turn - 1.0) < OF_TURN for turn in ANGLES_WRAP)):
        return one.values, ""
    x = one.values.copy()
    x[known] = made["y"]
    what = f"a counter of {round(np.log2(size))} bits" if counter else "an angle"
    return x, f"{one.shown} leaps by {size:.7g} {found[0].samples} times, {what}: unwrapped"


def on_grid(one: Column, t: Array, x: Array, step: float, size: int) -> Column:
    """The column at even times, its values x (n,) means over so many steps of the clock, (k,).

    One that may be a position, and is held while the clock goes on, is interpolated between its new
    values: its steps are no motion.
    """
    good = np.isfinite(x)
    hold = hold_length(x) if _may_be_position(one) else 1
    hold = hold if USUAL_FROM <= hold <= LONGEST_HOLD else 1
    if hold > 1:
        good = np.isin(np.arange(len(x)), np.union1d(0, new_values(x, hold)))
    count = min(round((t[-1] - t[0]) / step) + 1, 50 * len(t))
    even = np.interp(t[0] + step * np.arange(count), t[good], x[good])
    whole = len(even) // size
    means = np.asarray(even[: whole * size].reshape(whole, size).mean(axis=1))
    return replace(one, x=means, renewed=max(1.0, hold / size))


def _may_be_position(one: Column) -> bool:
    """Whether no header denies that a column is a position."""
    return not one.header.means or "position" in one.header.means


def without_doubles(columns: Sequence[Column]) -> tuple[list[Column], dict[int, str]]:
    """The columns without those that are another one in another unit, and what these are.

    Of two the one whose header says more is kept, else the finer, else the later: what is made
    from a sensor's output stands behind it. Of a position before and behind a gear, the one whose
    name begins as that of a force that is kept.
    """
    order = sorted(columns, key=lambda one: (-_said(one), _coarseness(one), one.whole,
                                             -one.raw.number))  # fmt: skip
    if not order:
        return [], {}
    alike = np.abs(correlation(np.column_stack([one.x for one in order])))
    families = list[list[Column]]()
    place = {one.raw.number: k for k, one in enumerate(order)}
    for k, one in enumerate(order):
        near = (of for of in families if alike[k, place[of[0].raw.number]] > NEARLY_ALIKE)
        family = next((of for of in near if _same(one, of[0])), None)
        if family is None:
            families.append([one])
        else:
            family.append(one)
    forces = {_begins(of[0]) for of in families if "force" in of[0].header.means
              and of[0].header.purpose != "reference"}  # fmt: skip
    for family in families:
        if is_position(family[0].header):  # the sort is stable: else the first stays so
            family.sort(key=lambda one: not (is_position(one.header) and _begins(one) in forces))
    twice = {
        one.raw.number: (
            f"equals {kept.shown} in every row"
            if np.array_equal(one.values, kept.values, equal_nan=True)
            else f"is {kept.shown} in another unit"
        )
        for kept, *others in families
        for one in others
    }
    return sorted((kept for kept, *_ in families), key=lambda one: one.raw.number), twice


def _begins(one: Column) -> str:
    """The first word of a header with several: of a joint, or of what drives it."""
    words = words_of(one.header.name)
    return "_".join(words[:2] if words[1:2] and words[1].isdigit() else words[:1])


def _coarseness(one: Column) -> int:
    """How coarse a column is: the power of ten of its step over its range, 0 without a step."""
    width = float(np.ptp(one.numbers)) if len(one.numbers) else 0.0
    step = one.step / width if width > 0.0 else 0.0
    return 0 if step == 0.0 else max(0, 8 + round(np.log10(step)))


def _said(one: Column) -> float:
    """How much a header says: a sensor's own volts and counts less than the signal's unit, a
    command's own unit as much."""
    unit = one.header.unit
    raw = unit is not None and unit.quantity in ("command", "count")
    raw = raw and not one.header.means.get("command")
    known = 0.0 if unit is None or raw else 4.0
    known -= {"error": 3.0, "filtered": 1.0}.get(one.header.purpose, 0.0)
    means = (weight for what, weight in one.header.means.items() if what != "other")
    return known + max(means, default=0.0) - (1.0 if raw else 0.0)


def _same(one: Column, other: Column) -> bool:
    """Whether two columns are one signal but for scale and offset: what is left is rounding."""
    a, b = (x - x.mean() for x in one.beside(other))
    square, spread = float(a @ a), float(np.std(b))
    if square == 0.0 or spread == 0.0:
        return False
    factor = float(a @ b) / square
    left = float(np.sqrt(np.mean((b - factor * a) ** 2)))
    rounding = np.hypot(other.step, abs(factor) * one.step)
    allowed = max(float(rounding) / np.sqrt(12.0), 1e-9 * spread)
    return left < SAME_SIGNAL * allowed and left < MOST_ROUNDED * spread
