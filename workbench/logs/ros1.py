"""Messages of ROS 1 read by their definition.

The library for messages writes Python from a log's definitions and runs it. A log that somebody
sent must run nothing, so they are read here: little-endian, packed, arrays and texts after their
length.
"""

import re
import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
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


Definitions = Mapping[str, Sequence[_Field]]


def ros1_decoder(name: str, text: str) -> Callable[[bytes], dict[str, Any]]:
    """A function from the bytes of a message to its fields by name.

    text: the definition, and behind lines of "=" those that it names, as MCAP and bags hold it.
    Raises ValueError or struct.error, and so does the function, where this is no such message.
    Source: wiki.ros.org/msg.
    """
    first, *rest = _DEFINITION.split(text.replace("\r\n", "\n"))
    named = dict(zip(rest[::2], rest[1::2], strict=True))
    definitions = {key: _fields(body) for key, body in named.items()} | {name: _fields(first)}

    def decode(data: bytes) -> dict[str, Any]:
        return _Bytes(definitions, data).message(name)

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


@dataclass
class _Bytes:
    """A message's bytes and what they mean, read from `at` on."""

    definitions: Definitions
    data: bytes
    at: int = 0

    def message(self, name: str, depth: int = 0) -> dict[str, Any]:
        """The fields of a message."""
        if depth > _NESTED:
            raise ValueError("definitions lie too deep in each other")
        package = name.partition("/")[0]
        return {one.name: self._field(one, package, depth) for one in self.definitions[name]}

    def _take(self, form: str) -> tuple[Any, ...]:
        values = struct.unpack_from(f"<{form}", self.data, self.at)
        self.at += struct.calcsize(f"<{form}")
        return values

    def _field(self, field: _Field, package: str, depth: int) -> Any:
        count = 1 if field.length is None else field.length
        if field.length == 0:
            (count,) = self._take("I")
            if count > len(self.data):
                raise ValueError("an array is longer than its message")
        if field.kind in _FORMATS:
            values = list(self._take(f"{count}{_FORMATS[field.kind]}"))
        else:
            values = [self._compound(field.kind, package, depth) for _ in range(count)]
        return values[0] if field.length is None else values

    def _compound(self, kind: str, package: str, depth: int) -> Any:
        """A text, a time or a message within a message."""
        if kind in _MOMENTS:
            secs, nsecs = self._take(_MOMENTS[kind])
            return {"secs": secs, "nsecs": nsecs}
        if kind == "string":
            (size,) = self._take("I")
            if self.at + size > len(self.data):
                raise ValueError("a text is longer than its message")
            self.at += size
            return self.data[self.at - size : self.at]
        whole = "std_msgs/Header" if kind == "Header" else kind
        found = next((one for one in (whole, f"{package}/{kind}") if one in self.definitions), None)
        if found is None:
            raise ValueError(f"no definition of {kind!r}")
        return self.message(found, depth + 1)
