"""Files of many channels in groups, each group with its own clock, as one table of columns.

Their readers are extras: a library is imported only where such a file is read.
"""

import importlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from identification.errors import BadLog
from workbench.cards.card_tables import FileSpec
from workbench.cards.nearest import nearest
from workbench.logs.table import RawColumn, Table


@dataclass(frozen=True)
class Channel:
    """One column of a file: its group, its name in it, and a function that reads it."""

    group: str
    name: str
    fetch: Callable[[], RawColumn]


def optional(module: str, extra: str, path: Path) -> Any:
    """The module of a library that reads such files.

    Raises BadLog with the command that installs it where it is missing.
    """
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        raise BadLog(
            f"{path}: needs the library {error.name!r}, which is not installed; run"
            f" pip install 'servo-workbench[{extra}]'"
        ) from None


def channel_table(path: Path, channels: Sequence[Channel], spec: FileSpec) -> Table:
    """The table of the channels, of those in the group `spec.rows` alone where the card says so.

    Raises BadLog where there is no such group or no channel at all.
    """
    if spec.rows is not None:
        groups = dict.fromkeys(channel.group for channel in channels)
        channels = [channel for channel in channels if channel.group == spec.rows]
        if not channels:
            raise BadLog(f"{path}: no group {spec.rows!r}{nearest(spec.rows, groups)}")
    if not channels:
        raise BadLog(f"{path}: holds no channel of numbers; give another file")
    return Table(
        tuple(channel.name for channel in channels),
        lambda number: channels[number].fetch()[spec.skip_rows :],
        1 + spec.skip_rows,
        groups=tuple(channel.group for channel in channels),
    )
