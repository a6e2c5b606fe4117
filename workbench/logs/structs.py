"""Tables within tables, as JSON and MATLAB's structs hold them, as vectors by their path.

Tags of a MAT v5 file are followed before it is read: scipy's reader crashes Python on corrupt ones.
"""

import struct
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from workbench.logs.table import RawColumn

LABELS = ("name", "label", "signalname", "title")  # keys of what a table within a list is called
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
            own = [(name, long[0])]
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


def _label(one: Mapping[str, Any]) -> str:
    """What a table calls itself, else nothing."""
    found = (v for key, v in one.items() if key.lower() in LABELS and isinstance(v, str) and v)
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
