"""Bags of ROS 1: their topics as columns, and what is no bag."""

from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_typestore

from identification.errors import BadLog
from workbench.cards.card_tables import FileSpec
from workbench.logs.tables import read_table
from workbench.logs.unknown import read_unknown

BEGUN = 1_700_000_000_000_000_000
STATE, NUMBER = "sensor_msgs/msg/JointState", "std_msgs/msg/Float64"
ROWS = 150


def write(path: Path, *, packed: bool = False) -> None:
    """A joint's states every 10 ms, and a number of its own topic beside them, 3 ms later."""
    store = get_typestore(Stores.ROS1_NOETIC)
    types = store.types
    bag = Writer(path)
    if packed:
        bag.set_compression(bag.CompressionFormat.BZ2)
    with bag:
        joint = bag.add_connection("/joint_states", STATE, typestore=store)
        other = bag.add_connection("/current", NUMBER, typestore=store)
        for k in range(ROWS):
            at = BEGUN + 10_000_000 * k
            stamp = types["builtin_interfaces/msg/Time"](at // 10**9, at % 10**9)
            head = types["std_msgs/msg/Header"](k, stamp, "base")
            values = (np.array([f * k]) for f in (0.5, 2.0, -1.0))
            state = types[STATE](head, ["hinge"], *values)
            bag.write(joint, at, store.serialize_ros1(state, STATE))
            number = types[NUMBER](float(k))
            bag.write(other, at + 3_000_000, store.serialize_ros1(number, NUMBER))


@pytest.mark.parametrize("packed", [False, True])
def test_topics_are_groups_of_columns(tmp_path: Path, packed: bool) -> None:
    write(tmp_path / "run.bag", packed=packed)
    table = read_table(tmp_path / "run.bag", FileSpec())
    assert table.column("position[0]", "bag")[20] == 10.0
    assert table.column("/joint_states/effort[0]", "bag")[20] == -20.0
    assert table.column("/current/log_time", "bag")[20] == pytest.approx(0.203)
    assert table.column("header.stamp", "bag")[20] == pytest.approx(0.2)


def test_topics_are_looked_at_on_one_clock(tmp_path: Path) -> None:
    write(tmp_path / "run.bag")
    found = {one.key: one for one in read_unknown(tmp_path / "run.bag").columns}
    assert found["/current/data"].values[20] == pytest.approx(20.0 - 0.3)
    assert found["/joint_states/position[0]"].values[20] == 10.0


def test_what_is_no_bag_is_refused_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "a.bag").write_bytes(b"#ROSBAG V1.2\n" + bytes(64))
    with pytest.raises(BadLog, match="not a rosbag file by its first bytes"):
        read_table(tmp_path / "a.bag", FileSpec())
    write(tmp_path / "run.bag")
    whole = (tmp_path / "run.bag").read_bytes()
    (tmp_path / "cut.bag").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(BadLog) as refused:
        read_table(tmp_path / "cut.bag", FileSpec())
    assert "\n" not in str(refused.value)
