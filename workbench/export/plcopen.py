"""A controller as PLCopen XML (TC6, version 2.01): the blocks of the Structured Text."""

from datetime import datetime
from importlib.metadata import version

from workbench.export.exported import Exported
from workbench.export.filled import filled, lead_of, title_of
from workbench.export.structured_text import blocks

ELEMENTARY = ("BOOL", "DINT", "REAL", "LREAL")


def plcopen_file(what: Exported, now: datetime) -> dict[str, str]:
    """A project with the controller's block and the one that tests it."""
    text = filled(
        "project.xml",
        markup=True,
        title=title_of(what),
        lead=lead_of(what),
        name=what.program.name,
        version=version("servo-workbench"),
        now=now.isoformat(timespec="seconds"),
        elementary=ELEMENTARY,
        blocks=blocks(what),
    )
    return {f"{what.program.name}.xml": text}
