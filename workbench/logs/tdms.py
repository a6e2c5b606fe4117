"""TDMS files of LabVIEW and DIAdem, read by npTDMS."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from identification.errors import BadLog
from workbench.cards.card_tables import FileSpec
from workbench.files import refuse_larger
from workbench.logs.channels import Channel, channel_table, optional
from workbench.logs.table import BINARY_BYTES, RawColumn, Table, refuse_long

_WAVEFORM_CLOCK = "time"
"""Name of the column that a group gets where it has a waveform's clock and no channel of times."""


def read_tdms(path: Path, spec: FileSpec) -> Table:
    """The channels of the file by group.

    A group of waveforms has its clock as a column "time" [s], from the earliest start in the file.
    """
    refuse_larger(path, BINARY_BYTES, "a TDMS file", BadLog)
    library = optional("nptdms", "tdms", path)
    channels = list[Channel]()
    with _opened(library, path) as file:
        begun = _first_start(file)
        for group in file.groups():
            names = [channel.name for channel in group.channels()]
            for channel in group.channels():
                refuse_long(path, len(channel))
                where = (library, path, group.name, channel.name)
                channels.append(Channel(group.name, channel.name, partial(_values, *where)))
            clock = next((c for c in group.channels() if _has_clock(c)), None)
            if clock is not None and _WAVEFORM_CLOCK not in names:
                times = partial(_times, len(clock), dict(clock.properties), begun)
                channels.append(Channel(group.name, _WAVEFORM_CLOCK, times))
    return channel_table(path, channels, spec)


@contextmanager
def _opened(library: Any, path: Path) -> Iterator[Any]:
    library.log.log_manager.set_level(logging.ERROR)  # of a file cut off it reads what is there
    with path.open("rb") as stream, library.TdmsFile.open(stream) as file:
        yield file


def _values(library: Any, path: Path, group: str, name: str) -> RawColumn:
    with _opened(library, path) as file:
        return np.asarray(file[group][name][:])


def _has_clock(channel: Any) -> bool:
    step = channel.properties.get("wf_increment", 0.0)
    return isinstance(step, int | float) and step > 0 and len(channel) > 0


def _times(count: int, waveform: dict[str, Any], begun: np.datetime64 | None) -> RawColumn:
    offset = float(waveform.get("wf_start_offset", 0.0))
    start = waveform.get("wf_start_time")
    if begun is not None and start is not None:
        later = np.asarray([start, begun], "datetime64[ns]").astype(np.int64)
        offset += 1e-9 * float(later[0] - later[1])
    return offset + float(waveform["wf_increment"]) * np.arange(count)


def _first_start(file: Any) -> np.datetime64 | None:
    starts = [
        np.datetime64(channel.properties["wf_start_time"])
        for group in file.groups()
        for channel in group.channels()
        if "wf_start_time" in channel.properties
    ]
    return min(starts, default=None)
