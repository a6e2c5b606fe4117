"""The clock of a file: times written as durations, clock times or dates, as seconds; and cells that
are no numbers among a column's."""

import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import date, datetime, time, timedelta
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.arrays import Array, BoolArray
from identification.errors import BadLog
from identification.signals.stamps import are_few
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
