"""Bags of ROS 1: messages of each topic as columns of numbers.

The library reads the container alone; for the messages see workbench/logs/ros1.py.
"""

from collections.abc import Iterator
from pathlib import Path

from identification.errors import BadLog
from workbench.cards.card_tables import FileSpec
from workbench.files import refuse_larger
from workbench.logs.channels import optional
from workbench.logs.messages import Container, Decoder, Message, message_table
from workbench.logs.ros1 import ros1_decoder
from workbench.logs.table import BINARY_BYTES, Table

_BAG_CLOCKS = ("log_time",)


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
