"""Messages of topics as a table, a group a topic, a column each number in its messages: MCAP files
(ROS 1 and 2, Foxglove) and bags of ROS 1.

The libraries of mcap read the container and the encodings cdr (ROS 2) and protobuf; json is
Python's own. Messages of ROS 1 are read here by their definition, little-endian, packed, arrays and
texts after their length: its library writes Python from a log's definitions and runs it, and a log
that somebody sent must run nothing.
"""

import json
import re
import struct
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from identification.errors import BadLog
from workbench.cards.card_tables import FileSpec
from workbench.files import refuse_larger
from workbench.logs.channels import Channel, channel_table, optional
from workbench.logs.table import BINARY_BYTES, RawColumn, Table, refuse_long

_BAG_CLOCKS = ("log_time",)
_CHUNK_BYTES = 200_000_000  # of a chunk unpacked; writers make them of a megabyte or a few
_CLOCKS = ("log_time", "publish_time")
Decoder = Callable[[bytes], Any]

_ELEMENTS = 64  # of an array of numbers that become columns; above, it is an image or a scan
_DEPTH = 16  # of messages within messages
_STAMPS = ({"sec", "nanosec"}, {"secs", "nsecs"}, {"seconds", "nanos"})
_EPOCH = 100_000_000  # s; above, a stamp is a date and no duration


class Message(NamedTuple):
    """A message of a topic: its times [ns] by the container's clocks, its bytes, and how these are
    read; None where they are in an encoding that is not."""

    topic: str
    times: tuple[int, ...]
    data: bytes
    decode: Decoder | None


@dataclass(frozen=True)
class Container:
    """A file of messages: its path, names of its clocks, its messages each time anew; begun: the
    time of its first message [ns]."""

    path: Path
    clocks: tuple[str, ...]
    messages: Callable[[], Iterator[Message]]
    begun: int = 0


def message_table(file: Container, spec: FileSpec) -> Table | None:
    """The table of the file's topics; None where no topic is in an encoding that is read.

    Columns are the numbers of a message by their path in it ("pose.position.x", "position[0]"), and
    the container's clocks. Times are in seconds since the first message of the file.
    """
    topics, others, begun = _topics(file, spec.rows)
    if not topics and others:
        return None
    found = replace(file, begun=begun)
    channels = [one for topic, rows in topics.items() for one in _channels(found, topic, *rows)]
    return channel_table(found.path, channels, spec)


def _topics(
    file: Container, only: str | None
) -> tuple[dict[str, tuple[int, tuple[str, ...]]], set[str], int]:
    """Topics whose messages hold numbers, with how many there are and the numbers' names by the
    first; those that are not read; the first message's time."""
    counts, names, others = Counter[str](), dict[str, tuple[str, ...]](), set[str]()
    begun: int | None = None
    for one in file.messages():
        begun = one.times[0] if begun is None else min(begun, one.times[0])
        if only is not None and one.topic != only:
            continue
        if one.topic not in names:
            if one.topic in others or one.decode is None:
                others.add(one.topic)
                continue
            names[one.topic] = tuple(dict(_numbers(one.decode(one.data), 0)))
        counts[one.topic] += 1
        refuse_long(file.path, counts[one.topic])
    return {topic: (counts[topic], own) for topic, own in names.items()}, others, begun or 0


def _channels(file: Container, topic: str, count: int, names: Sequence[str]) -> Iterator[Channel]:
    """The columns of a topic, all of them read where one is."""

    @cache
    def columns() -> dict[str, RawColumn]:
        out = {key: np.full(count, np.nan) for key in (*file.clocks, *names)}
        own = (one for one in file.messages() if one.topic == topic)
        for row, one in enumerate(sorted(own, key=lambda one: one.times[0])):
            for key, moment in zip(file.clocks, one.times, strict=True):
                out[key][row] = (moment - file.begun) * 1e-9
            read = {} if one.decode is None else dict(_numbers(one.decode(one.data), file.begun))
            for key, value in read.items():
                if key in out:
                    out[key][row] = value
        return out

    def fetch(column: str) -> RawColumn:
        return columns()[column]

    for column in (*file.clocks, *names):
        yield Channel(topic, column, partial(fetch, column))


def _numbers(message: Any, begun: int) -> Iterator[tuple[str, float]]:
    """The numbers of a message by their path in it."""
    for path, value in _leaves("", message, 0):
        if isinstance(value, tuple):
            since = divmod(begun, 10**9) if value[0] > _EPOCH else (0, 0)
            yield path, (value[0] - since[0]) + 1e-9 * (value[1] - since[1])
        else:
            yield path, float(value)


def _leaves(path: str, value: Any, depth: int) -> Iterator[tuple[str, Any]]:
    """Numbers below `value` by path; a stamp is the pair of its seconds and nanoseconds."""
    if depth > _DEPTH:
        return
    if isinstance(value, bool | int | float):
        yield path, value
        return
    parts = _parts(value)
    if parts is None:
        return
    if isinstance(parts, Sequence):
        for k, part in enumerate(parts if len(parts) <= _ELEMENTS else ()):
            yield from _leaves(f"{path}[{k}]", part, depth + 1)
    elif set(parts) in _STAMPS and path:
        whole, nano = parts.values()
        yield path, (int(whole), int(nano))
    else:
        for key, part in parts.items():
            yield from _leaves(f"{path}.{key}" if path else str(key), part, depth + 1)


def _parts(value: Any) -> Mapping[str, Any] | list[Any] | None:
    """What a message or an array is made of; None of what holds no numbers."""
    if isinstance(value, str | bytes | bytearray | memoryview):
        return None
    if isinstance(value, Mapping):
        return value
    if hasattr(value, "DESCRIPTOR"):  # of protobuf
        parts = value.DESCRIPTOR.fields
        return {part.name: getattr(value, part.name) for part in parts if _is_set(value, part)}
    if hasattr(value, "__slots__") and hasattr(type(value), "_full_text"):  # of ROS 2
        return {key: getattr(value, key) for key in type(value).__slots__}
    if hasattr(value, "__len__") and hasattr(value, "__getitem__"):
        return list(value) if len(value) <= _ELEMENTS else []
    return None


def _is_set(message: Any, part: Any) -> bool:
    """Whether a field is there; a number that is 0 is, though protobuf leaves it out."""
    single = part.message_type is not None and not part.is_repeated
    return not single or bool(message.HasField(part.name))


def read_mcap(path: Path, spec: FileSpec) -> Table:
    """The messages of the file by topic, a group each, as `message_table` says.

    Raises BadLog where no topic has an encoding that is read.
    """
    refuse_larger(path, BINARY_BYTES, "an MCAP file", BadLog)
    library = optional("mcap.stream_reader", "mcap", path)
    decoders = tuple(
        optional(name, "mcap", path).DecoderFactory()
        for name in ("mcap_ros2.decoder", "mcap_protobuf.decoder")
    )

    def messages() -> Iterator[Message]:
        known = dict[int, Decoder | None]()
        for schema, channel, message in _messages(path, library):
            if channel.id not in known:
                known[channel.id] = _decoder(decoders, channel, schema)
            times = (int(message.log_time), int(message.publish_time))
            yield Message(str(channel.topic), times, message.data, known[channel.id])

    found = message_table(Container(path, _CLOCKS, messages), spec)
    if found is None:
        encodings = {str(channel.message_encoding) for _, channel, _ in _messages(path, library)}
        raise BadLog(
            f"{path}: has no topic whose encoding is read (there is:"
            f" {', '.join(sorted(encodings))}); cdr (ROS 2), ros1, protobuf and json are"
        )
    return found


def _decoder(decoders: Sequence[Any], channel: Any, schema: Any) -> Decoder | None:
    if channel.message_encoding == "json":
        return json.loads
    if channel.message_encoding == "ros1" and schema is not None:
        return ros1_decoder(schema.name, schema.data.decode())
    found = (one.decoder_for(channel.message_encoding, schema) for one in decoders)
    return next((decode for decode in found if decode is not None), None)


def _messages(path: Path, library: Any) -> Iterator[tuple[Any, Any, Any]]:
    """Schema (or None), channel and message of every message, as they stand in the file."""
    schemas: dict[int, Any] = {0: None}
    channels: dict[int, Any] = {}
    with path.open("rb") as stream:
        reader = library.StreamReader(
            stream, emit_chunks=True, validate_crcs=True, record_size_limit=BINARY_BYTES
        )
        for record in _records(path, library, reader):
            match type(record).__name__:
                case "Schema":
                    schemas[record.id] = record
                case "Channel":
                    channels[record.id] = record
                case "Message":
                    channel = channels[record.channel_id]
                    yield schemas[channel.schema_id], channel, record


def _records(path: Path, library: Any, reader: Any) -> Iterator[Any]:
    unpacked = 0
    for record in reader.records:
        if type(record).__name__ != "Chunk":
            yield record
            continue
        chunk = replace(record, data=_unpacked(path, record), compression="")
        unpacked += len(chunk.data)
        if unpacked > BINARY_BYTES:
            raise BadLog(
                f"{path}: holds more than {BINARY_BYTES / 1e6:g} MB when unpacked; keep the"
                " topics that the card names (mcap filter -y /topic)"
            )
        yield from library.breakup_chunk(chunk, validate_crc=True)


def _unpacked(path: Path, chunk: Any) -> bytes:
    """The chunk's bytes; a few that say they are more than any writer's are not unpacked."""
    most = _CHUNK_BYTES
    match chunk.compression:
        case "zstd":
            library = optional("zstandard", "mcap", path)
            with library.ZstdDecompressor().stream_reader(chunk.data) as reader:
                data = bytes(reader.read(most + 1))
        case "lz4":
            library = optional("lz4.frame", "mcap", path)
            data = bytes(library.LZ4FrameDecompressor().decompress(chunk.data, most + 1))
        case "":
            data = bytes(chunk.data)
        case other:
            raise BadLog(f"{path}: is compressed by {other!r}; write it with zstd or lz4")
    if len(data) > most:
        raise BadLog(f"{path}: a chunk of it unpacks to more than {most / 1e6:g} MB; write it anew")
    return data


def read_bag(path: Path, spec: FileSpec) -> Table:
    """The messages of the bag by topic, a group each, as `message_table` says.

    Raises BadLog where the bag has no index, or no message of numbers.
    """
    refuse_larger(path, BINARY_BYTES, "a bag", BadLog)
    library = optional("rosbags.rosbag1", "rosbag", path)

    def messages() -> Iterator[Message]:
        decoders = dict[int, Decoder]()
        with library.Reader(path) as reader:
            for connection, moment, data in reader.messages():
                if connection.id not in decoders:
                    name = str(connection.msgtype).replace("/msg/", "/")
                    text = getattr(connection.msgdef, "data", connection.msgdef)
                    decoders[connection.id] = ros1_decoder(name, text)
                yield Message(connection.topic, (int(moment),), bytes(data),
                              decoders[connection.id])  # fmt: skip

    try:
        found = message_table(Container(path, _BAG_CLOCKS, messages), spec)
    except library.ReaderError as error:
        raise BadLog(
            f"{path}: the bag cannot be opened ({' '.join(str(error).split())}); run rosbag reindex"
            " on it where its recording was cut off"
        ) from None
    assert found is not None
    return found


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
