"""ULog files of PX4, read by pyulog."""

import io
from collections.abc import Iterator
from contextlib import redirect_stdout
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from identification.errors import BadLog
from workbench.cards.card_tables import FileSpec
from workbench.files import refuse_larger
from workbench.logs.channels import Channel, channel_table, optional
from workbench.logs.table import Table, refuse_long

_ULOG_BYTES = 400_000_000  # read record by record in Python, a minute for 100 MB


def read_ulog(path: Path, spec: FileSpec) -> Table:
    """The messages of the file, a group each; the second instance of one is "name[1]".

    Each group has its clock as the column "timestamp", in microseconds. Raises BadLog where the
    reader had to leave out broken records, which may be those of any signal.
    """
    refuse_larger(path, _ULOG_BYTES, "a ULog file", BadLog)
    library = optional("pyulog", "ulog", path)
    only = [spec.rows.partition("[")[0]] if spec.rows else None
    with path.open("rb") as stream, redirect_stdout(io.StringIO()):  # it prints what is broken
        file = library.ULog(stream, only)
    if file.file_corruption:
        raise BadLog(f"{path}: damaged or cut off, records are broken; copy it again")
    return channel_table(path, list(_channels(path, file)), spec)


def _channels(path: Path, file: Any) -> Iterator[Channel]:
    for message in file.data_list:
        group = f"{message.name}[{message.multi_id}]" if message.multi_id else message.name
        for name, values in message.data.items():
            refuse_long(path, len(values))
            yield Channel(group, name, partial(np.asarray, values))
