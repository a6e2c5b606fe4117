"""Lines of text whose cells hold more than a number: a label before it ("angle: 3.2"), its unit
behind it ("3.2deg"), or before the line the time at which a serial monitor got it.

They are rewritten as a plain table: labels and units into the header, numbers into the cells.
"""

import re
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

from workbench.cards.headers import written_unit
from workbench.logs.layout import is_number
from workbench.logs.times import is_time

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
