"""Messages of topics as a table: a group a topic, a column each number in its messages."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from workbench.cards.card_tables import FileSpec
from workbench.logs.channels import Channel, channel_table
from workbench.logs.table import RawColumn, Table, refuse_long

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


@dataclass
class _Topic:
    """A topic as found: the names of its columns, by its first message, and how many it has."""

    names: tuple[str, ...]
    count: int = 0
    columns: dict[str, RawColumn] = field(default_factory=dict)


def message_table(file: Container, spec: FileSpec) -> Table | None:
    """The table of the file's topics; None where no topic is in an encoding that is read.

    Columns are the numbers of a message by their path in it ("pose.position.x", "position[0]"), and
    the container's clocks. Times are in seconds since the first message of the file.
    """
    topics, others, begun = _topics(file, spec.rows)
    if not topics and others:
        return None
    found = Container(file.path, file.clocks, file.messages, begun)
    channels = [
        Channel(name, column, partial(_column, found, name, topic, column))
        for name, topic in topics.items()
        for column in (*found.clocks, *topic.names)
    ]
    return channel_table(found.path, channels, spec)


def _topics(file: Container, only: str | None) -> tuple[dict[str, _Topic], set[str], int]:
    """Topics whose messages hold numbers, those that are not read, the first message's time."""
    topics, others = dict[str, _Topic](), set[str]()
    begun: int | None = None
    for one in file.messages():
        begun = one.times[0] if begun is None else min(begun, one.times[0])
        if one.topic in others or (only is not None and one.topic != only):
            continue
        if one.topic not in topics:
            if one.decode is None:
                others.add(one.topic)
                continue
            topics[one.topic] = _Topic(tuple(dict(_numbers(one.decode(one.data), 0))))
        topics[one.topic].count += 1
        refuse_long(file.path, topics[one.topic].count)
    return topics, others, begun or 0


def _column(file: Container, name: str, topic: _Topic, column: str) -> RawColumn:
    if not topic.columns:
        topic.columns.update(_columns(file, name, topic))
    return topic.columns[column]


def _columns(file: Container, name: str, topic: _Topic) -> dict[str, RawColumn]:
    out = {key: np.full(topic.count, np.nan) for key in (*file.clocks, *topic.names)}
    own = (one for one in file.messages() if one.topic == name)
    for row, one in enumerate(sorted(own, key=lambda one: one.times[0])):
        for key, moment in zip(file.clocks, one.times, strict=True):
            out[key][row] = (moment - file.begun) * 1e-9
        read = {} if one.decode is None else dict(_numbers(one.decode(one.data), file.begun))
        for key, value in read.items():
            if key in out:
                out[key][row] = value
    return out


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
