"""MAT v5 tags followed before the file is read: scipy's reader crashes Python on corrupt ones."""

import struct
from collections.abc import Iterator

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
