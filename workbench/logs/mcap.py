"""MCAP files (ROS 1 and 2, Foxglove): messages of each topic as columns of numbers.

The libraries of mcap read the container and the encodings cdr (ROS 2) and protobuf; json is
Python's own. For ROS 1 see workbench/logs/ros1.py.
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from identification.errors import BadLog
from workbench.cards.card_tables import FileSpec
from workbench.files import refuse_larger
from workbench.logs.channels import optional
from workbench.logs.messages import Container, Decoder, Message, message_table
from workbench.logs.ros1 import ros1_decoder
from workbench.logs.table import BINARY_BYTES, Table

_CHUNK_BYTES = 200_000_000  # of a chunk unpacked; writers make them of a megabyte or a few
_CLOCKS = ("log_time", "publish_time")


@dataclass(frozen=True)
class _Libraries:
    """The file's path, the library of the container, and those of its encodings."""

    path: Path
    library: Any
    decoders: tuple[Any, ...]


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
    file = _Libraries(path, library, decoders)
    found = message_table(Container(path, _CLOCKS, lambda: _decoded(file)), spec)
    if found is None:
        encodings = {str(channel.message_encoding) for _, channel, _ in _messages(file)}
        raise BadLog(
            f"{path}: has no topic whose encoding is read (there is:"
            f" {', '.join(sorted(encodings))}); cdr (ROS 2), ros1, protobuf and json are"
        )
    return found


def _decoded(file: _Libraries) -> Iterator[Message]:
    """The messages, each with what reads those of its channel."""
    known = dict[int, Decoder | None]()
    for schema, channel, message in _messages(file):
        if channel.id not in known:
            known[channel.id] = _decoder(file, channel, schema)
        times = (int(message.log_time), int(message.publish_time))
        yield Message(str(channel.topic), times, message.data, known[channel.id])


def _decoder(file: _Libraries, channel: Any, schema: Any) -> Decoder | None:
    if channel.message_encoding == "json":
        return json.loads
    if channel.message_encoding == "ros1" and schema is not None:
        return ros1_decoder(schema.name, schema.data.decode())
    found = (one.decoder_for(channel.message_encoding, schema) for one in file.decoders)
    return next((decode for decode in found if decode is not None), None)


def _messages(file: _Libraries) -> Iterator[tuple[Any, Any, Any]]:
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


def _records(file: _Libraries, reader: Any) -> Iterator[Any]:
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
