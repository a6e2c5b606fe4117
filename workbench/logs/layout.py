"""Where the header and the data of a table lie, below whatever a program writes before them.

Scopes of PLCs and drives, data loggers and spreadsheets put lines of their own above the names:
"key;value" lines, comments, a row of units or of types. A line is a list of its fields here.
"""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from identification.columns.header import NUMBER, says_period, words_of
from identification.thresholds import HALF
from workbench.cards.written_units import written_unit
from workbench.logs.times import is_time

_IN_A_ROW = 3  # lines of data that show where it begins
_DATA_SHARE = 0.5  # of a line's fields above which numbers and times make it a line of data
_UNITS_SHARE, _FEWEST_UNITS = 0.5, 2  # of a line's fields, known as units in one of units
_TYPE_OR_UNIT = re.compile(
    r"[\[(<].{0,20}[\])>]|[mkM]?(?:W|g|Hz)|h|[CF]|(?:inc|U)/(?:s|min)(?:\^?2|²)?|"
    r"(?:L?REAL|FLOAT|DOUBLE|U?[SDL]?INT|BOOL|BIT|BYTE|D?WORD|TIME)(?:8|16|32|64)?|"
    r"double|float|int(?:8|16|32|64)?"
)
_RATES = {"rate", "samplerate", "abtastrate", "fs"}
_DECIMAL = re.compile(r"[+-]?\d*[.,]\d+([eE][+-]?\d+)?")
_COMMENT = re.compile(r"\s*(?:%+|//|!|;)\s*")  # of programs whose comments begin otherwise
_NO_COLUMN = ("", "comment", "comments", "remark", "remarks", "kommentar")  # behind the names
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
            line = _uncommented(line, width)
            fitted = [*line, ""] if len(line) == width - 1 and not ends else line
            several = len(fitted) == width + 1 and not any(map(is_number, fitted))
            if all(one.casefold() in _NO_COLUMN for one in fitted[width:]) or several:
                fitted = fitted[:width]
            if not 1 < len(fitted) <= width or _is_data(fitted, width):
                break
            block.insert(0, fitted)
        scope = _scope(block, width)
        if scope is not None:
            return Layout(scope[0], first, scope[1])
        whole = [line for line in block if len(line) == width]
        if whole and whole[-1] is block[-1]:
            names, units = _names_and_units(whole)
            units = units or next(filter(None, map(_keyed_units, whole[:-1])), ())
    noted = [one for k, one in (comments or {}).items() if k < first and len(one) == width]
    if noted and not names:
        names, units = _names_and_units(noted)
        names = () if all(map(is_number, names)) else names
    if any(map(_DECIMAL.fullmatch, names[1:])) or (len(names) == 2 and is_number(names[0])):
        # A row of data, beside a key; a time before words is that at which they were written.
        return Layout((), first)
    return Layout(names, first, units=units)


def _names_and_units(whole: list[Sequence[str]]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names of the columns, and their units, of lines as wide as the data, right above these."""
    whole, units = list(whole), tuple[str, ...]()
    while len(whole) > 1 and (is_mark(whole[-1], whole[-2]) or _is_units(whole[-1])):
        below = whole.pop()
        units = tuple(_bare(one) for one in below) if _is_units(below) else units
        whole[-1] = [
            own or (one if units else "") for own, one in zip(whole[-1], below, strict=True)
        ]
    names, over = whole[-1], whole[-2] if len(whole) > 1 else ()
    if over and all(names) and len(set(names)) < len(names) and over[0] and not all(over):
        plotted = [one.lower() for one in names] == ["x", "y"] * (len(names) // 2)
        joined, group = list[str](), ""
        for k, own in enumerate(names):
            group = over[k] or group  # written once, above the first of its columns
            joined.append(f"{group} {own}" if not plotted else group if k % 2 else own)
        names = joined
    return tuple(names), units


def _uncommented(line: Sequence[str], width: int) -> Sequence[str]:
    """As many names as the data have fields behind a sign of comments; any other line as it is."""
    signed = _COMMENT.match(line[0])
    bare = [line[0][signed.end() :], *line[1:]] if signed else line
    several = bare[0].split() if len(bare) == 1 else [one for one in bare[:1] if one] + [*bare[1:]]
    return several if signed and len(several) == width else line


def _keyed_units(line: Sequence[str]) -> tuple[str, ...]:
    """The units of a line that begins with a key of that name, none of any other."""
    own = tuple(map(_bare, line[1:]))
    known = all(written_unit(one) for one in own if one) and any(own)
    return ("", *own) if known and "unit" in line[0].casefold() else ()


def period_above(lines: Sequence[Sequence[str]]) -> tuple[str, float, str] | None:
    """The time from row to row that one of these lines above the data gives, a key with a number:
    the key, the number and its unit (empty: not given); None where none does."""
    for key, *rest in filter(None, lines):
        number, _, unit = " ".join(rest[:2]).strip().partition(" ")
        rate = bool(_RATES & set(words_of(key))) and not rest[1:]
        if not (rate or says_period(key)) or not NUMBER.fullmatch(number):
            continue
        value, found = float(number.replace(",", ".")), written_unit(unit)
        if rate and value > 0.0 and unit in ("", "Hz", "kHz"):
            return f"period by {key}", (1e-3 if unit == "kHz" else 1.0) / value, "s"
        if not rate and value > 0.0:
            return key, value, found.card if found and found.quantity == "time" else ""
    return None


def is_number(field: str) -> bool:
    """Whether the field is empty or a number, with a point or a comma."""
    return not field or NUMBER.fullmatch(field) is not None


def _first_data(lines: Sequence[Sequence[str]], width: int) -> int | None:
    filled = [k for k, line in enumerate(lines) if line]
    begins = Counter(lines[k][0] for k in filled[len(filled) // 2 :])
    word = next((one for one, many in begins.items() if many > HALF * begins.total()), "")
    for at in range(len(filled)):
        if all(_is_data(lines[j], width, word) for j in filled[at : at + _IN_A_ROW]):
            while at and len(lines[filled[at - 1]]) == width and not any(lines[filled[at - 1]]):
                at -= 1  # a row of empty fields is one of missing samples
            return filled[at]
    return None


def _is_data(line: Sequence[str], width: int, word: str = "") -> bool:
    """Whether a line holds numbers and times behind a number, a time, or a word that most have."""
    if len(line) != width:
        return False
    filled = [field for field in line if field]
    known = sum(is_number(field) or is_time(field) for field in filled)
    first = is_number(line[0]) or is_time(line[0]) or line[0] == word  # others have a key
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
