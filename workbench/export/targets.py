"""The targets of an export, and what makes the files of each."""

from collections.abc import Callable, Mapping
from datetime import datetime
from typing import Any

from workbench.export.c import c_files, fmu_file
from workbench.export.data import json_file, mat_file
from workbench.export.exported import Exported
from workbench.export.structured_text import plcopen_file, st_file


def writers(now: datetime) -> Mapping[str, Callable[[Exported], Mapping[str, Any]]]:
    """What makes the files of a target, by its name."""
    return {
        "c": c_files,
        "st": st_file,
        "plcopen": lambda what: plcopen_file(what, now),
        "fmu": fmu_file,
        "json": json_file,
        "mat": mat_file,
    }
