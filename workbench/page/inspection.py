"""What the page asks of a log and of a version's documents, as functions that run in a process of
their own.

Each takes paths and texts and gives plain values; errors of the user are `UserError`.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.errors import UserError
from workbench.page.dropped import without_path

if TYPE_CHECKING:
    from design.first_card.proposal import Proposal
    from design.machine.design import Design
    from design.machine.model import Identifiable
    from identification.arrays import Array
    from identification.columns.log_columns import UnknownLog
    from workbench.report.chart import Colour, LineStyle

MOST_COLUMNS = 12  # that the first picture shows
FIRST_POINTS = 8000  # of each column's line, every peak kept
LOGS_REMEMBERED = 1
FIRST_BYTES = 65_536  # by which a text is known
UTF16 = (b"\xff\xfe", b"\xfe\xff")
STYLES_OF: "Mapping[str, LineStyle]" = {"rst": "line", "pid": "dashed", "p-pi": "dotted"}
EXPORTS = {
    "c": "C99",
    "st": "Structured Text",
    "plcopen": "PLCopen XML",
    "fmu": "FMU 3.0",
    "json": "JSON",
    "mat": "MAT",
}


class BadView(UserError):
    """What is wrong with a log or its card, without the server's folders in it."""


@dataclass(frozen=True)
class DoctorFound:
    """The doctor's words: verdict, lines by label, and what each parameter can be known by."""

    verdict: str
    lines: tuple[str, ...]
    identifiability: tuple[tuple[str, bool, str], ...]


def warm() -> None:
    """Import what the work on a log needs, and compile or load their kernels' module."""
    import pandas  # noqa: F401
    import pyarrow.parquet  # noqa: F401

    import workbench.export.targets
    import workbench.report.chart
    import workbench.report.doctor
    import workbench.report.reports
    import workbench.steps.doctor
    import workbench.steps.first_card.proposal  # noqa: F401


def refuse_no_log(path: Path) -> None:
    """Raises BadView where the file's first bytes are of something else than its name says."""
    from workbench.cards.card_tables import FileSpec
    from workbench.logs.packed import text_bytes
    from workbench.logs.tables import checked_format

    with _without(path):
        form = checked_format(path, FileSpec())
        head = text_bytes(path, FIRST_BYTES) if form == "csv" else b""
    if b"\0" in head and not head.startswith(UTF16):
        raise BadView(
            f"{path.name}: is a binary file, no text as its ending says; drop the log as text, or"
            " by the ending of its format"
        )


def columns_chart(path: Path, file: str) -> tuple[str, int]:
    """Every column of the file over its clock, as HTML, and how many rows it has."""
    from identification.signals.envelope import thinned_together
    from workbench.report.chart import Chart, Line, Panel, chart_html

    found = _unknown(path)
    rows = max(len(one.values) for one in found.columns)
    x, label, at = _clock(found)
    shown = [one for k, one in enumerate(found.columns) if k != at and not one.unusable]
    shown = shown[:MOST_COLUMNS]
    places, values = thinned_together(x, [one.values for one in shown], FIRST_POINTS)
    panels = [
        Panel("", _label(one), [Line(_label(one), places, y, "measured")], height=150)
        for one, y in zip(shown, values, strict=True)
    ]
    panels[-1:] = [replace(one, x=label) for one in panels[-1:]]
    chart = Chart("columns", f"the columns of {file} over time", panels)
    return str(chart_html(chart)), rows


def proposal(path: Path) -> "Proposal":
    """The card that `init` proposes, and what is hardly identifiable from the log; raises
    BadView."""
    from workbench.steps.first_card.proposal import proposed
    from workbench.steps.first_card.written import checked_proposal

    with _without(path):
        return checked_proposal(proposed(path))


def headers(path: Path) -> list[tuple[str, str | int, str]]:
    """The columns of the file: how each is shown, and what a card calls it."""
    found = _unknown(path)
    return [(_label(one), one.key, one.unusable) for one in found.columns]


def card_refused(card: Path, path: Path) -> str:
    """Why the card is none or does not read the log, in one line; empty where it does."""
    from workbench.steps.first_card.written import refusal

    return without_path(refusal(path, card), [path, card])


def doctor_chart(path: Path, card: Path) -> str:
    """The doctor's picture, as HTML; raises BadView."""
    from workbench.cards.card import load_card
    from workbench.report.chart import chart_html
    from workbench.report.doctor import doctor_charts
    from workbench.steps.doctor import checked_log

    with _without(path, card):
        found = checked_log(path, load_card(card, with_recipe=False))
    return "".join(str(chart_html(chart)) for chart in doctor_charts(found))


def doctor_words(path: Path, card: Path) -> DoctorFound:
    """The doctor's words; raises BadView."""
    from workbench.cards.card import load_card
    from workbench.report.doctor import doctor_screen
    from workbench.steps.doctor import examine

    with _without(path, card):
        found = examine(path, load_card(card, with_recipe=False))
    lines = without_path(doctor_screen(found, None).text(), [path, card]).splitlines()
    identifiability = tuple((one.name, one.can, _said_of(one)) for one in found.identifiability)
    return DoctorFound(found.verdict, tuple(lines), identifiability)


def _said_of(one: "Identifiable") -> str:
    """Why a parameter is identifiable, on what that depends, or what run would identify it."""
    if one.only_if:
        return f"only if {one.only_if}"
    return one.why if one.can else one.add or one.why


def _unknown(path: Path) -> "UnknownLog":
    with _without(path):
        return _read(path, path.stat().st_mtime_ns)


@contextmanager
def _without(*paths: Path) -> Iterator[None]:
    """Within the block an error of the user becomes BadView, without the folders of these files."""
    try:
        yield
    except UserError as error:
        raise BadView(without_path(str(error), paths)) from None


@lru_cache(maxsize=LOGS_REMEMBERED)
def _read(path: Path, _mtime_ns: int) -> "UnknownLog":
    from workbench.logs.unknown import read_unknown

    return read_unknown(path)


def _clock(found: "UnknownLog") -> "tuple[Array, str, int | None]":
    """The first column that always goes up, its label and place; the rows' number without one."""
    for k, one in enumerate(found.columns):
        if not one.unusable and np.all(np.diff(one.values) > 0.0):
            return one.values, _label(one), k
    rows = max(len(one.values) for one in found.columns)
    return np.arange(rows, dtype=np.float64), "row", None


def _label(one: Any) -> str:
    name = one.header or f"column {one.number}"
    return f"{name} [{one.unit_below}]" if one.unit_below else name


@dataclass(frozen=True)
class LoopsFound:
    """Designs side by side: margins as a table, and the step response of each as HTML."""

    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    chart: str
    said: Sequence[str]


def export_files(design: str, target: str) -> dict[str, bytes]:
    """The files of the target, by name, of a design's document as text; raises UserError."""
    from design.generated.exported import exported
    from workbench.export.targets import writers

    made = writers(datetime.now(UTC))[target](exported(_design(design)))
    return {
        name: content.encode("utf-8") if isinstance(content, str) else bytes(content)
        for name, content in made.items()
    }


def design_page(design: str) -> str:
    """The report of a design's document."""
    from workbench.report.view import view

    return view(_design(design)).page()


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
            found = _design(text)
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


def _design(text: str) -> "Design":
    """The design of a document as text, read as from its file; raises UserError."""
    from workbench.documents.reading import Stored
    from workbench.documents.result_files import read_design

    return read_design(Stored("design.json", json.loads(text)))
