"""Columns of an unknown log made comparable: the clock found, the others on its even grid."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.columns.axes import axes_of
from identification.columns.clock import clock_of, gone_back, is_second
from identification.columns.column import MOST_ROWS_READ, Column, RawColumn, read_register
from identification.columns.comparable import (
    at_sound_rows,
    longest_piece,
    motor_phases,
    on_grid,
    unwrapped_column,
    ways_gone,
    why_unusable,
    without_doubles,
)
from identification.columns.header import Header, Quantity, says_period, words_of
from identification.columns.names import read_together
from identification.columns.notation import Notation
from identification.columns.pairs import correlation
from identification.signals.stamps import even_stamps
from identification.thresholds import HALF

_INPUT = re.compile(r"input\W*\d+", re.I)
VOLTS = ("V", "mV")
CALLED_POWER = {"power", "leistung", "pow"}
PHASE_CURRENT = "one of three phase currents, whose sum is 0"
FEWEST_OF_AXES = 3  # columns from which a log may hold several axes


@dataclass(frozen=True, eq=False)
class UnknownLog:
    """The columns of a file that no card describes, single values beside them, and what else it
    holds.

    where: what the file is called by; layout: how it is read, as a card's [file] says it.
    """

    where: str
    layout: Mapping[str, object]
    columns: tuple[RawColumn, ...]
    scalars: tuple[RawColumn, ...]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Columns:
    """A log's clock, the columns that may be signals, and why each of the others is not.

    step: the median step of the clock in its own unit; grid: samples of the file in one of `x`;
    notation: by which headers and units were read; axes: those that the headers name, where there
    are several, be the signals of one of them alone.
    """

    notation: Notation
    log: UnknownLog
    clock: Column
    step: float
    grid: int
    signals: tuple[Column, ...]
    left_out: Mapping[int, str]
    read: tuple[Column, ...]
    axes: tuple[str, ...]


def columns_of(log: UnknownLog, notation: Notation) -> Columns:
    """The columns of a log on one grid; raises BadLog where none of them is a clock."""
    heads = read_together([(one.header, one.unit_below) for one in log.columns], notation)
    read = list[Column]()
    for raw, header in zip(log.columns, heads, strict=True):
        register = read_register(raw.values)
        values = raw.values if register is None else register.values
        one = Column(raw, header, values, values, register, pascals=_pascals(header, notation))
        read.append(_with_sign(one))
    left_out = {one.raw.number: why for one in read if (why := why_unusable(one))}
    usable, said = at_sound_rows([one for one in read if one.raw.number not in left_out])
    others = [one for one in read if one.raw.number in left_out]
    clock = clock_of(log.where, usable, others, _periods(log, usable, notation))
    even, late = even_stamps(clock.values)
    clock, notes = replace(clock, values=even, x=even), [*log.notes, *said, late]
    left_out.pop(clock.raw.number, None)
    usable = [one for one in usable if one.raw.number != clock.raw.number] + [clock]
    if (piece := longest_piece(clock.values)) is not None:
        usable = [replace(one, values=one.values[piece]) for one in usable]
        most = float(np.max(np.diff(clock.values)))
        notes += [f"the clock leaps by {most:.4g}, longer than its runs: this is what one shows"]
        clock = next(one for one in usable if one.raw.number == clock.raw.number)
    step = float(np.median(np.diff(clock.values)))
    others = [one for one in usable if one is not clock]
    second = "goes up with the clock, as another one does"
    left_out |= {one.raw.number: why for one in others
                 if (why := second if is_second(one, clock) else gone_back(one))}  # fmt: skip
    left_out |= ways_gone(others)
    others = [one for one in others if one.raw.number not in left_out]
    grid = max(1, -(-round(np.ptp(clock.values) / step) // MOST_ROWS_READ))
    whole = [unwrapped_column(clock.values, one) for one in others]
    log = replace(log, notes=tuple(filter(None, [*notes, *(said for _, said in whole)])))
    signals = [
        on_grid(one, clock.values, x, step, grid) for one, (x, _) in zip(others, whole, strict=True)
    ]
    phases = motor_phases(signals)
    left_out |= {one.raw.number: PHASE_CURRENT for one in phases}
    distinct, twice = without_doubles([one for one in signals if one not in phases])
    own = tuple(_with_axes(_of_a_scope(distinct), notation))
    axes = tuple(sorted({one.axis for one in own if one.axis}))
    return Columns(notation, log, clock, step, grid, own, left_out | twice, tuple(read), axes)


def _periods(log: UnknownLog, usable: Sequence[Column], notation: Notation) -> list[Column]:
    """The log's single values that are called a period, as columns of as many rows."""
    rows, out = len(usable[0].values) if usable else 0, []
    for one in log.scalars:
        if says_period(one.header):
            values = np.full(rows, one.values[0])
            out.append(Column(one, notation.header(one.header, one.unit_below), values, values))
    return out


def _pascals(head: Header, notation: Notation) -> float | None:
    """What one of the header's unit is in Pa; None where that is no pressure's."""
    if head.unit is None or head.unit.quantity != "pressure":
        return None
    return notation.factor(head.unit.card)


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


def _with_axes(columns: Sequence[Column], notation: Notation) -> list[Column]:
    """The columns, each with the axis that its header names where there are several."""
    if len(columns) < FEWEST_OF_AXES:
        return list(columns)
    alike = correlation(np.column_stack([one.x for one in columns]))
    named = axes_of([(one.header, one.raw.number) for one in columns], alike, notation)
    return [replace(one, axis=named.get(one.raw.number, "")) for one in columns]
