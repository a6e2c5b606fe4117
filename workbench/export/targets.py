"""The targets of an export, and what makes the files of each."""

from collections.abc import Callable, Mapping
from datetime import datetime
from functools import partial
from typing import Any

from design.generated.c import c_files
from design.generated.exported import Exported
from design.generated.structured_text import plcopen_file, st_file
from workbench.export.data import json_file, mat_file
from workbench.export.filled import filled
from workbench.export.fmu import fmu_file


def writers(now: datetime) -> Mapping[str, Callable[[Exported], Mapping[str, Any]]]:
    """What makes the files of a target, by its name."""
    return {
        "c": partial(c_files, filled=filled),
        "st": partial(st_file, filled=filled),
        "plcopen": partial(plcopen_file, now=now.isoformat(timespec="seconds"), filled=filled),
        "fmu": fmu_file,
        "json": json_file,
        "mat": mat_file,
    }
