"""Files of many channels in groups, each group with its own clock, as one table of columns: TDMS
(LabVIEW, DIAdem), MDF (INCA, CANape, Vector, dSPACE) and ULog (PX4).

Their readers are extras: a library is imported only where such a file is read.
"""

import importlib
import io
import logging
import re
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from design.machine.nearest import nearest
from identification.errors import BadLog
from workbench.cards.card_tables import FileSpec
from workbench.files import refuse_larger
from workbench.logs.table import BINARY_BYTES, RawColumn, Table, refuse_long


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


_WAVEFORM_CLOCK = "time"
"""Name of the column that a group gets where it has a waveform's clock and no channel of times."""


def read_tdms(path: Path, spec: FileSpec) -> Table:
    """The channels of the file by group.

    A group of waveforms has its clock as a column "time" [s], from the earliest start in the file.
    """
    refuse_larger(path, BINARY_BYTES, "a TDMS file", BadLog)
    library = optional("nptdms", "tdms", path)
    channels = list[Channel]()

    def values(group: str, name: str) -> RawColumn:
        with _opened_tdms(library, path) as file:
            return np.asarray(file[group][name][:])

    with _opened_tdms(library, path) as file:
        begun = _first_start(file)
        for group in file.groups():
            names = [channel.name for channel in group.channels()]
            for name, channel in zip(names, group.channels(), strict=True):
                refuse_long(path, len(channel))
                channels.append(Channel(group.name, name, partial(values, group.name, name)))
            clock = next((c for c in group.channels() if _has_clock(c)), None)
            if clock is not None and _WAVEFORM_CLOCK not in names:
                times = partial(_times, len(clock), dict(clock.properties), begun)
                channels.append(Channel(group.name, _WAVEFORM_CLOCK, times))
    return channel_table(path, channels, spec)


@contextmanager
def _opened_tdms(library: Any, path: Path) -> Iterator[Any]:
    library.log.log_manager.set_level(logging.ERROR)  # of a file cut off it reads what is there
    with path.open("rb") as stream, library.TdmsFile.open(stream) as file:
        yield file


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


_CLOCK_NAME = "time"
# asammdf hands a channel's formula to an evaluator of Python's expressions: only plain arithmetic
# of the raw value X may go there.
_ARITHMETIC = re.compile(r"(?:X1?|\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+|[-+*/^() \t])+")


def read_mdf(path: Path, spec: FileSpec) -> Table:
    """The channels of the file by group, each group with its clock as a column "time" [s].

    A group goes by its name in the file, or else by "group N", N counted from 0.
    """
    refuse_larger(path, BINARY_BYTES, "an MDF file", BadLog)
    library = optional("asammdf", "mdf", path)
    channels = list[Channel]()
    with _opened_mdf(library, path) as file:
        given = (getattr(group.channel_group, "acq_name", "") for group in file.groups)
        names = [str(name or "").strip() or f"group {k}" for k, name in enumerate(given)]
        for number, group in enumerate(file.groups):
            name = names[number]
            if names.count(name) > 1:
                name = f"{name} {names[:number].count(name)}"
            refuse_long(path, int(group.channel_group.cycles_nr))
            clock = file.masters_db.get(number)
            for index, channel in enumerate(group.channels):
                shown = _CLOCK_NAME if index == clock else channel.name
                where = (library, path, number, index, index == clock)
                channels.append(Channel(name, shown, partial(_values_of, *where)))
    return channel_table(path, channels, spec)


@contextmanager
def _opened_mdf(library: Any, path: Path) -> Iterator[Any]:
    """The file, open for reading: of a path asammdf copies one that its writer did not finish."""
    with path.open("rb") as stream:
        try:
            file = library.MDF(stream, process_bus_logging=False, use_display_names=False)
        except Exception as error:
            _close_half_read(error)
            raise
        with file:
            yield file


def _close_half_read(error: Exception) -> None:
    """Close what asammdf had read before the error; by itself it prints a traceback at its end."""
    for frame, _ in traceback.walk_tb(error.__traceback__):
        half: Any = frame.f_locals.get("self")
        if type(half).__name__ == "MDF4":
            half.header = half.identification = None  # which its close takes to be there
            half.close()


def _values_of(library: Any, path: Path, group: int, index: int, clock: bool) -> RawColumn:
    with _opened_mdf(library, path) as file:
        if clock:
            return np.asarray(file.get_master(group), dtype=np.float64)
        _refuse_formula(path, file.groups[group].channels[index])
        signal = file.get(group=group, index=index, ignore_invalidation_bits=True)
        values = np.asarray(signal.samples)
        if signal.invalidation_bits is None or values.dtype.kind not in "fiub":
            return values
        return np.where(np.asarray(signal.invalidation_bits), np.nan, values)


def _refuse_formula(path: Path, channel: Any) -> None:
    formula = getattr(channel.conversion, "formula", "") or ""
    if formula and not _ARITHMETIC.fullmatch(str(formula)):
        raise BadLog(
            f"{path}: channel {channel.name!r} is converted by the formula {str(formula)[:60]!r},"
            " which is not run; export it with its physical values"
        )


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
    channels = list[Channel]()
    for message in file.data_list:
        group = f"{message.name}[{message.multi_id}]" if message.multi_id else message.name
        for name, values in message.data.items():
            refuse_long(path, len(values))
            channels.append(Channel(group, name, partial(np.asarray, values)))
    return channel_table(path, channels, spec)
