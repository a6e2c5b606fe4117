"""MDF files (version 3 and 4: INCA, CANape, Vector, dSPACE), read by asammdf."""

import re
import traceback
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
    with _opened(library, path) as file:
        names = [_group_name(group, number) for number, group in enumerate(file.groups)]
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
def _opened(library: Any, path: Path) -> Iterator[Any]:
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


def _group_name(group: Any, number: int) -> str:
    channel_group = group.channel_group
    named = getattr(channel_group, "acq_name", "") or ""
    return str(named).strip() or f"group {number}"


def _values_of(library: Any, path: Path, group: int, index: int, clock: bool) -> RawColumn:
    with _opened(library, path) as file:
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
