"""Writers of small logs in the formats of loggers, each by a library or by its specification."""

import json
import struct
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import asammdf
import nptdms
import numpy as np
import openpyxl
from mcap.writer import CompressionType, Writer
from mcap_protobuf.writer import Writer as ProtobufWriter
from mcap_ros1._vendor.genpy.dynamic import generate_dynamic
from mcap_ros1.writer import Writer as Ros1Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.typesys import Stores, get_typestore

from identification.arrays import Array

Signals = Mapping[str, Array]
Waveforms = Mapping[str, tuple[float, float, Signals]]

EPOCH = 1_700_000_000_000_000_000
"""Time of the first message of an MCAP file [ns]."""


def write_tdms(path: Path, columns: Signals) -> None:
    """A TDMS file of one group "Drive", by npTDMS."""
    channels = [nptdms.ChannelObject("Drive", name, values) for name, values in columns.items()]
    with nptdms.TdmsWriter(str(path)) as file:
        file.write_segment(channels)


def write_waveforms(path: Path, groups: Waveforms) -> None:
    """A TDMS file of waveforms: group: (start [s], period [s], channels)."""
    begun = np.datetime64("2024-05-02T10:00:00", "us")
    channels = [
        nptdms.ChannelObject(
            group,
            name,
            values,
            properties={
                "wf_start_time": begun + np.timedelta64(round(1e6 * start), "us"),
                "wf_increment": period,
                "wf_start_offset": 0.0,
            },
        )
        for group, (start, period, members) in groups.items()
        for name, values in members.items()
    ]
    with nptdms.TdmsWriter(str(path)) as file:
        file.write_segment(channels)


def write_mdf(path: Path, columns: Signals, version: str = "4.10") -> None:
    """An MDF file of one group, by asammdf; the column "t" is its clock too."""
    write_mdf_groups(path, [columns], version)


def write_mdf_groups(path: Path, groups: Sequence[Signals], version: str = "4.10") -> Path:
    """The MDF file of several groups, whose column "t" is their clock too."""
    with asammdf.MDF(version=version) as file:
        for columns in groups:
            file.append([asammdf.Signal(v, columns["t"], name=k) for k, v in columns.items()])
        return Path(file.save(str(path), overwrite=True))


def write_mcap(
    path: Path, columns: Signals, compression: CompressionType = CompressionType.ZSTD
) -> None:
    """An MCAP file of JSON messages on one topic, by mcap's own writer."""
    with path.open("wb") as stream:
        writer = Writer(stream, compression=compression)
        writer.start()
        schema = writer.register_schema("Sample", "jsonschema", b'{"type": "object"}')
        channel = writer.register_channel("/drive", "json", schema)
        for k, row in enumerate(zip(*columns.values(), strict=True)):
            values = dict(zip(columns, map(float, row), strict=True))
            when = EPOCH + round(1e9 * values["t"] if abs(values["t"]) < 1e6 else k * 1e6)
            writer.add_message(channel, max(when, 0), json.dumps(values).encode(), max(when, 0))
        writer.finish()


def write_ros2(folder: Path, t: Array, position: Array, effort: Array) -> Path:
    """The MCAP file of a ROS 2 bag of joint states and commands, by rosbags."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    types: dict[str, Any] = dict(store.types)
    state, number = types["sensor_msgs/msg/JointState"], types["std_msgs/msg/Float64"]
    header, stamp = types["std_msgs/msg/Header"], types["builtin_interfaces/msg/Time"]
    with Ros2Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as bag:
        states = bag.add_connection("/joint_states", state.__msgtype__, typestore=store)
        commands = bag.add_connection("/command", number.__msgtype__, typestore=store)
        for k, at in enumerate(np.round(1e9 * t).astype(int)):
            when = stamp(sec=(EPOCH + int(at)) // 10**9, nanosec=(EPOCH + int(at)) % 10**9)
            message = state(
                header=header(stamp=when, frame_id=""),
                name=["slide"],
                position=np.array([position[k]]),
                velocity=np.array([]),
                effort=np.array([effort[k]]),
            )
            late = EPOCH + int(at) + 200_000  # the recorder takes a while
            data = store.serialize_cdr(message, state.__msgtype__)
            bag.write(states, late, data)
            bag.write(
                commands, late, store.serialize_cdr(number(data=effort[k]), number.__msgtype__)
            )
    return next(folder.glob("*.mcap"))


ROS1_TEXT = """# a comment
Header header
string[] name
float64[] position
float64[3] force
uint8 MODE=3
bool moving
duration age
tool/Tip tip
================================================================================
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
================================================================================
MSG: tool/Tip
float32 x
int16[] codes
"""


def write_ros1(path: Path, t: Array, position: Array, force: Array) -> None:
    """An MCAP file of ROS 1 messages, by the code that ROS 1 makes of their definition."""
    types = generate_dynamic("tool/State", ROS1_TEXT)
    with path.open("wb") as stream:
        writer = Ros1Writer(stream)
        for k, at in enumerate(np.round(1e9 * t).astype(int)):
            message = types["tool/State"]()
            message.header.stamp.secs, message.header.stamp.nsecs = divmod(EPOCH + int(at), 10**9)
            message.header.frame_id, message.name = "base", ["slide", "turn"]
            message.position, message.force = [position[k], -1.0], [force[k], 0.0, 0.5]
            message.moving, message.age.secs = k % 2 == 0, 3
            message.tip.x, message.tip.codes = 0.25, [k, -k]
            writer.write_message("/state", message, EPOCH + int(at), EPOCH + int(at))
        writer.finish()


def write_protobuf(path: Path, t: Array, position: Array) -> None:
    """An MCAP file of protobuf messages: those that protobuf's own library has."""
    from google.protobuf.api_pb2 import Mixin
    from google.protobuf.timestamp_pb2 import Timestamp
    from google.protobuf.wrappers_pb2 import DoubleValue

    with path.open("wb") as stream, ProtobufWriter(stream) as writer:
        for at, value in zip(np.round(1e9 * t).astype(int), position, strict=True):
            when = EPOCH + int(at)
            kinds = {
                "/y": DoubleValue(value=value),
                "/stamp": Timestamp(seconds=when // 10**9, nanos=when % 10**9),
                "/text": Mixin(name="x"),
            }
            for topic, message in kinds.items():
                writer.write_message(topic, message, when, when)


def write_ulog(path: Path, columns: Signals, name: str = "drive") -> None:
    """A ULog file of one message, by its specification (docs.px4.io, "ULog File Format")."""
    fields = "".join(f"double {key};" for key in columns)
    with path.open("wb") as file:
        file.write(b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0))
        file.write(_record("B", bytes(40)))
        file.write(_record("F", f"{name}:uint64_t timestamp;{fields}".encode()))
        file.write(_record("A", struct.pack("<BH", 0, 7) + name.encode()))
        for k, row in enumerate(zip(*columns.values(), strict=True)):
            data = struct.pack(f"<HQ{len(row)}d", 7, 1000 * k, *map(float, row))
            file.write(_record("D", data))


def _record(kind: str, data: bytes) -> bytes:
    return struct.pack("<HB", len(data), ord(kind)) + data


def write_xlsx(path: Path, columns: Signals, above: list[list[Any]] | None = None) -> None:
    """A workbook of one sheet: lines of its own, then names and numbers."""
    rows: list[Any] = [*(above or []), list(columns)]
    write_sheet(path, [*rows, *zip(*(v.tolist() for v in columns.values()), strict=True)])


def write_sheet(path: Path, rows: list[Any]) -> None:
    """A workbook of one sheet of these cells, by openpyxl."""
    book = openpyxl.Workbook(write_only=True)
    sheet = book.create_sheet("log")
    for row in rows:
        sheet.append(list(row))
    book.save(path)
