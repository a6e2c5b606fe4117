"""Text made the plain table that it holds, where its lines hold more than numbers and delimiters.

A label or a unit around a number ("angle: 3.2", "3.2deg"), the time at which a serial monitor got a
line, vectors in brackets, documents of keys as `ros2 topic echo` prints them, a sign between
thousands, hexadecimal numbers: labels and units go into the header, numbers into the cells.
"""

import re
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

from identification.signals.check import SHORTEST_LOG
from workbench.cards.written_units import written_unit
from workbench.logs.layout import is_number
from workbench.logs.times import is_time

_FIRST_LETTERS = 64 * 1024  # by which a text is known
_LINES_SEEN, _FEWEST_LINES = 40, 5
_ABOVE = 3  # lines above the numbers at most, of which the last may be a header
_MOST_TURNED = 50_000_000  # letters of a text whose lines may be signals
_ARRAY = re.compile(r"array\('\w', (\[[^\]]*\])\)")  # as Python prints one
_BROKEN_NAME = re.compile(r'(?:^|(?<=[;,\t\n]))"[^";,\t\n]*\n[^";,\t]*"(?=[;,\t\r\n])')  # in lines
_NAME_ABOVE = re.compile(r"^# name: (\w+)[ \t]*\r?$", re.MULTILINE)
_SEPARATORS = (",", ";", "\t", "|")
_SAYS_THE_DELIMITER = re.compile(r"\Asep=.(?=\r?\n)", re.I)
_GOT_AT = re.compile(r"^((?:\d{4}-\d\d-\d\d )?\d\d:\d\d:\d\d[.,]\d{1,6}) -> ", re.MULTILINE)
_CELL = re.compile(
    r"(?P<label>[^\d\s:=][^:=]*[:=])?\s*"
    r"(?P<number>[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(?P<unit>[^\d\s.,+-][^\s,;]*)?"
)
_TAG = re.compile(r"^([^\W\d]\w*:?)[ \t]+(?=[^\s,;|]+[ \t]*[,;|])", re.MULTILINE)
_NEXT_LABEL = re.compile(r"(?<=\S)[ \t]+(?=[^\W\d][^\s:=,;|]*[ \t]*[:=][ \t]*[+-]?\.?\d)")
_NEXT_WORDS = re.compile(r"(?<=\d)[ \t]+(?=(?P<words>[^\W\d][^\d:=,;|]*)[:=][ \t]*[+-]?\.?\d)")
_BRACES = re.compile(r"[^\s,;|]*\{|[}'\"]")
_VECTOR = re.compile(r'(?<!\w)"?[\[(]([^\[\](){}"]*)[\])]"?')
_BETWEEN = re.compile(r"[\s,;]+")
_NEXT_DOCUMENT = re.compile(r"^---[ \t]*\r?$", re.MULTILINE)
_POINT_OF_NAN = re.compile(r"\.(?=nan|inf)", re.I)
_KEY_OF_DOCUMENT = re.compile(r"([^\W\d][^:]*):(?:\s+|$)")
_HEXADECIMAL = re.compile(r"(?<![^\s,;|])0[xX]([0-9a-fA-F]{1,8})(?![^\s,;|])")
_OF_HEXADECIMALS = re.compile(r"^[\d+-].*(?<![^\s,;|])0[xX].*$", re.MULTILINE)
_CELLS = r'(?<=[;\t|"\n]){}(?=[;\t|"\r\n])'  # whole ones; between commas in quotes alone
_IN_THOUSANDS = r"[+-]?\d{1,3}(?:(?P<sign>[.,'\u2019\u00a0\u202f])\d{3})+(?:(?P<point>[.,])\d+)?"
_GROUPED = re.compile(_CELLS.format(_IN_THOUSANDS))


def as_table(text: str) -> str:
    """The text as a plain table where its lines hold more than numbers; else as it is."""
    text = _BROKEN_NAME.sub(lambda one: " ".join(one[0].split()), text)
    text = _in_decimals(_without_thousands(_SAYS_THE_DELIMITER.sub("", text)))
    text = _without_monitor(_in_columns(_ARRAY.sub(r"\1", text)))
    if len(_NEXT_DOCUMENT.findall(text[:_FIRST_LETTERS])) > _FEWEST_LINES:
        return _of_documents(text)
    if len(_NAME_ABOVE.findall(text)) > 1:
        return _of_variables(text)
    return _labelled(_parted(_flat(_without_tag(text))))


def _without_tag(text: str) -> str:
    """The text without the word with which a logger begins each row: "TRACE 0,1.2"."""
    tags = {found[1] if (found := _TAG.match(line)) else "" for line in _seen(text)}
    one_tag = len(tags) == 1 and "" not in tags
    return _TAG.sub(lambda one: "" if one[1] in tags else one[0], text) if one_tag else text


def _seen(text: str) -> list[str]:
    """The lines by which it is known what a text is: the last whole ones of its beginning."""
    lines = text[:_FIRST_LETTERS].splitlines()[: -1 if len(text) > _FIRST_LETTERS else None]
    return [line for line in lines if line.strip()][-_LINES_SEEN:]


def _in_columns(text: str) -> str:
    """The text with a column for each signal where a few long lines have one each, its name first
    or none."""
    lines = [line for line in text.splitlines() if line.strip()] if len(text) < _MOST_TURNED else []
    if not 1 < len(lines) < SHORTEST_LOG or len(lines[0]) < 2 * SHORTEST_LOG:
        return text
    sign = max((*_SEPARATORS, " "), key=lambda one: min(line.count(one) for line in lines))
    rows = [line.split() if sign == " " else _split(line, sign) for line in lines]
    long = min(map(len, rows)) >= SHORTEST_LOG and max(map(len, rows)) == min(map(len, rows))
    if not long or not all(is_number(one) for row in rows for one in row[1:]):
        return text
    return "\n".join(map((sign if sign != " " else "\t").join, zip(*rows, strict=True))) + "\n"


def _in_decimals(text: str) -> str:
    """The text with decimal numbers for hexadecimal ones in rows of numbers."""
    lines = _seen(text)
    if not lines or not all(map(_OF_HEXADECIMALS.search, lines)):
        return text

    def decimal(line: re.Match[str]) -> str:
        return _HEXADECIMAL.sub(lambda one: str(int(one[1], 16)), line[0])

    return _OF_HEXADECIMALS.sub(decimal, text)


def _without_thousands(text: str) -> str:
    """The text without the sign between thousands, where numbers with it have a decimal sign too,
    and no number has it for one."""
    beginning = "\n" + text[:_FIRST_LETTERS]
    found = list(_GROUPED.finditer(beginning))
    signs = {one["sign"] for one in found if one["point"] not in (None, one["sign"])}
    if len(signs) != 1:
        return text
    sign = re.escape(signs.pop())
    every = re.findall(_CELLS.format(rf"[+-]?\d+(?:{sign}\d+)+(?:[.,]\d+)?"), beginning)
    own = re.compile(_CELLS.format(rf"[+-]?\d{{1,3}}(?:{sign}\d{{3}})+(?:[.,]\d+)?"))
    if len(every) > len(own.findall(beginning)):
        return text
    return own.sub(lambda one: re.sub(rf"{sign}(?=\d{{3}})", "", one[0]), "\n" + text)[1:]


def _without_monitor(text: str) -> str:
    """The text without the time at which a serial monitor got each line; with it as a column where
    the machine has no clock."""
    lines = _seen(text)
    if sum(bool(_GOT_AT.match(line)) for line in lines) <= len(lines) / 2:
        return text
    rest = [_GOT_AT.sub("", line) for line in lines]
    sign = next((one for one in _SEPARATORS if one in rest[-1]), ",")
    own = _has_clock([_split(line, sign) for line in rest])
    return _GOT_AT.sub("" if own else rf"\1{sign}", text)


def _has_clock(rows: Sequence[Sequence[str]]) -> bool:
    """Whether a column goes up from each line to the next: the machine's own time, beside which
    that of the monitor is late."""
    for cells in zip(*rows, strict=False):
        numbers = [found["number"] for one in cells if (found := _CELL.fullmatch(one))]
        x = [float(one) for one in numbers]
        if len(x) == len(rows) > _FEWEST_LINES and all(a < b for a, b in pairwise(x)):
            return True
    return False


def _of_documents(text: str) -> str:
    """A row of each document of keys, a column each number by its path: "position[0]"."""
    rows = [dict(_leaves(one.splitlines())) for one in _NEXT_DOCUMENT.split(text)]
    names = list(next(filter(None, rows), {}))
    body = [",".join(row.get(name, "") for name in names) for row in rows if row]
    return "\n".join([",".join(names), *body, ""])


def _of_variables(text: str) -> str:
    """A column of each variable that stands below its name, those as long as the first."""
    _, *parts = _NAME_ABOVE.split(text)
    columns = dict[str, list[str]]()
    for name, body in zip(parts[::2], parts[1::2], strict=True):
        rows = [line.split() for line in body.splitlines() if line.strip() and line[0] != "#"]
        for k, cells in enumerate(zip(*rows, strict=False)):
            columns[f"{name}[{k}]" if len(rows[0]) > 1 else name] = list(cells)
    most = max(map(len, columns.values()), default=0)
    long = {name: cells for name, cells in columns.items() if len(cells) == most}
    return "\n".join([",".join(long), *map(",".join, zip(*long.values(), strict=True)), ""])


def _leaves(lines: Sequence[str]) -> Iterator[tuple[str, str]]:
    """The numbers below the keys of a document, by their path."""
    path, counts = list[tuple[int, str]](), dict[str, int]()
    for line in lines:
        indent, body = len(line) - len(line.lstrip()), line.strip()
        entry = body.startswith("- ")
        while path and path[-1][0] >= indent + entry:
            path.pop()
        if entry:
            place = _joined(path)
            counts[place] = counts.get(place, -1) + 1
            path.append((indent + 1, f"[{counts[place]}]"))
            indent, body = indent + 2, body[2:].lstrip()
        if key := _KEY_OF_DOCUMENT.match(body):
            path.append((indent, key[1]))
            body = body[key.end() :]
        inline = body.startswith("[") and body.endswith("]")
        for k, cell in enumerate(_BETWEEN.split(body[1:-1].strip()) if inline else (body,)):
            number = _POINT_OF_NAN.sub("", cell)
            if number and is_number(number):
                yield _joined(path) + (f"[{k}]" if inline else ""), number


def _joined(path: Sequence[tuple[int, str]]) -> str:
    return "".join(key if key[0] == "[" else f".{key}" for _, key in path).removeprefix(".")


def _flat(text: str) -> str:
    """The text with a cell for each number of the vectors in brackets that each line holds."""
    lines = _seen(text)
    sizes = {tuple(map(_size, _VECTOR.findall(line))) for line in lines}
    if len(lines) <= _FEWEST_LINES or len(sizes) != 1 or not any(own := sizes.pop()):
        return text
    if 0 in own:  # a list of texts, as of names: none
        return _flat(_VECTOR.sub(lambda one: one[0] if _size(one[1]) else "", text))
    bare = _VECTOR.sub("0", lines[-1])
    mark = next((one for one in _SEPARATORS if one in bare), "," if bare.strip() == "0" else " ")

    def row(line: str) -> str:
        return _VECTOR.sub(lambda one: mark.join(_BETWEEN.split(one[1].strip())), line)

    above, *rest = text.splitlines()
    names, cells = above.split(mark), _VECTOR.sub("()", lines[-1]).split(mark)
    if len(names) != len(cells) or _VECTOR.search(above):
        return "\n".join(map(row, (above, *rest)))
    left = iter(own)
    every = (
        [f"{name}[{k}]" for k in range(next(left))] if "()" in cell else [name]
        for name, cell in zip(names, cells, strict=True)
    )
    return "\n".join([mark.join(one for several in every for one in several), *map(row, rest)])


def _size(vector: str) -> int:
    """How many numbers a text holds; 0 where it holds anything else."""
    parts = _BETWEEN.split(vector.strip())
    return len(parts) if all(parts) and all(map(is_number, parts)) else 0


def _parted(text: str) -> str:
    """The text with commas between its labels, and without the braces around them."""
    if (lines := _seen(text)) and all("{" in line for line in lines):
        text = _BRACES.sub("", text)
    lines = _seen(text)
    apart = any(sign in line for line in lines for sign in _SEPARATORS)
    if not lines or apart or not all(map(_NEXT_LABEL.search, lines)):
        return text
    units = (found["words"].split()[0] for line in lines for found in _NEXT_WORDS.finditer(line))
    words = all(map(_NEXT_WORDS.search, lines)) and not any(map(written_unit, units))
    return (_NEXT_WORDS if words else _NEXT_LABEL).sub(", ", text)


class _Part(NamedTuple):
    """What stands around the numbers of a column; plain: nothing does."""

    label: str
    unit: str
    plain: bool

    def header(self, name: str) -> str:
        """The column's header: its own name, else its label, with the unit."""
        own = name.removesuffix(": None") or self.label.rstrip(" :=")
        return f"{own} [{self.unit}]" if self.unit else own


def _labelled(text: str) -> str:
    """The text with the labels and units of its cells in the header."""
    filled = _seen(text)
    for delimiter in _SEPARATORS:
        rows = [_split(line, delimiter) for line in filled]
        if len(rows) > _FEWEST_LINES and (
            parts := _parts(rows[-max(_FEWEST_LINES, len(rows) - _ABOVE) :])
        ):
            return _in_header(text, delimiter, parts)
    return text


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


def _in_header(text: str, delimiter: str, parts: Sequence[_Part]) -> str:
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
    return [cell.strip().strip('"').strip() for cell in line.split(delimiter)]
