"""A file as named columns, which its reader hands out one by one; tables within tables, as JSON and
MATLAB's structs hold them, as vectors by their path.

Tags of a MAT v5 file are followed before it is read: scipy's reader crashes Python on corrupt ones.
"""

import struct
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from design.machine.nearest import nearest
from identification.errors import BadLog
from identification.signals.check import SHORTEST_LOG
from workbench.cards.card_tables import FileSpec

RawColumn = NDArray[Any]

MOST_ROWS = 20_000_000
"""Rows of which a gigabyte of signals can be made."""

BINARY_BYTES = 1_000_000_000
"""Size above which a binary log is not read."""


@dataclass(frozen=True)
class Table:
    """Columns of a file: their names, a function that reads one by number, the first row's number.

    `headed` is false where the file gives no names: then columns go by number alone. `groups`
    names the group of each column where a file holds several, each with a clock of its own; a
    column then also goes by "group/name". `clocks`: the column of a group's clock, where it has a
    name of its own. `units`: what a row below the names says, if there is one. `remarks`: which
    rows were left out, without the name of the file.
    """

    names: tuple[str, ...]
    fetch: Callable[[int], RawColumn]
    first_row: int = 1
    headed: bool = True
    groups: tuple[str, ...] = ()
    clocks: Mapping[str, int] = field(default_factory=dict)
    units: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()

    def column(self, key: str | int, where: str) -> RawColumn:
        """The column named or numbered `key`; raises BadLog with the nearest name."""
        return self.fetch(self.number(key, where))

    def number(self, key: str | int, where: str) -> int:
        """The number from 0 of the column named or numbered `key`; raises BadLog as `column`."""
        count = len(self.names)
        if isinstance(key, int):
            if not 0 <= key < count:
                raise BadLog(
                    f"{where}: no column {key}, there are {count} (0 to {count - 1}, counted "
                    "from 0); correct it in the card"
                )
            return key
        if not self.headed:
            raise BadLog(
                f"{where}: no column {key!r}, the file has no header of its {count} columns; "
                f"name the column by its number (0 to {count - 1}) in the card"
            )
        full = self.full_names()
        found = [k for k, name in enumerate(full) if name == key]
        found = found or [k for k, name in enumerate(self.names) if name == key]
        if not found:
            known = full if len(set(self.groups)) > 1 else self.names
            raise BadLog(f"{where}: no column {key!r}{nearest(key, known)}")
        if len(found) > 1:
            raise BadLog(f"{where}: {self._ambiguous(key, found)}")
        return found[0]

    def beside(self, name: str, value: float, unit: str) -> "Table":
        """The table with a single value as one more column."""
        count, fetch = len(self.names), self.fetch
        return replace(
            self,
            names=(*self.names, name),
            fetch=lambda k: np.array([value]) if k == count else fetch(k),
            groups=(*self.groups, "") if self.groups else (),
            units=(*(self.units or ("",) * count), unit),
        )

    def full_names(self) -> tuple[str, ...]:
        """The names with their groups, where there are groups."""
        if not self.groups:
            return self.names
        pairs = zip(self.groups, self.names, strict=True)
        return tuple(f"{group}/{name}" for group, name in pairs)

    def _ambiguous(self, key: str, found: Sequence[int]) -> str:
        full = [self.full_names()[k] for k in found[:10]]
        if len(set(full)) > 1:
            return (
                f"{len(found)} groups have a column {key!r}; name it with its group in the card:"
                f" {' or '.join(map(repr, full))}"
            )
        which = " and ".join(str(k) for k in found)
        return (
            f"columns {which} (counted from 0) are all named {key!r}; name the right one by its"
            " number in the card"
        )


def of_vectors(names: Sequence[str], read: Callable[[str], RawColumn], spec: FileSpec) -> Table:
    """A table of vectors that are read by name; a scalar stays one value, which the caller may
    spread."""

    def fetch(number: int) -> RawColumn:
        values = np.ravel(read(names[number]))
        return values[spec.skip_rows :] if values.size > 1 else values

    return Table(tuple(names), fetch, 1 + spec.skip_rows)


def of_array(path: Path, values: RawColumn, spec: FileSpec) -> Table:
    """A table of an array's named fields, or of a matrix: a column a signal; one of a few long rows
    has a row a signal."""
    refuse_long(path, max(values.shape, default=0))
    if values.dtype.names:
        return of_vectors(values.dtype.names, values.__getitem__, spec)
    if values.ndim != 2:
        what = repr(spec.rows) if spec.rows else "the array"
        raise BadLog(f"{path}: {what} has the shape {values.shape}, rows and columns needed")
    if values.shape[0] < SHORTEST_LOG <= values.shape[1]:
        values = values.T
    names = tuple(str(number) for number in range(values.shape[1]))
    return Table(names, lambda k: values[spec.skip_rows :, k], 1 + spec.skip_rows, headed=False)


def text_of(cell: object) -> object:
    """What a cell holds, a text as Python's own."""
    if isinstance(cell, bytes):
        return cell.decode("utf-8", "replace")
    return str(cell) if isinstance(cell, str) else cell


def number_of(cell: object) -> float:
    """The number in a cell, NaN in an empty one; raises TypeError or ValueError on others."""
    text: Any = text_of(cell)
    if text is None or text == "":
        return float("nan")
    if isinstance(text, str) and text.strip().lower() in ("true", "false"):
        return float(text.strip().lower() == "true")
    return float(text)


def refuse_long(path: Path, rows: int) -> None:
    """Raises BadLog where the file has more rows than are read."""
    if rows > MOST_ROWS:
        raise BadLog(
            f"{path}: has {rows} rows, at most {MOST_ROWS} are read; cut the log, or keep every"
            " tenth row"
        )


def damaged(path: Path, form: str, error: Exception) -> BadLog:
    """The one-line error for a file on which its reader failed, which may have two causes."""
    text = " ".join(str(error).split())[:120] or type(error).__name__
    return BadLog(
        f"{path}: cannot be read as a {form} file ({text}): it is damaged or cut off, or laid out"
        " as is not read here; copy it again, or write its columns as CSV"
    )


LABELS = ("name", "label", "signalname", "title")  # keys of what a table within a list is called
UNIT_KEYS = ("unit", "units", "einheit", "unité", "単位")  # of what gives a unit
WIDEST_ARRAY = 32  # of an array of numbers that become columns; above, it is an image
DEEPEST = 6  # tables in each other
SINGLE_VALUES = (bool, int, float, str, type(None))


def vectors_of(tree: Any) -> dict[str, RawColumn]:
    """The vectors and single values of a tree of tables, lists and arrays, by their path.

    An entry of a list of tables goes by its own name where it has one: "label" beside "values".
    """
    out: dict[str, RawColumn] = {}
    for path, values in _leaves("", tree, 0):
        name = path if path not in out else f"{path}_{len(out)}"
        out[name] = values
    return out


def of_tree(tree: Any, spec: FileSpec) -> Table:
    """The table of the vectors and single values of a tree, with the units that it gives."""
    found = vectors_of(tree)
    keys = [f"{name.removesuffix('.value')}.unit" for name in found]
    units = tuple(str(found[key][0]) if key in found else "" for key in keys)
    return replace(of_vectors(tuple(found), found.__getitem__, spec), units=units)


def plain_tree(value: Any) -> Any:
    """MATLAB's structs, as scipy reads them, as dicts and lists."""
    if hasattr(value, "_fieldnames"):
        return {name: plain_tree(getattr(value, name)) for name in value._fieldnames}
    if isinstance(value, np.ndarray) and value.dtype == object:
        return [plain_tree(one) for one in value.ravel()]
    return value


def _leaves(path: str, value: Any, depth: int) -> Iterator[tuple[str, RawColumn]]:
    if depth > DEEPEST:
        return
    if isinstance(value, Mapping):
        own = [
            leaf
            for key, inner in value.items()
            for leaf in _leaves(f"{path}.{key}" if path else str(key), inner, depth + 1)
        ]
        long = [x for _, x in own if x.size > 1]
        if path and (name := _label(value)) and len(long) == 1:
            own = [(name, long[0]), *_unit(name, value)]
        yield from own
    elif isinstance(value, list) and value and all(isinstance(one, Mapping) for one in value):
        yield from _entries(path, value, depth)
    elif isinstance(value, SINGLE_VALUES):
        yield path, np.atleast_1d(np.asarray(value))
    else:
        yield from _array(path, value)


def _entries(
    path: str, entries: Sequence[Mapping[str, Any]], depth: int
) -> Iterator[tuple[str, RawColumn]]:
    """Tables of a list: rows, where each holds single values, else one after the other."""
    if len(entries) > WIDEST_ARRAY:
        yield from records(path, entries)
        return
    for k, one in enumerate(entries):
        own = list(_leaves("", one, depth + 1))
        long = [(key, x) for key, x in own if x.size > 1]
        name = _label(one) or f"{path}[{k}]"
        for key, x in long if len(long) == 1 else own:
            yield (name if len(long) == 1 else f"{name}.{key}"), x
        yield from _unit(name, one) if len(long) == 1 else ()


def _unit(name: str, one: Mapping[str, Any]) -> Iterator[tuple[str, RawColumn]]:
    """The unit that a table gives of its only vector, as a single value behind that's name."""
    if unit := _label(one, UNIT_KEYS):
        yield f"{name}.unit", np.array([unit])


def records(path: str, rows: Sequence[Any]) -> Iterator[tuple[str, RawColumn]]:
    """A column for each number in the tables of a list, one row each."""
    flat = [dict(_numbers("", row, 0)) if isinstance(row, Mapping) else {} for row in rows]
    for key in flat[0]:
        whole = f"{path}.{key}" if path else key
        yield whole, np.asarray([row.get(key) for row in flat])


def _numbers(path: str, value: Any, depth: int) -> Iterator[tuple[str, Any]]:
    """The single values below one row, by their path."""
    if isinstance(value, Mapping) and depth < DEEPEST:
        for key, inner in value.items():
            yield from _numbers(f"{path}.{key}" if path else str(key), inner, depth + 1)
    elif isinstance(value, list) and len(value) <= WIDEST_ARRAY and depth < DEEPEST:
        for k, inner in enumerate(value):
            yield from _numbers(f"{path}[{k}]", inner, depth + 1)
    elif isinstance(value, SINGLE_VALUES):
        yield path, value


def _label(one: Mapping[str, Any], keys: Sequence[str] = LABELS) -> str:
    """What a table calls itself, or the text of another of these keys, else nothing."""
    found = (v for key, v in one.items() if key.lower() in keys and isinstance(v, str) and v)
    return next(found, "")


def _array(path: str, value: Any) -> Iterator[tuple[str, RawColumn]]:
    """A vector, or the columns of an array that has few."""
    if isinstance(value, list):
        lengths = {len(one) if isinstance(one, list) else -1 for one in value}
        if len(lengths) > 1:  # no array
            return
    x = np.atleast_1d(np.squeeze(np.asarray(value)))
    if x.ndim == 1:
        yield path, x
    elif x.ndim == 2 and min(x.shape) <= WIDEST_ARRAY:
        for k, one in enumerate(x if x.shape[0] < x.shape[1] else x.T):
            yield f"{path}[{k}]", one


_HEADER = 128
_FLAGS, _MATRIX, _COMPRESSED = 6, 14, 15
_MAT_TYPES = frozenset({1, 2, 3, 4, 5, 6, 7, 9, 12, 13, 14, 15, 16, 17, 18})
_NUMERIC = range(6, 16)  # classes double to uint64: flags, size, name, real part, imaginary part
_CLASSES = range(1, 19)
_COMPLEX = 0x0800


def tags_are_sound(content: bytes) -> bool:
    """Whether every tag of a MAT v5 file has a known type, fits its parent and comes complete.

    Compressed variables carry a checksum of their own and are not opened. Source: MAT-File Format,
    level 5, "Data element format".
    """
    if len(content) <= _HEADER or content[126:128] not in (b"IM", b"MI"):
        return False
    order = "<" if content[126:128] == b"IM" else ">"
    try:
        for kind, start, stop in _elements(content, _HEADER, len(content), order):
            if kind not in (_MATRIX, _COMPRESSED):
                return False
            if kind == _MATRIX:
                _check_matrix(content, start, stop, order)
    except (ValueError, struct.error):
        return False
    return True


def _elements(content: bytes, at: int, end: int, order: str) -> Iterator[tuple[int, int, int]]:
    """Type, first byte and end of each element between `at` and `end`; ValueError if unsound."""
    while at < end:
        kind, size = struct.unpack_from(order + "II", content, at)
        small = kind >> 16
        start = at + (4 if small else 8)
        if small:
            kind, size = kind & 0xFFFF, small
        if kind not in _MAT_TYPES or start + size > end or (small and size > 4):
            raise ValueError("a tag does not fit")
        yield kind, start, start + size
        padding = 0 if kind == _COMPRESSED else -size % (4 if small else 8)
        at = start + size + padding


def _check_matrix(content: bytes, start: int, stop: int, order: str) -> None:
    if start == stop:
        return
    parts = list(_elements(content, start, stop, order))
    kind, first, _ = parts[0]
    flags = struct.unpack_from(order + "I", content, first)[0]
    numeric = (flags & 0xFF) in _NUMERIC
    if kind != _FLAGS or (flags & 0xFF) not in _CLASSES:
        raise ValueError("no array flags")
    if numeric and len(parts) != (5 if flags & _COMPLEX else 4):
        raise ValueError("parts are missing")
    for kind, first, last in parts[1:]:
        if kind == _MATRIX:
            if numeric:
                raise ValueError("a matrix inside numbers")
            _check_matrix(content, first, last, order)
