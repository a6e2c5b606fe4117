"""MCAP files (ROS 1 and 2, Foxglove): messages of each topic as columns of numbers.

The libraries of mcap read the container and the encodings cdr (ROS 2) and protobuf; json is
Python's own. For ROS 1 see workbench/logs/ros1.py.
"""

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from identification.errors import BadLog
from workbench.cards.card_tables import FileSpec
from workbench.files import refuse_larger
from workbench.logs.channels import Channel, channel_table, optional
from workbench.logs.ros1 import ros1_decoder
from workbench.logs.table import BINARY_BYTES, RawColumn, Table, refuse_long

Decoder = Callable[[bytes], Any]

_CHUNK_BYTES = 200_000_000  # of a chunk unpacked; writers make them of a megabyte or a few
_ELEMENTS = 64  # of an array of numbers that become columns; above, it is an image or a scan
_DEPTH = 16  # of messages within messages
_STAMPS = ({"sec", "nanosec"}, {"secs", "nsecs"}, {"seconds", "nanos"})
_EPOCH = 100_000_000  # s; above, a stamp is a date and no duration
_CLOCKS = ("log_time", "publish_time")


@dataclass(frozen=True)
class _Container:
    """An open kind of file: the libraries, its path, and the time of its first message [ns]."""

    path: Path
    library: Any
    decoders: tuple[Any, ...]
    begun: int = 0


@dataclass
class _Topic:
    """A topic as found: the names of its columns, by its first message, and how many it has."""

    decode: Decoder
    names: tuple[str, ...]
    count: int = 0
    columns: dict[str, RawColumn] = field(default_factory=dict)


def read_mcap(path: Path, spec: FileSpec) -> Table:
    """The messages of the file by topic, a group each.

    Columns are the numbers of a message by their path in it ("pose.position.x", "position[0]"), and
    "log_time" and "publish_time". Times, also stamps in messages, are in seconds since the first
    message of the file. Raises BadLog where no topic has an encoding that is read.
    """
    refuse_larger(path, BINARY_BYTES, "an MCAP file", BadLog)
    library = optional("mcap.stream_reader", "mcap", path)
    decoders = tuple(
        optional(name, "mcap", path).DecoderFactory()
        for name in ("mcap_ros2.decoder", "mcap_protobuf.decoder")
    )
    topics, others, begun = _topics(_Container(path, library, decoders), spec.rows)
    file = _Container(path, library, decoders, begun)
    if not topics and others:
        raise BadLog(
            f"{path}: has no topic whose encoding is read (there is: {', '.join(sorted(others))});"
            " cdr (ROS 2), ros1, protobuf and json are"
        )
    channels = [
        Channel(name, column, partial(_column, file, name, topic, column))
        for name, topic in topics.items()
        for column in (*_CLOCKS, *topic.names)
    ]
    return channel_table(path, channels, spec)


def _topics(file: _Container, only: str | None) -> tuple[dict[str, _Topic], set[str], int]:
    """Topics whose messages hold numbers, encodings that are not read, the first message's time."""
    topics = dict[str, _Topic]()
    silent, others = set[str](), set[str]()
    begun: int | None = None
    for schema, channel, message in _messages(file):
        begun = message.log_time if begun is None else min(begun, message.log_time)
        name = str(channel.topic)
        if name in silent or (only is not None and name != only):
            continue
        if name not in topics:
            decode = _decoder(file, channel, schema)
            if decode is None:
                others.add(str(channel.message_encoding))
                silent.add(name)
                continue
            topics[name] = _Topic(decode, tuple(dict(_numbers(decode(message.data), 0))))
        topics[name].count += 1
        refuse_long(file.path, topics[name].count)
    return topics, others, begun or 0


def _decoder(file: _Container, channel: Any, schema: Any) -> Decoder | None:
    if channel.message_encoding == "json":
        return json.loads
    if channel.message_encoding == "ros1" and schema is not None:
        return ros1_decoder(schema.name, schema.data.decode())
    found = (one.decoder_for(channel.message_encoding, schema) for one in file.decoders)
    return next((decode for decode in found if decode is not None), None)


def _column(file: _Container, name: str, topic: _Topic, column: str) -> RawColumn:
    if not topic.columns:
        topic.columns.update(_columns(file, name, topic))
    return topic.columns[column]


def _columns(file: _Container, name: str, topic: _Topic) -> dict[str, RawColumn]:
    out = {key: np.full(topic.count, np.nan) for key in (*_CLOCKS, *topic.names)}
    own = (message for _, channel, message in _messages(file) if channel.topic == name)
    for row, message in enumerate(sorted(own, key=lambda message: int(message.log_time))):
        out["log_time"][row] = (message.log_time - file.begun) * 1e-9
        out["publish_time"][row] = (message.publish_time - file.begun) * 1e-9
        for key, value in _numbers(topic.decode(message.data), file.begun):
            if key in out:
                out[key][row] = value
    return out


def _messages(file: _Container) -> Iterator[tuple[Any, Any, Any]]:
    """Schema (or None), channel and message of every message, as they stand in the file."""
    schemas: dict[int, Any] = {0: None}
    channels: dict[int, Any] = {}
    with file.path.open("rb") as stream:
        reader = file.library.StreamReader(
            stream, emit_chunks=True, validate_crcs=True, record_size_limit=BINARY_BYTES
        )
        for record in _records(file, reader):
            match type(record).__name__:
                case "Schema":
                    schemas[record.id] = record
                case "Channel":
                    channels[record.id] = record
                case "Message":
                    channel = channels[record.channel_id]
                    yield schemas[channel.schema_id], channel, record


def _records(file: _Container, reader: Any) -> Iterator[Any]:
    unpacked = 0
    for record in reader.records:
        if type(record).__name__ != "Chunk":
            yield record
            continue
        chunk = replace(record, data=_unpacked(file.path, record), compression="")
        unpacked += len(chunk.data)
        if unpacked > BINARY_BYTES:
            raise BadLog(
                f"{file.path}: holds more than {BINARY_BYTES / 1e6:g} MB when unpacked; keep the"
                " topics that the card names (mcap filter -y /topic)"
            )
        yield from file.library.breakup_chunk(chunk, validate_crc=True)


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


def _numbers(message: Any, begun: int) -> Iterator[tuple[str, float]]:
    """The numbers of a message by their path in it."""
    for path, value in _leaves("", message, 0):
        if isinstance(value, tuple):
            whole, nano = value
            yield (
                path,
                (whole - (begun // 10**9 if whole > _EPOCH else 0))
                + 1e-9 * (nano - (begun % 10**9 if whole > _EPOCH else 0)),
            )
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
    if isinstance(parts, list):
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
