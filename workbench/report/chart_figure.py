"""A chart as a figure of matplotlib, for notebooks, `plot()` and PNG files, all in one look."""

import io
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import TYPE_CHECKING, Any

from identification.arrays import Array
from identification.signals.envelope import evenly_spread, thinned_together
from workbench.report.chart import Chart, Colour, Line, Panel

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Okabe and Ito's colours, which colour-blind readers can distinguish.
MEASURED, MODEL, REFERENCE, OTHER = "#000000", "#d55e00", "#0072b2", "#009e73"
BAND = "#e69f00"
GREY = "#7a7a7a"
BEFORE = "#8a8a8a"
LINE_POINTS = 1200  # of a line; more than a screen shows
FEW_DOTS = 200  # that are drawn larger
STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",
    "font.size": 9.0,
    "font.family": "sans-serif",
    "axes.grid": True,
    "grid.color": "#dddddd",
    "grid.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "lines.linewidth": 1.1,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "figure.constrained_layout.use": True,
}


@contextmanager
def style() -> Iterator[None]:
    """Matplotlib in the reports' look, as it was afterwards."""
    import matplotlib as mpl

    with mpl.rc_context(STYLE):
        yield


def figure(width: float, height: float) -> "Figure":
    """An empty figure [inch] without a window; a notebook shows it, whatever its backend."""
    return _figure_class()(figsize=(width, height))


@cache
def _figure_class() -> "type[Figure]":
    from matplotlib.figure import Figure

    class ShownFigure(Figure):
        def _repr_png_(self) -> bytes:
            out = io.BytesIO()
            self.savefig(out, format="png", dpi=110)
            return out.getvalue()

    return ShownFigure


def line(axes: "Axes", x: Array, y: Array, **style: Any) -> None:
    """A line of at most `LINE_POINTS` points that keeps every peak."""
    axes.plot(*thinned(x, y), **style)


def thinned(x: Array, y: Array, points: int = LINE_POINTS) -> tuple[Array, Array]:
    """Lowest and highest sample of equal blocks, in the order of time."""
    places, (found,) = thinned_together(x, [y], points)
    return places, found


def label(axes: "Axes", x: str, y: str, title: str = "") -> None:
    """Axis labels with units and a small title."""
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    if title:
        axes.set_title(title, loc="left", fontsize=9.5)


FIGURE_COLOURS: dict[Colour, str] = {
    "measured": MEASURED, "model": MODEL, "reference": REFERENCE, "other": OTHER,
    "before": BEFORE, "band": BAND, "quiet": GREY,
}  # fmt: skip
LINE_STYLES: dict[str, dict[str, Any]] = {
    "line": {}, "bold": {"lw": 1.8}, "dashed": {"ls": "--"}, "dotted": {"ls": ":"},
}  # fmt: skip
FIGURE_WIDTH, PANEL_HEIGHT = 9.0, 2.3  # inch


def chart_figure(chart: Chart) -> "Figure":
    """The same panels, lines, areas, bands and marks, without zoom."""
    rows = -(-len(chart.panels) // chart.columns)
    with style():
        drawn = figure(FIGURE_WIDTH, PANEL_HEIGHT * max(rows, 1.4))
        every = drawn.subplots(rows, chart.columns, squeeze=False).ravel()
        for axes, panel in zip(every, chart.panels, strict=False):
            _panel(axes, panel)
        for axes in every[len(chart.panels) :]:
            axes.remove()
        # One legend where a panel's names hold for all, else one a panel.
        used = every[: len(chart.panels)]
        legends = [axes.get_legend_handles_labels() for axes in used]
        handles, names = max(legends, key=lambda one: len(one[1]))
        if all(set(one) <= set(names) for _, one in legends):
            drawn.legend(handles, names, loc="outside upper right", ncols=4, markerscale=3)
            return drawn
        for axes in used:
            axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=4, markerscale=3)
    return drawn


def _panel(axes: "Axes", panel: Panel) -> None:
    for area in panel.areas:
        axes.fill_between(
            area.x, area.low, area.high, color=FIGURE_COLOURS[area.colour], alpha=0.4, lw=0,
            label=area.name,
        )  # fmt: skip
    for band in panel.bands:
        span = axes.axvspan if band.axis == "x" else axes.axhspan
        colour = FIGURE_COLOURS[band.colour]
        span(band.low, band.high, color=colour, alpha=0.25, lw=0, label=band.name)
    for mark in panel.marks:
        across = axes.axvline if mark.axis == "x" else axes.axhline
        across(mark.at, color=GREY, lw=0.8, ls="--")
    for one in panel.lines:
        _line(axes, one)
    if panel.log_x:
        axes.set_xscale("log")
    if panel.log_y:
        axes.set_yscale("log")
    if panel.names:
        axes.set_xticks(range(len(panel.names)), panel.names, rotation=20)
    if panel.x_range:
        axes.set_xlim(panel.x_range)
    if panel.y_range:
        axes.set_ylim(panel.y_range)
    label(axes, panel.x, panel.y, panel.title)


def _line(axes: "Axes", one: Line) -> None:
    colour = FIGURE_COLOURS[one.colour]
    if one.style == "dots":
        chosen = evenly_spread(len(one.x))
        axes.plot(
            one.x[chosen], one.y[chosen], ".", ms=3 if len(one.x) > FEW_DOTS else 7, mew=0,
            color=colour, alpha=0.6, rasterized=True, label=one.name,
        )  # fmt: skip
    else:
        line(axes, one.x, one.y, color=colour, label=one.name, **LINE_STYLES[one.style])
