"""The effects that a trace.json leaves open."""

from pathlib import Path

from design.experiment.planned import rivals_of
from design.machine.model import Model
from identification.effects._library import Library
from identification.errors import BadModel
from workbench.documents.reading import read_raw


def read_rivals(path: Path, model: Model, library: Library) -> tuple[str, ...]:
    """Keys of the effects that a trace.json leaves open: its rivals where it calls them
    inseparable, else every effect of the library that the machine's signals allow.

    Raises BadModel where the file is no trace, or leaves nothing open.
    """
    found = read_raw(path, "trace/1")
    if found.get("verdict") not in ("inseparable", "unknown"):
        raise BadModel(
            f"{path}: its verdict is {found.get('verdict')!r}; there are rivals to discriminate"
            " where it is 'inseparable' or 'unknown'"
        )
    return rivals_of(found, model, library)
