"""The clock of a file: times written as durations, clock times or dates, as seconds; the sum of
what a log has the steps of; rows that are no samples of its run (a logger's message, a row written
twice, a number that is text); and a clock that begins again where the logger was started anew."""

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import date, datetime, time, timedelta
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.arrays import Array, BoolArray, frozen
from identification.errors import BadLog
from identification.signals.check import SHORTEST_LOG
from identification.signals.differentiate import resolution
from identification.signals.even_clock import LONGEST_GAP, told_of_hours
from identification.thresholds import HALF, OF_ACCOUNT
from workbench.logs.table import RawColumn, Table, number_of, text_of

_PER_SECOND = {
    **{"s": 1.0, "sec": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0, "hr": 3600.0},
    **{"day": 86400.0, "days": 86400.0},
}
_DURATION = re.compile(rf"([+-]?\d+(?:[.,]\d+)?(?:[eE][+-]?\d+)?) ?({'|'.join(_PER_SECOND)})")
_OF_DAY = r"(\d{1,3}):(\d\d)(?::(\d\d)(?:[.,:;](\d{1,9}))?)?"
_DATE = (
    r"\d{4}-\d\d-\d\d|\d{1,2}\.\d{1,2}\.\d{4}|\d{1,2}-[A-Z][a-z]{2}-\d{4}|\d{4}/\d\d?/\d\d?|"
    r"\d{1,2}/\d{1,2}/\d{4}"
)
_ZONE = r" ?(?:Z|UTC|([+-])(\d\d)(?::?(\d\d))?)"
_MOMENT = re.compile(rf"(?:({_DATE})[T ,;]\s*)?{_OF_DAY}(?:{_ZONE})?")
_DATES = ("%Y-%m-%d", "%d.%m.%Y", "%d-%b-%Y", "%Y/%m/%d", "%m/%d/%Y", "%d/%m/%Y")
_DAY = 86400.0
_NANO, _MILLI, _MILLIS = 1e-9, 1e-3, 1000  # s, and milliseconds of one


def is_time(field: str) -> bool:
    """Whether the text is a duration with its unit, a clock time, or a date."""
    return bool(_DURATION.fullmatch(field) or _MOMENT.fullmatch(field) or _day(field))


def seconds(raw: RawColumn, where: str, first_row: int) -> Array | None:
    """Times of a column in s, missing ones as NaN; None where its first is a plain number.

    Durations are as written, dates and clock times since midnight of the first day, in the first
    one's time zone. Raises BadLog naming the row of the first cell that is not of its kind.
    """
    if raw.dtype.kind == "m":
        return _spans(raw)
    if raw.dtype.kind == "M":
        moments = raw.astype("datetime64[ns]")
        valid = moments[~np.isnat(moments)]
        return _spans(moments - valid[0].astype("datetime64[D]")) if valid.size else None
    if raw.dtype.kind not in "OUS":
        return None
    first = next((value for value in raw if not _is_empty(value)), None)
    if not isinstance(first, datetime | date | time | timedelta) and not (
        isinstance(first, str) and is_time(first.strip())
    ):
        return None
    out = np.full(len(raw), np.nan)
    begun: date | None = None
    zone: float | None = None
    for row, value in enumerate(raw):
        if _is_empty(value):
            continue
        read = _moment(value)
        if read is None:
            raise BadLog(
                f"{where}, row {first_row + row}: {str(value)[:40]!r} is no time as the first cell"
                f" is ({str(first)[:40]!r}); correct it or leave the field empty"
            )
        day, out[row], east = read
        begun, zone = begun or day, east if zone is None else zone
        out[row] -= east - zone
        if day is not None and begun is not None:
            out[row] += (day - begun).days * _DAY
    return out if begun is not None else _over_midnight(out, first)


def with_one_clock(table: Table, rows: Sequence[Sequence[str]]) -> Table:
    """The table with one clock where columns beside each other hold its parts: whole seconds and
    the nanoseconds beyond them, as a message's stamp does; or date, time and milliseconds. The
    first has all of it then, the others none.

    rows: the first of them, as text.
    """
    cells = list(zip(*rows, strict=False))
    for k in range(len(cells) - 1):
        if all(map(_day, cells[k])) and all(map(_MOMENT.fullmatch, cells[k + 1])):
            return _with_dates(table, k, cells)
        if not all(one.isdigit() for pair in cells[k : k + 2] for one in pair):
            continue
        if max(map(int, cells[k + 1])) <= _MILLI / _NANO or len(set(cells[k + 1])) == 1:
            continue
        whole, part = (np.asarray(table.fetch(at), dtype=np.float64) for at in (k, k + 1))
        if _counts_seconds(whole, part):
            return _joined(table, k, 2, whole + _NANO * part, "seconds and nanoseconds")
    return table


def _with_dates(table: Table, at: int, cells: Sequence[Sequence[str]]) -> Table:
    """The table with the clock of its dates, times and, where a column holds them, milliseconds."""
    beyond = cells[at + 2] if at + 2 < len(cells) else ("",)
    parted = all(one.isdigit() and int(one) < _MILLIS for one in beyond)
    parted &= not any("." in one or "," in one for one in cells[at + 1]) and len(set(beyond)) > 1
    pairs = zip(*(table.fetch(k) for k in (at, at + 1)), strict=True)
    texts = [f"{day} {time}" if day and time else None for day, time in pairs]
    t = None
    with suppress(BadLog):  # of a row that is no time
        t = seconds(np.array(texts, dtype=object), "", 0)
    if t is None or not parted:
        return table if t is None else _joined(table, at, 2, t, "date and time")
    t = t + _MILLI * np.asarray(table.fetch(at + 2), dtype=np.float64)
    return _joined(table, at, 3, t, "date, time and milliseconds")


def _counts_seconds(whole: Array, part: Array) -> bool:
    """Whether whole numbers go up by a second each time that parts of it begin again."""
    if not (np.all(np.isfinite(whole)) and np.all(np.isfinite(part))):
        return False
    step, back = np.diff(whole), np.diff(part) < 0.0
    inside = part.max() < 1.0 / _NANO and part.max() > _MILLI / _NANO and part.min() >= 0.0
    return bool(
        inside and np.any(step > 0.0) and np.all(step >= 0.0) and np.all(step[back] > 0.0)
        and np.all(np.diff(whole + _NANO * part) >= 0.0)
    )  # fmt: skip


def _joined(table: Table, at: int, count: int, seconds: Array, of: str) -> Table:
    """The table with these seconds in one column, and nothing in those behind it."""
    own = {at: seconds, **dict.fromkeys(range(at + 1, at + count), np.zeros(len(seconds)))}
    said = f"columns {at} to {at + count - 1} (from 0), {of}, are one clock, the first"
    units = [*(table.units or ("",) * len(table.names))]
    units[at : at + count] = ["s", *[""] * (count - 1)]
    fetch = table.fetch
    return replace(
        table,
        fetch=lambda k: own[k] if k in own else fetch(k),
        units=tuple(units),
        remarks=(*table.remarks, said),
    )


def _is_empty(value: object) -> bool:
    return value is None or value == "" or value != value


def _spans(raw: RawColumn) -> Array:
    out = raw.astype("timedelta64[ns]").astype(np.float64) * 1e-9
    return np.where(np.isnat(raw), np.nan, out)


def _moment(value: Any) -> tuple[date | None, float, float] | None:
    """Day, if any, seconds of it, and by how many the time zone is ahead of UTC; None where the
    cell is no time."""
    match value:
        case datetime():
            east = value.utcoffset() or timedelta()
            return value.date(), _of_day(value.time()), east.total_seconds()
        case time():
            return None, _of_day(value), 0.0
        case timedelta():
            return None, value.total_seconds(), 0.0
        case str():
            return _text_moment(value.strip())
    return None


def _text_moment(text: str) -> tuple[date | None, float, float] | None:
    if found := _DURATION.fullmatch(text):
        return None, float(found[1].replace(",", ".")) * _PER_SECOND[found[2]], 0.0
    found = _MOMENT.fullmatch(text)
    if found is None:
        return None
    day, hours, minutes, secs, part, side, zone_hours, zone_minutes = found.groups()
    east = 3600.0 * int(zone_hours or 0) + 60.0 * int(zone_minutes or 0)
    total = 3600.0 * int(hours) + 60.0 * int(minutes) + float(f"{secs or 0}.{part or 0}")
    return (_day(day) if day else None), total, -east if side == "-" else east


def _day(text: str) -> date | None:
    for form in _DATES:
        with suppress(ValueError):
            return datetime.strptime(text, form).date()
    return None


def _of_day(moment: time) -> float:
    return (
        3600.0 * moment.hour + 60.0 * moment.minute + moment.second + 1e-6 * moment.microsecond
    )  # fmt: skip


def _over_midnight(times: Array, first: object) -> Array:
    """Clock times without a date that begin anew at midnight, going on."""
    if isinstance(first, timedelta) or (isinstance(first, str) and _DURATION.fullmatch(first)):
        return times
    days = np.cumsum(np.diff(times, prepend=times[:1]) < -0.5 * _DAY)
    return times + _DAY * days


def summed(x: Array, step: Array | None = None) -> Array:
    """The sum of x (n,) up to each row, from 0 on: of steps, or of a speed by the rule of trapezia
    where `step` (n,) is the time since the row before. What is missing is taken from its
    neighbours; a time that goes back counts as none."""
    known, rows = np.isfinite(x), np.arange(len(x))
    whole = np.interp(rows, rows[known], x[known]) if np.any(known) else x
    if step is not None:
        forward = np.where(np.isfinite(step), np.maximum(step, 0.0), 0.0)
        whole = forward * 0.5 * (whole + np.concatenate([whole[:1], whole[:-1]]))
    return frozen(np.cumsum(whole) - whole[0])


MOST_FAULTY = 0.01  # of the rows: more is a file that is laid out otherwise
MOST_STARTS = 50  # of a clock in one file
_MOST_OF_A_TICK = 1.01  # that a rounded stamp is off
_MOST_DIGITS = 15
_OF_ROUNDING = 8.0  # times the step between two numbers, that differences of times are rounded to
_TOGETHER, _FEWEST_AT_A_TIME = 0.25, 1.5  # period below which rows came together; such rows
_ROWS_OF_A_MEAN = 50  # over which the jitter of stamps is gone, and a lost row is not


@dataclass(frozen=True, eq=False)
class Numbers:
    """A column's cells as numbers (n,), NaN where a cell is empty or text; where it is text, and
    the first of these."""

    values: Array
    is_text: BoolArray
    first_text: str = ""

    @property
    def few(self) -> bool:
        """Whether the text is a few cells' among numbers, and no header or unit."""
        return not self.is_text[0] and are_few(int(np.sum(self.is_text)), len(self.values))


def are_few(faulty: int, rows: int) -> bool:
    """Whether so many faulty rows of all may be left out."""
    return faulty <= MOST_FAULTY * rows


def numbers_in(raw: NDArray[Any]) -> Numbers:
    """The numbers in a column of numbers or of cells; those of a column of text as far as it takes
    to see that it is one."""
    if raw.dtype.kind in "fiub":
        return Numbers(np.asarray(raw, dtype=np.float64), np.zeros(len(raw), dtype=bool))
    values, is_text, first, faulty = np.full(len(raw), np.nan), np.zeros(len(raw), bool), "", 0
    for k, cell in enumerate(raw.tolist()):
        try:
            values[k] = number_of(cell)
        except (TypeError, ValueError):
            is_text[k] = True
            first, faulty = first or " ".join(str(text_of(cell)).split()), faulty + 1
            if not are_few(faulty, len(raw)):
                break
    return Numbers(values, is_text, first)


def sound_rows(t: Array, others: Sequence[Array]) -> tuple[NDArray[Any], tuple[str, ...]]:
    """Which rows are samples, by number, in the order of time, and what is said of the others: rows
    without a time or with nothing else, where they are few, and rows that are the one before once
    more, in time and all signals. others: the columns beside the time."""
    timed: BoolArray = np.isfinite(t)
    number, remarks = np.arange(len(t)), list[str]()
    untimed = int(np.sum(~timed))
    if not are_few(untimed, len(t)):
        return number, ()
    if len(t) > 1 and np.all(np.diff(t[timed]) < 0.0):
        number = number[::-1]
        remarks.append("rows stand from the last to the first: read the other way round")
    if untimed:
        remarks.append(f"{rows_of(untimed)} without a time left out")
    bare = np.all([~np.isfinite(x) for x in others], axis=0) & timed
    if np.any(bare) and are_few(int(np.sum(bare)), len(t)):
        remarks.append(f"{rows_of(int(np.sum(bare)))} with nothing but a time left out")
        timed &= ~bare
    twice = np.zeros(len(t), dtype=bool)
    if np.any(t[1:] == t[:-1]):
        same = [np.equal(x[1:], x[:-1]) | (np.isnan(x[1:]) & np.isnan(x[:-1])) for x in others]
        twice[1:] = np.all([t[1:] == t[:-1], *same], axis=0)
    if repeated := int(np.sum(twice)):
        remarks.append(f"{rows_of(repeated)} that repeat the row before left out")
    return number[(timed & ~twice)[number]], tuple(remarks)


def even_stamps(t: Array) -> tuple[Array, str]:
    """The times (n,) of even rows whose stamps are rounded to whole ticks, or of which some came
    late, together with the next, or all several at a time, as who reads a port finds them in its
    buffer, and what is said of that; other times as they are.

    Rows are even where their stamps follow the count of the rows: but for a tick; or without a
    step, as a row that was lost would shift all behind it by a period, or by those of a buffer.
    """
    step = np.diff(t)
    if len(t) < SHORTEST_LOG or not np.all(step >= 0.0):
        return t, ""
    same, line = step == 0.0, _line(t)
    period = float(line[1] - line[0])
    together = step < _TOGETHER * period
    at_a_time = len(t) / (1 + int(np.sum(~together)))
    # As no sampler is.
    uneven = np.any(together) and float(np.ptp(step[together])) > MOST_FAULTY * period
    buffered = uneven and _FEWEST_AT_A_TIME < at_a_time < _ROWS_OF_A_MEAN
    if not buffered and not np.any(same):
        return _without_rounding(t, step)
    if not buffered and np.mean(same) >= OF_ACCOUNT:
        return t, ""
    blocks = max(1, len(t) // _ROWS_OF_A_MEAN)
    late = [float(np.mean(one)) for one in np.array_split(t - line, blocks)]
    if np.ptp(late) > period * (at_a_time if buffered else HALF):
        waited = int(np.argmin(together))  # rows that were in the buffer before it was first read
        rest, said = even_stamps(t[waited:]) if waited > SHORTEST_LOG else (t, "")
        before = np.arange(-waited, 0) * (rest[1] - rest[0]) + rest[0]
        told = f"{rows_of(waited)} that waited before the first are put before it; {said}"
        return (np.concatenate([before, rest]), told) if said else (t, "")
    if buffered:
        return line, f"rows stamped about {at_a_time:.0f} at a time, late: taken as even rows"
    said = f"{rows_of(int(np.sum(same)))} with the time of the row before and other values"
    return line, f"{said}: stamped late, taken as even rows"


def _without_rounding(t: Array, step: Array) -> tuple[Array, str]:
    """As `even_stamps`, of stamps in whole ticks that are off even rows by one at most."""
    digits = min(int(-np.log10(_OF_ROUNDING * np.spacing(np.max(np.abs(t))))), _MOST_DIGITS)
    tick, usual = resolution(np.round(step, digits)), float(np.median(step))
    pieces = np.split(t, np.flatnonzero(step > LONGEST_GAP * usual) + 1)
    lines = [_line(one) if len(one) > 2 else one for one in pieces]
    off = max(float(np.ptp(one - line)) for one, line in zip(pieces, lines, strict=True))
    lost = tick > HALF * usual and are_few(int(np.sum(step > HALF * tick + usual)), len(step))
    if not 0.0 < off < _MOST_OF_A_TICK * tick or not MOST_FAULTY * usual < tick <= usual or lost:
        return t, ""
    return np.concatenate(lines), f"stamps in whole ticks of {tick:.3g}: taken as even rows"


def _line(t: Array) -> Array:
    """Even times as near to these (n,) as can be."""
    row = np.arange(len(t))
    period, start = np.polyfit(row, t - t[0], 1)
    return np.asarray(t[0] + start + period * row)


def rows_of(count: int) -> str:
    """So many rows in words."""
    return "a row" if count == 1 else f"{count} rows"


def told_of_starts(t: Array, parts: Sequence[slice]) -> str:
    """What the clock does between the parts that `stretches` made of it."""
    h = float(np.median(np.diff(t)))
    back = np.array([t[one.start - 1] - t[one.start] for one in parts if one.start])
    if any(abs(t[one.start] - t[0]) <= LONGEST_GAP * h for one in parts[1:]):
        return f"clock begins again: {len(parts)} runs"
    said = f"clock goes back by {np.max(back):.4g} s{told_of_hours(back, h)}"
    return f"{said}: {len(parts)} runs"


def stretches(t: Array) -> list[slice]:
    """The runs of a clock (n,) that begins again: from each start to the next, those long enough
    for a log; the whole of one that does not, or too often to be the starts of a logger."""
    starts = np.flatnonzero(t[1:] < t[:-1]) + 1
    if not 0 < len(starts) < MOST_STARTS:
        return [slice(0, len(t))]
    borders = [0, *starts.tolist(), len(t)]
    long = [slice(a, b) for a, b in pairwise(borders) if b - a >= SHORTEST_LOG]
    kept = sum(one.stop - one.start for one in long)
    return long if long and are_few(len(t) - kept, len(t)) else [slice(0, len(t))]


def at_rows(signals: Mapping[str, Array], rows: BoolArray | slice) -> dict[str, Array]:
    """The signals at these rows."""
    return {name: x[rows] for name, x in signals.items()}
