"""Columns of an unknown log made comparable: the clock found, the others on its even grid."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise, product

import numpy as np

from identification.arrays import Array
from identification.columns.column import MOST_ROWS_READ, Column, read_register
from identification.columns.header import Header, Quantity, words_of
from identification.columns.pairs import correlation
from identification.log import Log
from identification.signals.check import SHORTEST_LOG
from identification.signals.even_clock import LONGEST_GAP
from identification.signals.offsets import OF_TURN, unwrapped
from identification.signals.renewal import LONGEST_HOLD, USUAL_FROM, held_for, new_values
from identification.signals.stamps import even_stamps, sound_rows, stretches, told_of_starts
from identification.thresholds import HALF, OF_ACCOUNT, TWICE
from workbench.cards.units import conversion
from workbench.logs.unknown import UnknownLog
from workbench.steps.first_card.axes import SAME_MOTION, axes_of, is_position
from workbench.steps.first_card.clock_column import clock_of, gone_back, is_second, ticks
from workbench.steps.first_card.names import read_together

MOST_MISSING = 0.1  # of a column that is used
_INPUT = re.compile(r"input\W*\d+", re.I)
VOLTS = ("V", "mV")
CALLED_POWER = {"power", "leistung", "pow"}
PHASE_CURRENT = "one of three phase currents, whose sum is 0"
SAME_SIGNAL = 1.5  # times their rounding, that two columns of one signal are apart at most
NEARLY_ALIKE = 0.999  # correlation of two columns that may be one signal
FEWEST_OF_AXES = 3  # columns from which a log may hold several axes
ANGLES_WRAP = (2.0 * np.pi, 360.0, 2e3 * np.pi, 3600.0, 36000.0)  # rad, deg, and parts of them
COUNTERS_WRAP = tuple(2.0**bits for bits in range(8, 33))
MOST_ROUNDED = 0.02  # of a signal, that its rounding is


@dataclass(frozen=True, eq=False)
class Columns:
    """A log's clock, the columns that may be signals, and why each of the others is not.

    step: the median step of the clock in its own unit; grid: samples of the file in one of `x`.
    """

    log: UnknownLog
    clock: Column
    step: float
    grid: int
    signals: tuple[Column, ...]
    left_out: Mapping[int, str]
    read: tuple[Column, ...]

    @property
    def axes(self) -> tuple[str, ...]:
        """The axes that the headers name, where there are several."""
        return tuple(sorted({one.axis for one in self.signals if one.axis}))


def columns_of(log: UnknownLog) -> Columns:
    """The columns of a log on one grid; raises BadLog where none of them is a clock."""
    heads = read_together([(one.header, one.unit_below) for one in log.columns])
    read = list[Column]()
    for raw, header in zip(log.columns, heads, strict=True):
        register = read_register(raw.values)
        values = raw.values if register is None else register.values
        one = Column(raw, header, values, values, register, pascals=_pascals(header))
        read.append(_with_sign(one))
    left_out = {one.raw.number: why for one in read if (why := _unusable(one))}
    usable, said = _at_sound_rows([one for one in read if one.raw.number not in left_out])
    clock = clock_of(log, usable, [one for one in read if one.raw.number in left_out])
    even, late = even_stamps(clock.values)
    clock, notes = replace(clock, values=even, x=even), [*log.notes, *said, late]
    left_out.pop(clock.raw.number, None)
    usable = [one for one in usable if one.raw.number != clock.raw.number] + [clock]
    if (piece := _longest_piece(clock.values)) is not None:
        usable = [replace(one, values=one.values[piece]) for one in usable]
        most = float(np.max(np.diff(clock.values)))
        notes += [f"the clock leaps by {most:.4g}, longer than its runs: this is what one shows"]
        clock = next(one for one in usable if one.raw.number == clock.raw.number)
    step = float(np.median(np.diff(clock.values)))
    others = [one for one in usable if one is not clock]
    second = "goes up with the clock, as another one does"
    left_out |= {one.raw.number: why for one in others
                 if (why := second if is_second(one, clock) else gone_back(one))}  # fmt: skip
    left_out |= _ways_gone(others)
    others = [one for one in others if one.raw.number not in left_out]
    grid = max(1, -(-round(np.ptp(clock.values) / step) // MOST_ROWS_READ))
    whole = [_unwrapped(clock.values, one) for one in others]
    log = replace(log, notes=tuple(filter(None, [*notes, *(said for _, said in whole)])))
    signals = [
        _on_grid(one, clock.values, x, step, grid)
        for one, (x, _) in zip(others, whole, strict=True)
    ]
    phases = _phases(signals)
    left_out |= {one.raw.number: PHASE_CURRENT for one in phases}
    distinct, twice = _without_doubles([one for one in signals if one not in phases])
    own = tuple(_with_axes(_of_a_scope(distinct)))
    return Columns(log, clock, step, grid, own, left_out | twice, tuple(read))


def _pascals(head: Header) -> float | None:
    """What one of the header's unit is in Pa; None where that is no pressure's."""
    if head.unit is None or head.unit.quantity != "pressure":
        return None
    found = conversion(head.unit.card, "Pa")
    return None if found is None else found.factor


def _with_sign(one: Column) -> Column:
    """The column; of a power that goes as far below zero as above, as no motor's is that moves
    something, a share of what the motor is given; of a p that does, as no pressure, a position."""
    low, high = (float(side(one.numbers, initial=0.0)) for side in (np.min, np.max))
    power = CALLED_POWER & set(words_of(one.header.name))
    pressure = set(one.header.means) == {"pressure"}
    if low > -HALF * high or high < -HALF * low or one.header.unit or not (power or pressure):
        return one
    means: dict[Quantity, float] = {"command": 2.0} if power else {"position": 1.0}
    return replace(one, header=replace(one.header, means=means))


def _of_a_scope(columns: Sequence[Column]) -> Sequence[Column]:
    """The columns; where all are in volts, as those of a scope, the unit tells nothing of one, nor
    does an input's number."""
    units = [one.header.unit for one in columns]
    if not all(unit is not None and unit.card in VOLTS for unit in units):
        return columns
    heads = [replace(one.header, doubtful=True) for one in columns]
    heads = [replace(one, means={}) if _INPUT.fullmatch(one.name) else one for one in heads]
    return [replace(one, header=head) for one, head in zip(columns, heads, strict=True)]


def _phases(columns: Sequence[Column]) -> tuple[Column, ...]:
    """Three currents of about one size, whose sum is 0: those of a motor's phases."""
    currents = [one for one in columns if one.current]
    for three in combinations(currents, 3):
        sizes = [float(np.std(one.x)) for one in three]
        left = float(np.std(np.sum([one.x for one in three], axis=0)))
        if max(sizes) < TWICE * min(sizes) and left < OF_ACCOUNT * min(sizes):
            return three
    return ()


def _at_sound_rows(columns: Sequence[Column]) -> tuple[list[Column], tuple[str, ...]]:
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
                    told = told_of_starts(one.values[rows], runs)
                    said = (*said, f"the {told}, of which this is what the longest shows")
                return [clock if c is one else replace(c, values=c.values[at], x=c.values[at])
                        for c in columns], (*said, late)  # fmt: skip
    return list(columns), ()


def _ways_gone(columns: Sequence[Column]) -> dict[int, str]:
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


def _longest_piece(t: Array) -> slice | None:
    """The longest run between the gaps of a clock, where these last longer than the runs."""
    step = np.diff(t)
    gaps = step > LONGEST_GAP * np.median(step)
    if 2.0 * np.sum(step[gaps]) <= t[-1] - t[0]:
        return None
    pieces = pairwise([0, *(np.flatnonzero(gaps) + 1).tolist(), len(t)])
    return slice(*max(pieces, key=lambda piece: piece[1] - piece[0]))


def _unusable(one: Column) -> str:
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


def _unwrapped(t: Array, one: Column) -> tuple[Array, str]:
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


def _on_grid(one: Column, t: Array, x: Array, step: float, size: int) -> Column:
    """The column at even times, its values x (n,) means over so many steps of the clock, (k,).

    One that may be a position, and is held while the clock goes on, is interpolated between its new
    values: its steps are no motion.
    """
    good = np.isfinite(x)
    held = held_for(x) if _may_be_position(one) else 1
    held = held if USUAL_FROM <= held <= LONGEST_HOLD else 1
    if held > 1:
        good = np.isin(np.arange(len(x)), np.union1d(0, new_values(x, held)))
    count = min(round((t[-1] - t[0]) / step) + 1, 50 * len(t))
    even = np.interp(t[0] + step * np.arange(count), t[good], x[good])
    whole = len(even) // size
    means = np.asarray(even[: whole * size].reshape(whole, size).mean(axis=1))
    return replace(one, x=means, renewed=max(1.0, held / size))


def _may_be_position(one: Column) -> bool:
    """Whether no header denies that a column is a position."""
    return not one.header.means or "position" in one.header.means


def _without_doubles(columns: Sequence[Column]) -> tuple[list[Column], dict[int, str]]:
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


def _with_axes(columns: Sequence[Column]) -> list[Column]:
    """The columns, each with the axis that its header names where there are several."""
    if len(columns) < FEWEST_OF_AXES:
        return list(columns)
    alike = correlation(np.column_stack([one.x for one in columns]))
    named = axes_of([(one.header, one.raw.number) for one in columns], alike)
    return [replace(one, axis=named.get(one.raw.number, "")) for one in columns]


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
