"""Messages of ROS 1 read by their definition.

The library for messages writes Python from a log's definitions and runs it. A log that somebody
sent must run nothing, so they are read here: little-endian, packed, arrays and texts after their
length.
"""

import re
import struct
from collections.abc import Callable
from typing import Any, NamedTuple

_FORMATS = {
    **{"bool": "?", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i"},
    **{"uint32": "I", "int64": "q", "uint64": "Q", "float32": "f", "float64": "d"},
    **{"byte": "b", "char": "B"},
}
_MOMENTS = {"time": "II", "duration": "ii"}
_FIELD = re.compile(r"([\w/]+)(?:\[(\d*)\])?\s+(\w+)\s*")
_DEFINITION = re.compile(r"^=+\s*\nMSG:\s*([\w/]+)\s*$", re.MULTILINE)
_NESTED = 32  # definitions within each other


class _Field(NamedTuple):
    kind: str
    name: str
    length: int | None  # of an array; 0: given by the message, None: no array


Definitions = dict[str, list[_Field]]


def ros1_decoder(name: str, text: str) -> Callable[[bytes], dict[str, Any]]:
    """A function from the bytes of a message to its fields by name.

    text: the definition, and behind lines of "=" those that it names, as MCAP and bags hold it.
    Raises ValueError or struct.error, and so does the function, where this is no such message.
    Source: wiki.ros.org/msg.
    """
    first, *rest = _DEFINITION.split(text.replace("\r\n", "\n"))
    named = dict(zip(rest[::2], rest[1::2], strict=True))
    definitions: Definitions = {key: _fields(body) for key, body in named.items()}
    definitions[name] = _fields(first)
    package = name.partition("/")[0]

    def decode(data: bytes) -> dict[str, Any]:
        return _message(definitions, definitions[name], package, data, 0, 0)[0]

    return decode


def _fields(body: str) -> list[_Field]:
    out = []
    for line in body.splitlines():
        plain = line.partition("#")[0].strip()
        if not plain or "=" in plain:  # constants are not in a message
            continue
        found = _FIELD.fullmatch(plain)
        if found is None:
            raise ValueError(f"{plain[:40]!r} is no line of a ROS 1 message definition")
        kind, length, name = found.groups()
        out.append(_Field(kind, name, None if length is None else int(length or 0)))
    return out


def _message(
    definitions: Definitions, fields: list[_Field], package: str, data: bytes, at: int, depth: int
) -> tuple[dict[str, Any], int]:
    """Fields of the message whose bytes begin at `at`, and where they end."""
    if depth > _NESTED:
        raise ValueError("definitions lie too deep in each other")
    out: dict[str, Any] = {}
    for field in fields:
        count, many = 1, field.length is not None
        if field.length == 0:
            (count,) = struct.unpack_from("<I", data, at)
            at += 4
            if count > len(data):
                raise ValueError("an array is longer than its message")
        elif field.length is not None:
            count = field.length
        if field.kind in _FORMATS:
            form = f"<{count}{_FORMATS[field.kind]}"
            values: list[Any] = list(struct.unpack_from(form, data, at))
            at += struct.calcsize(form)
        else:
            values = []
            for _ in range(count):
                value, at = _compound(definitions, field.kind, package, data, at, depth)
                values.append(value)
        out[field.name] = values if many else values[0]
    return out, at


def _compound(
    definitions: Definitions, kind: str, package: str, data: bytes, at: int, depth: int
) -> tuple[Any, int]:
    """A text, a time or a message within a message, and where it ends."""
    if kind in _MOMENTS:
        secs, nsecs = struct.unpack_from(f"<{_MOMENTS[kind]}", data, at)
        return {"secs": secs, "nsecs": nsecs}, at + 8
    if kind == "string":
        (size,) = struct.unpack_from("<I", data, at)
        if at + 4 + size > len(data):
            raise ValueError("a text is longer than its message")
        return data[at + 4 : at + 4 + size], at + 4 + size
    whole = "std_msgs/Header" if kind == "Header" else kind
    found = next((one for one in (whole, f"{package}/{kind}") if one in definitions), None)
    if found is None:
        raise ValueError(f"no definition of {kind!r}")
    return _message(definitions, definitions[found], found.partition("/")[0], data, at, depth + 1)
