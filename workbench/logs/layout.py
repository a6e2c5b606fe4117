"""Where the header and the data of a table lie, below whatever a program writes before them.

Scopes of PLCs and drives, data loggers and spreadsheets put lines of their own above the names:
"key;value" lines, comments, a row of units or of types. A line is a list of its fields here.

Lines of text whose cells hold more than a number (a label before it, "angle: 3.2", its unit behind
it, "3.2deg", or before the line the time at which a serial monitor got it) are rewritten as a plain
table: labels and units into the header, numbers into the cells.
"""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

from workbench.cards.headers import written_unit
from workbench.logs.times import is_time

NUMBER = re.compile(r"[+-]?(\d+[.,]?\d*|[.,]\d+)([eE][+-]?\d+)?|[+-]?inf(inity)?|nan", re.I)

_IN_A_ROW = 3  # lines of data that show where it begins
_DATA_SHARE = 0.5  # of a line's fields above which numbers and times make it a line of data
_UNITS_SHARE, _FEWEST_UNITS = 0.5, 2  # of a line's fields, known as units in one of units
_TYPE_OR_UNIT = re.compile(
    r"[\[(<].{0,20}[\])>]|[mkM]?(?:W|g|Hz)|h|[CF]|(?:inc|U)/(?:s|min)(?:\^?2|²)?|"
    r"(?:L?REAL|FLOAT|DOUBLE|U?[SDL]?INT|BOOL|BIT|BYTE|D?WORD|TIME)(?:8|16|32|64)?|"
    r"double|float|int(?:8|16|32|64)?"
)
_SCOPE_NAME = "name"
_SCOPE_ROWS = 3  # of a block of keys, at least
_SCOPE_TIME = "Time"


@dataclass(frozen=True)
class Layout:
    """Names of the columns, none where nothing above the data names as many; the first line of
    data, from 0; and the units below the names.

    `groups` names the group of each column where several columns are times, each of those that
    follow it.
    """

    names: tuple[str, ...]
    data: int
    groups: tuple[str, ...] = ()
    units: tuple[str, ...] = ()


def find_layout(
    lines: Sequence[Sequence[str]], comments: Mapping[int, Sequence[str]] | None = None
) -> Layout | None:
    """Where header and data lie in these first lines of a file; None where no data are seen.

    Empty lists are lines to be skipped; comments: what they hold behind the sign of a comment. A
    header is the last line of as many fields as the data have, above a row of units or types if
    there is one; or the row "Name" of a block in which each line begins with a key, as TwinCAT's
    Scope writes; or, where no other line stands above the data, the last comment of as many fields.
    """
    # Fields of a line of data: the most frequent number among the last lines.
    counted = Counter(len(line) for line in lines[len(lines) // 2 :] if line)
    width = counted.most_common(1)[0][0] if counted else 0
    first = _first_data(lines, width)
    if first is None:
        return None
    names, units = tuple[str, ...](), tuple[str, ...]()
    if above := [line for line in lines[:first] if line]:
        ends = any(line[-1] for line in lines[first:] if len(line) == width)
        block = list[Sequence[str]]()
        for line in reversed(above):
            fitted = [*line, ""] if len(line) == width - 1 and not ends else line
            fitted = fitted if any(fitted[width:]) else fitted[:width]
            if not 1 < len(fitted) <= width or _is_data(fitted, width):
                break
            block.insert(0, fitted)
        scope = _scope(block, width)
        if scope is not None:
            return Layout(scope[0], first, scope[1])
        whole = [line for line in block if len(line) == width]
        if whole and whole[-1] is block[-1]:
            names, units = _names_and_units(whole)
    elif noted := [one for k, one in (comments or {}).items() if k < first and len(one) == width]:
        names, units = _names_and_units(noted)
        names = () if all(map(is_number, names)) else names
    return Layout(names, first, units=units)


def _names_and_units(whole: list[Sequence[str]]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names of the columns, and their units, of lines as wide as the data, right above these."""
    whole, units = list(whole), tuple[str, ...]()
    while len(whole) > 1 and (is_mark(whole[-1], whole[-2]) or _is_units(whole[-1])):
        below = whole.pop()
        units = tuple(_bare(one) for one in below) if _is_units(below) else units
    names, over = whole[-1], whole[-2] if len(whole) > 1 else ()
    if over and all(names) and len(set(names)) < len(names) and over[0] and not all(over):
        plotted = [one.lower() for one in names] == ["x", "y"] * (len(names) // 2)
        joined, group = list[str](), ""
        for k, own in enumerate(names):
            group = over[k] or group  # written once, above the first of its columns
            joined.append(f"{group} {own}" if not plotted else group if k % 2 else own)
        names = joined
    return tuple(names), units


def is_number(field: str) -> bool:
    """Whether the field is empty or a number, with a point or a comma."""
    return not field or NUMBER.fullmatch(field) is not None


def _first_data(lines: Sequence[Sequence[str]], width: int) -> int | None:
    filled = [k for k, line in enumerate(lines) if line]
    for at in range(len(filled)):
        if all(_is_data(lines[j], width) for j in filled[at : at + _IN_A_ROW]):
            while at and len(lines[filled[at - 1]]) == width and not any(lines[filled[at - 1]]):
                at -= 1  # a row of empty fields is one of missing samples
            return filled[at]
    return None


def _is_data(line: Sequence[str], width: int) -> bool:
    if len(line) != width:
        return False
    filled = [field for field in line if field]
    known = sum(is_number(field) or is_time(field) for field in filled)
    first = is_number(line[0]) or is_time(line[0])  # where other lines have a key
    return first and known > _DATA_SHARE * len(filled)


def _bare(cell: str) -> str:
    """A unit without the brackets around it."""
    return cell.strip().strip("[](){}<>")


def _is_units(line: Sequence[str]) -> bool:
    """Whether a line holds units, or types of the values, and not names."""
    filled = [field for field in line if field]
    others = [one for one in filled if written_unit(_bare(one)) is None]
    known = len(filled) - len(others)
    said = sum(one == "1" or not is_number(one) for one in filled)
    if said and known >= max(_FEWEST_UNITS, _UNITS_SHARE * said):
        return True
    return 2 * len(filled) >= len(line) and all(map(_TYPE_OR_UNIT.fullmatch, others))


def is_mark(line: Sequence[str], above: Sequence[str]) -> bool:
    """Whether a line says only that the values begin, below one that names every column."""
    return all(above) and not any(line[1:])


def _scope(
    block: Sequence[Sequence[str]], width: int
) -> tuple[tuple[str, ...], tuple[str, ...]] | None:
    """Names and groups of a block of keys; None where it is none.

    A key stands at the place of each column of times, the values of the channels behind it.
    """
    rows = [k for k, line in enumerate(block) if line[0].lower() == _SCOPE_NAME]
    if not rows or len(block) - rows[-1] < _SCOPE_ROWS:
        return None
    named = [*block[rows[-1]], *[""] * (width - len(block[rows[-1]]))]
    times = [k for k, field in enumerate(named) if field == named[0]]
    keys = {line[0] for line in block[rows[-1] :]}
    if len(keys) < len(block) - rows[-1] or (len(named) > 1 and 1 in times):
        return None
    names, groups = list[str](), list[str]()
    for k, field in enumerate(named):
        if k in times:
            group = named[k + 1] if k + 1 < width else ""
        names.append(_SCOPE_TIME if k in times else field)
        groups.append(group)
    return tuple(names), tuple(groups) if len(times) > 1 else ()


_GOT_AT = re.compile(r"^((?:\d{4}-\d\d-\d\d )?\d\d:\d\d:\d\d[.,]\d{1,6}) -> ", re.MULTILINE)
_CELL = re.compile(
    r"(?P<label>[^\d\s:=][^:=]*[:=])?\s*"
    r"(?P<number>[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(?P<unit>[^\d\s.,+-][^\s,;]*)?"
)
_SEPARATORS = (",", ";", "\t", "|")
_LINES_SEEN, _FEWEST_LINES = 40, 5  # lines by which such a text is known
_ABOVE = 3  # lines above the numbers at most, of which the last may be a header


class _Part(NamedTuple):
    """What stands around the numbers of a column; plain: nothing does."""

    label: str
    unit: str
    plain: bool

    def header(self, name: str) -> str:
        """The column's header: its own name, else its label, with the unit."""
        own = name.removesuffix(": None") or self.label.rstrip(" :=")
        return f"{own} [{self.unit}]" if self.unit else own


def as_table(text: str) -> str:
    """The text as a plain table where its cells hold more than numbers; else as it is."""
    lines = text[: 64 * 1024].splitlines()[:-1] or text.splitlines()
    if len(_GOT_AT.findall("\n".join(lines))) > len(lines) / 2:
        rest = [_GOT_AT.sub("", line) for line in lines]
        sign = next((one for one in _SEPARATORS if one in rest[-1]), ",")
        own = _has_clock([_split(line, sign) for line in rest[-_LINES_SEEN:]])
        return as_table(_GOT_AT.sub("" if own else rf"\1{sign}", text))
    filled = [line for line in lines if line.strip()]
    for delimiter in _SEPARATORS:
        rows = [_split(line, delimiter) for line in filled[-_LINES_SEEN:]]
        if len(rows) > _FEWEST_LINES and (
            parts := _parts(rows[-max(_FEWEST_LINES, len(rows) - _ABOVE) :])
        ):
            return _rewritten(text, delimiter, parts)
    return text


def _has_clock(rows: Sequence[Sequence[str]]) -> bool:
    """Whether a column goes up from each line to the next: the machine's own time, beside which
    that of the monitor is late."""
    for cells in zip(*rows, strict=False):
        numbers = [found["number"] for one in cells if (found := _CELL.fullmatch(one))]
        x = [float(one) for one in numbers]
        if len(x) == len(rows) > _FEWEST_LINES and all(a < b for a, b in pairwise(x)):
            return True
    return False


def _parts(rows: Sequence[Sequence[str]]) -> list[_Part] | None:
    """What stands around the numbers of each column, the same in all rows; None where something
    else does, or nothing anywhere."""
    width = len(rows[0])
    if width < 2 or any(len(row) != width for row in rows):
        return None
    out = list[_Part]()
    for cells in zip(*rows, strict=True):
        if all(map(is_number, cells)) or all(map(is_time, cells)):
            out.append(_Part("", "", True))
            continue
        found = [_CELL.fullmatch(cell) for cell in cells]
        around = {(one["label"] or "", one["unit"] or "") for one in found if one is not None}
        if len(around) != 1 or not all(found):
            return None
        label, unit = around.pop()
        if not label and written_unit(unit) is None:
            return None
        out.append(_Part(label, unit, False))
    return out if not all(one.plain for one in out) else None


def _rewritten(text: str, delimiter: str, parts: Sequence[_Part]) -> str:
    """The text as a table of numbers, in the header what stood around them."""
    lines = text.splitlines()
    body = [_numbers(line, delimiter, parts) for line in lines]
    data = next(k for k, numbers in enumerate(body) if numbers is not None)
    above = _split(lines[data - 1], delimiter) if data else []
    names = above if len(above) == len(parts) and not any(map(is_number, above)) else ()
    names = names or [""] * len(parts)
    header = [one.header(name) for one, name in zip(parts, names, strict=True)]
    if not all(header):  # a column without any name
        header = [one or str(k) for k, one in enumerate(header)]
    # A line that is laid out otherwise stays as it is.
    rows = [numbers or line for numbers, line in zip(body[data:], lines[data:], strict=True)]
    return "\n".join([delimiter.join(header), *rows, ""])


def _numbers(line: str, delimiter: str, parts: Sequence[_Part]) -> str | None:
    """A line with its numbers alone; None of one that has not these parts around them."""
    bare, cells = list[str](), _split(line, delimiter)
    for cell, one in zip(cells, parts, strict=False):
        found = None if one.plain else _CELL.fullmatch(cell)
        if found is None and not (one.plain and (is_number(cell) or is_time(cell))):
            return None
        bare.append(cell if found is None else found["number"])
    return delimiter.join(bare) if len(cells) == len(parts) else None


def _split(line: str, delimiter: str) -> list[str]:
    return [cell.strip() for cell in line.split(delimiter)]
