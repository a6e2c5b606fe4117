"""Charts that zoom: lines, dots, shaded stretches in panels, as data for `assets/chart/chart.js`.

A `Chart` is a value; `chart_html` gives its place in a page, `chart_assets` what the page needs
once: uPlot, the script that draws, and their style, to be inlined or served as files.
"""

import base64
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any, Literal, NamedTuple

import numpy as np

from identification.arrays import Array
from identification.signals.envelope import thinned_together
from workbench.report.templating import render, safe

Colour = Literal["measured", "model", "reference", "other", "before", "band", "quiet"]
LineStyle = Literal["line", "bold", "dashed", "dotted", "dots"]

FIRST_VIEW = 4000  # points of a line at least: two on each pixel of a wide screen
FINEST_POINTS = 40_000  # points of a line at most
ALL_POINTS = 160_000  # of a chart's lines together; 0.9 MB in the page
EVEN = 1e-6  # of a step, within which a clock counts as even
LARGEST = 1e30  # number that is drawn; loops that run away go far beyond
DOT_SPREAD = 1e-6  # of the range, by which dots at the same place are set apart


@dataclass(frozen=True, eq=False)
class Line:
    """Values over x, both (n,), x ascending (of dots: any order); NaN parts a line.

    Lines of a panel that share one array `x` stay together sample by sample.
    """

    name: str
    x: Array
    y: Array
    colour: Colour = "model"
    style: LineStyle = "line"


@dataclass(frozen=True, eq=False)
class Area:
    """What lies between `low` and `high` over x, all (n,)."""

    name: str
    x: Array
    low: Array
    high: Array
    colour: Colour = "band"


class Band(NamedTuple):
    """A shaded stretch of an axis."""

    name: str
    low: float
    high: float
    axis: Literal["x", "y"] = "y"
    colour: Colour = "reference"


class Mark(NamedTuple):
    """A broken line across the panel."""

    at: float
    axis: Literal["x", "y"] = "y"


class Part(NamedTuple):
    """A named stretch of x that a reader may want to go to."""

    name: str
    low: float
    high: float


def parts_of(names: Sequence[str], begins: Sequence[float], ends: Sequence[float]) -> list[Part]:
    """The logs of these names, in a row; none of a single one, or where they are not all named."""
    if not len(names) == len(begins) > 1:
        return []
    return [Part(*one) for one in zip(names, begins, ends, strict=True)]


@dataclass(frozen=True, eq=False)
class Panel:
    """One pair of axes: `x` and `y` are their labels with unit.

    y_range: what the whole view holds (default: all lines); x_range likewise. names: what stands at
    x = 0, 1, ... in place of numbers.
    """

    x: str
    y: str
    lines: Sequence[Line]
    title: str = ""
    areas: Sequence[Area] = ()
    bands: Sequence[Band] = ()
    marks: Sequence[Mark] = ()
    x_range: tuple[float, float] | None = None
    y_range: tuple[float, float] | None = None
    log_x: bool = False
    log_y: bool = False
    names: Sequence[str] = ()
    height: int | None = None


@dataclass(frozen=True, eq=False)
class Chart:
    """Panels below each other, or two a row; `name` is its own on a page.

    description: what it shows, for those who do not see it. caption: below it. shared_x: all panels
    zoom together.
    """

    name: str
    description: str
    panels: Sequence[Panel]
    columns: Literal[1, 2] = 1
    shared_x: bool = True
    parts: Sequence[Part] = ()
    caption: str = ""


def chart_html(chart: Chart) -> Any:
    """The figure of a chart: its data as JSON, which the script of `chart_assets` draws."""
    # "<" could end the element that holds the data.
    data = json.dumps(chart_data(chart), allow_nan=False).replace("<", "\\u003c")
    return safe(render("chart", chart=chart, data=safe(data)))


def chart_data(chart: Chart) -> dict[str, Any]:
    """A chart as plain values of JSON.

    `name, shared_x, parts` and `panels`, each with labels, ranges, `bands`, `marks`; `tables`: for
    each x of its own `x` and the columns `y`, coded (`start, step, count`, or `type` and `base64`
    of little-endian numbers); `lines`: name, colour and look of every column in that order.
    """
    lines = [line for panel in chart.panels for line in _columns(panel)]
    points = int(np.clip(ALL_POINTS // max(len(lines), 1), FIRST_VIEW, FINEST_POINTS))
    return {
        "name": chart.name,
        "shared_x": chart.shared_x,
        "parts": [part._asdict() for part in chart.parts],
        "panels": [_panel(panel, points) for panel in chart.panels],
    }


@cache
def chart_assets() -> dict[str, str]:
    """Files that a page with charts needs, in this order, by name: two styles, two scripts."""
    folder = files("workbench") / "assets"
    names = ("uplot/uPlot.min.css", "chart/chart.css", "uplot/uPlot.iife.min.js", "chart/chart.js")
    return {name.split("/")[1]: (folder / name).read_text("utf-8") for name in names}


PANEL_KEYS = ("x", "y", "title", "x_range", "y_range", "log_x", "log_y", "names", "height")


class _Column(NamedTuple):
    """A column of numbers to draw, its name, colour and look as JSON has them; edges of an area
    come in pairs, the lower first."""

    x: Array
    y: Array
    entry: Mapping[str, Any]


def _columns(panel: Panel) -> list[_Column]:
    out = []
    for area in panel.areas:
        edge = {"colour": area.colour, "look": "edge"}
        out.append(_Column(area.x, area.low, {"name": "", **edge, "upper": False}))
        out.append(_Column(area.x, area.high, {"name": area.name, **edge, "upper": True}))
    for one in panel.lines:
        entry = {"name": one.name, "colour": one.colour, "look": one.style}
        out.append(_Column(one.x, one.y, entry))
    return out


def _panel(panel: Panel, points: int) -> dict[str, Any]:
    groups: list[list[_Column]] = []
    for column in _columns(panel):
        same = [g for g in groups if g[0].x is column.x and not _dots(g[0], column)]
        if same:
            same[0].append(column)
        else:
            groups.append([column])
    groups.sort(key=lambda group: not _dots(*group))  # lines are drawn over dots
    tables = [_table(group, points) for group in groups]
    return {
        **{key: getattr(panel, key) for key in PANEL_KEYS},
        "bands": [band._asdict() for band in panel.bands],
        "marks": [mark._asdict() for mark in panel.marks],
        "tables": tables,
        "lines": [column.entry for group in groups for column in group],
    }


def _dots(*columns: _Column) -> bool:
    return any(column.entry["look"] == "dots" for column in columns)


def _table(group: list[_Column], points: int) -> dict[str, Any]:
    x, values = np.asarray(group[0].x, dtype=np.float64), [column.y for column in group]
    if _dots(*group):
        order = np.argsort(x, kind="stable")
        x, values = x[order], [np.asarray(y)[order] for y in values]
        # Those at the same place would be drawn as one.
        x = x + DOT_SPREAD * np.ptp(x) * np.arange(len(x)) / max(len(x), 1) if len(x) else x
    else:
        x, values = thinned_together(x, values, points)
    return {"x": coded_x(x), "y": [coded(y, "f4") for y in values]}


def coded_x(x: Array) -> dict[str, Any]:
    """Places on an axis: start, step and count where they are even."""
    if len(x) > 2:
        step = (x[-1] - x[0]) / (len(x) - 1)
        even = x[0] + step * np.arange(len(x))
        if step > 0 and np.max(np.abs(x - even)) <= EVEN * step * len(x):
            return {"start": float(x[0]), "step": float(step), "count": len(x)}
    return coded(x, "f8")


def coded(values: Array, kind: Literal["f4", "f8"]) -> dict[str, Any]:
    """Numbers as base64; NaN where there is none, or none that can be drawn."""
    known = np.where(np.abs(values) < LARGEST, values, np.nan)
    plain = np.asarray(known, dtype=f"<{kind}")
    return {"type": kind, "base64": base64.b64encode(plain.tobytes()).decode("ascii")}
