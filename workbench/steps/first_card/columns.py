"""Columns of an unknown log made comparable: the clock found, the others on its even grid."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations, pairwise
from pathlib import Path

import numpy as np

from identification.arrays import Array
from identification.errors import BadLog
from identification.log import Log
from identification.signals.check import SHORTEST_LOG
from identification.signals.differentiate import Motion, resolution
from identification.signals.even_clock import LONGEST_GAP
from identification.signals.noise import local_noise
from identification.signals.offsets import OF_TURN, unwrapped
from identification.signals.relations import motion_of
from identification.signals.renewal import LONGEST_HOLD, USUAL_FROM, held_for, new_values
from identification.thresholds import OF_ACCOUNT, TWICE
from workbench.cards.headers import Header, read_header, words_of
from workbench.logs.faulty_rows import (
    MOST_STARTS,
    late_stamps,
    several_axes,
    sound_rows,
    stretches,
    told_of_starts,
)
from workbench.logs.summed import summed
from workbench.logs.unknown import RawColumn, UnknownLog
from workbench.steps.first_card.axes import axes_of, correlation, without_blocks
from workbench.steps.first_card.registers import Register, read_register

COLUMN = "column"
MOST_ROWS_READ = 10_000
MOST_MISSING = 0.1  # of a column that is used
WAY_BLOCKS = 2000  # means of a column over which its way is reckoned
OFTEN_REPEATED = 0.1  # share of the steps of a clock, that do not move it
MOST_UNEVEN = 0.2  # steps that are off the median by more than half of it, of a clock
MOSTLY_NOISE = 0.8  # of a signal's spread, that its white noise is
AMPERES, VOLTS = ("A", "mA"), ("V", "mV")
PHASE_CURRENT = "one of three phase currents, whose sum is 0"
FEW_LEVELS = 8  # values at most, of a flag, mode or state
PERIODS = {"ts", "dt", "timestep", "period", "tsample"}  # names of the time from row to row
ROW_NUMBERS = 2.5  # for a clock that goes up by one a row, beside others
SECOND_CLOCK = 2e-3  # of its range, that a clock is off another one at most
SAME_SIGNAL = 1.5  # times their rounding, that two columns of one signal are apart at most
NEARLY_ALIKE = 0.999  # correlation of two columns that may be one signal
FEWEST_WITH_UNITS = 2  # columns, that make units of the last letters of others
FEWEST_OF_AXES = 3  # columns from which a log may hold several axes
ANGLES_WRAP = (2.0 * np.pi, 360.0, 2e3 * np.pi, 3600.0, 36000.0)  # rad, deg, and parts of them
COUNTERS_WRAP = tuple(2.0**bits for bits in range(8, 33))
MOST_ROUNDED = 0.02  # of a signal, that its rounding is


@dataclass(frozen=True, eq=False)
class Column:
    """A column with its header; `values` (n,) as in the file, `x` (k,) on the grid looked at, both
    as its register means them; axis: which of several machines of the log it is of ("": of all);
    renewed: samples of `x` from one new value to the next of a column that is held, else 1;
    summed: whether `values` or `x` are the sum of what the file has."""

    raw: RawColumn
    header: Header
    values: Array
    x: Array
    register: Register | None = None
    axis: str = ""
    renewed: float = 1.0
    summed: bool = False

    @property
    def bits(self) -> int | None:
        """Of two's complement, else None."""
        return self.register.bits if self.register else None

    @property
    def shown(self) -> str:
        """The column as a reader finds it in the file."""
        header, number = self.raw.header, self.raw.number
        if not header:
            return f"number {number}"
        return repr(header) if header == self.raw.key else f"{header!r} (number {number})"

    @property
    def answer(self) -> str:
        """The column as an answer names it, beside units."""
        return f"{COLUMN} {self.raw.key}"

    @cached_property
    def numbers(self) -> Array:
        """The first values that are numbers, as many as are looked at."""
        part = self.values[:MOST_ROWS_READ]
        return np.asarray(part[np.isfinite(part)])

    @cached_property
    def motion(self) -> Motion | None:
        """The column as if it were a position."""
        return motion_of(self.x, self.renewed)

    @cached_property
    def noise(self) -> float:
        """White noise and rounding of the column, one sigma."""
        return local_noise(self.x)

    @cached_property
    def noisy(self) -> bool:
        """Whether it is white noise, and next to nothing else."""
        return self.noise > MOSTLY_NOISE * float(np.std(self.x))

    @cached_property
    def levels(self) -> Array:
        """The values that it takes, in order."""
        return np.asarray(np.unique(self.numbers))

    @cached_property
    def step(self) -> float:
        """Step of its values where all are multiples of one, else 0."""
        return resolution(self.numbers)

    @cached_property
    def flag(self) -> bool:
        """Whether it holds a few whole numbers: a switch, a mode or a state."""
        few = self.levels
        whole = 1 < len(few) <= FEW_LEVELS and bool(np.all(few == np.round(few)))
        return whole and (few[0] >= 0.0 or bool(np.all(np.abs(few) <= 1.0)))

    @cached_property
    def way_gone(self) -> float:
        """The way that it goes, in units of its range."""
        size = max(1, len(self.x) // WAY_BLOCKS)
        count = len(self.x) // size
        means = self.x[: count * size].reshape(count, size).mean(axis=1)
        width = float(np.ptp(means))
        return float(np.sum(np.abs(np.diff(means)))) / width if width > 0 else 0.0

    @cached_property
    def whole(self) -> bool:
        """Whether it has whole numbers alone."""
        finite = self.values[np.isfinite(self.values)]
        return bool(np.all(finite == np.round(finite)))


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
    names = without_blocks([one.header for one in log.columns])
    heads = [read_header(name, one.unit_below)
             for name, one in zip(names, log.columns, strict=True)]  # fmt: skip
    if sum(one.unit is not None and not one.doubtful for one in heads) >= FEWEST_WITH_UNITS:
        heads = [replace(one, doubtful=False) for one in heads]  # as others end in units too
    heads = _without_letters(heads)
    read = list[Column]()
    for raw, header in zip(log.columns, heads, strict=True):
        register = read_register(raw.values)
        values = raw.values if register is None else register.values
        read.append(Column(raw, header, values, values, register))
    left_out = {one.raw.number: why for one in read if (why := _unusable(one))}
    usable, said = _at_sound_rows([one for one in read if one.raw.number not in left_out])
    log = replace(log, notes=(*log.notes, *said))
    steady = [one for one in read if one.raw.number in left_out and "time" in one.header.means]
    rows = len(usable[0].values) if usable else 0
    for one in (one for one in log.scalars if PERIODS & set(words_of(one.header))):
        values = np.full(rows, one.values[0])
        steady.append(Column(one, read_header(one.header), values, values))
    steady = [one for one in steady if len(one.values) == rows]
    clock = _of_steps(usable, steady) or _clock(
        log.path, usable, [one for one in read if one.raw.unusable]
    )
    left_out.pop(clock.raw.number, None)
    usable = [one for one in usable if one.raw.number != clock.raw.number] + [clock]
    if (piece := _longest_piece(clock.values)) is not None:
        usable = [replace(one, values=one.values[piece]) for one in usable]
        most = float(np.max(np.diff(clock.values)))
        leap = f"the clock leaps by {most:.4g}, longer than its runs: this is what one shows"
        log = replace(log, notes=(*log.notes, leap))
        clock = next(one for one in usable if one.raw.number == clock.raw.number)
    step = float(np.median(np.diff(clock.values)))
    clocks = {one.raw.number for one in usable if one is not clock and _second(one, clock)}
    left_out |= dict.fromkeys(sorted(clocks), "goes up with the clock, as another one does")
    back = {one.raw.number: _gone_back(one) for one in usable if one is not clock}
    left_out |= {number: said for number, said in back.items() if said and number not in clocks}
    others = [one for one in usable if one is not clock and one.raw.number not in left_out]
    grid = max(1, -(-round(np.ptp(clock.values) / step) // MOST_ROWS_READ))
    whole = [_unwrapped(clock.values, one) for one in others]
    log = replace(log, notes=(*log.notes, *filter(None, (said for _, said in whole))))
    signals = [
        _on_grid(one, clock.values, x, step, grid)
        for one, (x, _) in zip(others, whole, strict=True)
    ]
    phases = _phases(signals)
    left_out |= {one.raw.number: PHASE_CURRENT for one in phases}
    distinct, twice = _without_doubles([one for one in signals if one not in phases])
    own = tuple(_with_axes(_of_a_scope(distinct)))
    return Columns(log, clock, step, grid, own, left_out | twice, tuple(read))


def _without_letters(heads: Sequence[Header]) -> list[Header]:
    """The headers, without a unit that is the last of the letters by which several are told apart,
    as the A of "adc_A" beside "adc_B"."""
    apart = {one.text[:-1] for one in heads if one.text[-2:-1] in ("_", " ") and one.unit is None}
    return [replace(one, unit=None) if one.text[:-1] in apart else one for one in heads]


def _of_a_scope(columns: Sequence[Column]) -> Sequence[Column]:
    """The columns; where all are in volts, as those of a scope, the unit tells nothing of one."""
    units = [one.header.unit for one in columns]
    if not all(unit is not None and unit.card in VOLTS for unit in units):
        return columns
    return [replace(one, header=replace(one.header, doubtful=True)) for one in columns]


def _phases(columns: Sequence[Column]) -> tuple[Column, ...]:
    """Three currents of about one size, whose sum is 0: those of a motor's phases."""
    currents = [one for one in columns if one.header.unit and one.header.unit.card in AMPERES]
    for three in combinations(currents, 3):
        sizes = [float(np.std(one.x)) for one in three]
        left = float(np.std(np.sum([one.x for one in three], axis=0)))
        if max(sizes) < TWICE * min(sizes) and left < OF_ACCOUNT * min(sizes):
            return three
    return ()


def _at_sound_rows(columns: Sequence[Column]) -> tuple[list[Column], tuple[str, ...]]:
    """The columns at the rows of one run, where a time among them goes up but for rows without a
    time, rows written twice, or a logger that was started anew; and what is said of it."""
    if not any(map(_ticks, columns)):
        named = [one for one in columns if "time" in one.header.means]
        for one in named or [one for one in columns if not one.header.means]:
            beside = [other.values for other in columns if other is not one]
            rows, said = sound_rows(one.values, beside)
            runs = stretches(one.values[rows])
            longest = max(runs, key=lambda run: run.stop - run.start)
            at = np.flatnonzero(rows)[longest]
            even, late = late_stamps(one.values[at])
            if late:
                clock = replace(one, values=even, x=even)
                return [clock if c is one else replace(c, values=c.values[at], x=c.values[at])
                        for c in columns], (*said, late)  # fmt: skip
            if len(at) < len(one.values) and _ticks(replace(one, values=one.values[at])):
                if len(runs) > 1:
                    told = told_of_starts(one.values[rows], runs)
                    said = (*said, f"the {told}, of which this is what the longest shows")
                return [replace(c, values=c.values[at], x=c.values[at]) for c in columns], said
    return list(columns), ()


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
    return ""


def _ticks(one: Column) -> bool:
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


def _second(one: Column, clock: Column) -> bool:
    """Whether a column is one more clock, or counts rows or ticks, be it as unevenly as the rows
    come."""
    means = one.header.means
    ticks = _ticks(one)
    if ticks and {"time", "count"} & set(means):
        return True
    counts = (
        one.whole and _rises(one) and all(means[what] < 1.0 for what in means if what != "count")
    )
    if not (counts or ticks):
        return False
    line = np.polyfit(clock.values, one.values, 1)
    off = float(np.max(np.abs(one.values - np.polyval(line, clock.values))))
    most = LONGEST_GAP * float(np.median(np.diff(one.values))) if counts else 0.0
    return off < max(most, SECOND_CLOCK * float(np.ptp(one.values)))


def _gone_back(one: Column) -> str:
    """What is said of a column that is called a time, but falls in some of its rows; else empty."""
    falls = np.diff(one.values) < 0.0
    if set(one.header.means) != {"time"} or not 0.0 < np.mean(falls) < MOST_UNEVEN:
        return ""
    return f"is called a time, but goes back in data row {int(np.argmax(falls)) + 2}"


def _rises(one: Column) -> bool:
    """Whether a column goes up from each row to the next."""
    return bool(np.all(np.isfinite(one.values)) and np.all(np.diff(one.values) > 0.0))


def _clock(path: Path, columns: Sequence[Column], texts: Sequence[Column]) -> Column:
    """The column that holds the time; texts: columns that hold no numbers.

    Raises BadLog where there is none.
    """
    ticking = [one for one in columns if _ticks(one)]
    rising = [one for one in columns if _rises(one)]
    if not ticking and len(rising) == 1:  # a clock that is uneven, and called something else
        return rising[0]
    if not ticking:
        cells = [(one.shown, one.values if one.raw.cells is None else one.raw.cells)
                 for one in (*columns, *texts)]  # fmt: skip
        for one in columns:
            if "time" in one.header.means and (said := several_axes(one.values, cells)):
                raise BadLog(f"{path}: {said}")
        named = [one for one in columns if "time" in one.header.means]
        found = "no column goes up evenly from row to row"
        if named:
            found = f"column {named[0].shown} {_wrong_with_clock(named[0].values)}"
        elif texts:
            found = f"column {texts[0].shown} holds {texts[0].raw.unusable}"
        raise BadLog(
            f"{path}: no clock: {found}; log a column of times, or of sample numbers, that"
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
    ticking = [one for one in columns if _ticks(one)]
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
    rise, far = np.diff(x), np.mean(x > LONGEST_GAP * np.median(x))
    return bool(TWICE * np.sum(rise < 0.0) >= np.sum(rise > 0.0) and far < MOST_UNEVEN)


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
    from a sensor's output stands behind it.
    """
    distinct, twice = list[Column](), dict[int, str]()
    order = sorted(columns, key=lambda one: (-_said(one), _coarseness(one), -one.raw.number))
    if not order:
        return [], {}
    alike = np.abs(correlation(np.column_stack([one.x for one in order])))
    place = {one.raw.number: k for k, one in enumerate(order)}
    for k, one in enumerate(order):
        near = (other for other in distinct if alike[k, place[other.raw.number]] > NEARLY_ALIKE)
        same = next((other for other in near if _same(one, other)), None)
        if same is None:
            distinct.append(one)
        else:
            equal = np.array_equal(one.values, same.values, equal_nan=True)
            said = (
                f"equals {same.shown} in every row" if equal else f"is {same.shown} in another unit"
            )
            twice[one.raw.number] = said
    return sorted(distinct, key=lambda one: one.raw.number), twice


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
    known -= 3.0 if one.header.purpose == "error" else 0.0
    means = (weight for what, weight in one.header.means.items() if what != "other")
    return known + max(means, default=0.0) - (1.0 if raw else 0.0)


def _same(one: Column, other: Column) -> bool:
    """Whether two columns are one signal but for scale and offset: what is left is rounding."""
    first, second = one.values[:MOST_ROWS_READ], other.values[:MOST_ROWS_READ]
    both = np.isfinite(first) & np.isfinite(second)
    a, b = first[both] - first[both].mean(), second[both] - second[both].mean()
    square, spread = float(a @ a), float(np.std(b))
    if square == 0.0 or spread == 0.0:
        return False
    factor = float(a @ b) / square
    left = float(np.sqrt(np.mean((b - factor * a) ** 2)))
    rounding = np.hypot(other.step, abs(factor) * one.step)
    allowed = max(float(rounding) / np.sqrt(12.0), 1e-9 * spread)
    return left < SAME_SIGNAL * allowed and left < MOST_ROUNDED * spread
