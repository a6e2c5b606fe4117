"""Which effects a run is to discriminate: those that a trace could not."""

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from identification.effects._library import Library
from identification.errors import BadModel
from workbench.documents.model import Model

SAID_EQUAL = re.compile(r"explains as much as (\w+) on these logs")  # as a trace says it of a rival


def read_rivals(path: Path, model: Model, library: Library) -> tuple[str, ...]:
    """Keys of the effects that a trace.json leaves open: its rivals where it calls them
    inseparable, else every effect of the library that the machine's signals allow.

    Raises BadModel where the file is no trace, or leaves nothing open.
    """
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise BadModel(f"{path}: cannot be read as trace.json ({error}); give one") from None
    if not isinstance(found, dict) or found.get("schema") != "trace/1":
        raise BadModel(f"{path}: no schema 'trace/1'; give the trace.json of 'workbench trace'")
    if found.get("verdict") not in ("inseparable", "unknown"):
        raise BadModel(
            f"{path}: its verdict is {found.get('verdict')!r}; there are rivals to discriminate"
            " where it is 'inseparable' or 'unknown'"
        )
    return rivals_of(found, model, library)


def rivals_of(found: Mapping[str, Any], model: Model, library: Library) -> tuple[str, ...]:
    """The same of what trace.json holds."""
    if found["verdict"] == "unknown":
        usable = (key for key, one in library.items() if not one.signals)
        return tuple(key for key in usable if key not in model.effects)
    keys = [str(one["key"]) for one in found["effects"]]
    for one in found["rivals"]:
        equal = SAID_EQUAL.match(str(one["why_not"]))
        if equal:
            keys += [equal[1], str(one["key"])]
    return tuple(key for key in dict.fromkeys(keys) if key in library)
