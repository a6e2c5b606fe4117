"""What the page asks of a version's documents, as functions that run in a process of their own."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING

from identification.errors import UserError

STYLES_OF: "Mapping[str, LineStyle]" = {"rst": "line", "pid": "dashed", "p-pi": "dotted"}

if TYPE_CHECKING:
    from workbench.documents.design import Design
    from workbench.report.chart import Colour, LineStyle

EXPORTS = {
    "c": "C99",
    "st": "Structured Text",
    "plcopen": "PLCopen XML",
    "fmu": "FMU 3.0",
    "json": "JSON",
    "mat": "MAT",
}


@dataclass(frozen=True)
class LoopsFound:
    """Designs side by side: margins as a table, and the step response of each as HTML."""

    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    chart: str
    said: Sequence[str]


def export_files(design: str, target: str) -> dict[str, bytes]:
    """The files of the target, by name, of a design's document as text; raises UserError."""
    from workbench.export.exported import exported
    from workbench.export.targets import writers

    made = writers(datetime.now(UTC))[target](exported(_read(design)))
    return {
        name: content.encode("utf-8") if isinstance(content, str) else bytes(content)
        for name, content in made.items()
    }


def design_page(design: str) -> str:
    """The report of a design's document."""
    from workbench.report.reports import design_view

    found = _read(design)
    return design_view(found, found.motion == "rotary").page()


def loops(designs: Sequence[tuple[int, str]]) -> LoopsFound:
    """Designs of versions by their numbers, each as text, side by side."""
    from workbench.report.chart import Chart, Line, Mark, Panel, chart_html
    from workbench.report.design_tables import DESIGN_HEAD, margins_table
    from workbench.report.reports import linear_step

    rows: list[Sequence[str]] = []
    lines: list[Line] = []
    said: list[str] = []
    for place, (number, text) in enumerate(designs):
        try:
            found = _read(text)
            rows += [(f"version {number}", *row) for row in margins_table(found).whole]
            for name, one in found.controllers.items():
                t, y = linear_step(found, one)
                colour: Colour = "reference" if place else "model"
                style = STYLES_OF[name]
                lines.append(Line(f"{number}: {name.upper()}", t, y, colour, style))
            if found.recommendation:
                said.append(f"version {number}: {found.recommendation.why}")
        except UserError as error:
            said.append(f"version {number}: {error}")
    if not lines:
        return LoopsFound((), (), "", said)
    panel = Panel("time [s]", "position / step", lines, marks=[Mark(1.0, "y")])
    chart = Chart("steps", "linear step response of each version's controllers", [panel])
    return LoopsFound(("", *DESIGN_HEAD), rows, str(chart_html(chart)), said)


def _read(text: str) -> "Design":
    """The design of a document as text, read as from its file; raises UserError."""
    from workbench.documents.design_file import read_design
    from workbench.documents.reading import Stored

    return read_design(Stored("design.json", json.loads(text)))
