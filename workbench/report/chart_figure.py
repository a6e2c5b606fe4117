"""A chart as a figure of matplotlib, for notebooks and `plot()`."""

from typing import TYPE_CHECKING, Any

from workbench.report.chart import Band, Chart, Colour, Line, Mark, Panel
from workbench.report.figures import (
    BAND,
    BEFORE,
    GREY,
    MEASURED,
    MODEL,
    OTHER,
    REFERENCE,
    evenly_spread,
    figure,
    label,
    line,
    style,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FIGURE_COLOURS: dict[Colour, str] = {
    "measured": MEASURED,
    "model": MODEL,
    "reference": REFERENCE,
    "other": OTHER,
    "before": BEFORE,
    "band": BAND,
    "quiet": GREY,
}
LOOKS: dict[str, dict[str, Any]] = {
    "line": {},
    "bold": {"lw": 1.8},
    "dashed": {"ls": "--"},
    "dotted": {"ls": ":"},
}
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
        _legend(drawn, every.tolist()[: len(chart.panels)])
    return drawn


def _legend(drawn: "Figure", every: "list[Axes]") -> None:
    """One legend where a panel's names hold for all, else one a panel."""
    legends = [axes.get_legend_handles_labels() for axes in every]
    handles, names = max(legends, key=lambda one: len(one[1]))
    if all(set(one) <= set(names) for _, one in legends):
        drawn.legend(handles, names, loc="outside upper right", ncols=4, markerscale=3)
        return
    for axes in every:
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=4, markerscale=3)


def _panel(axes: "Axes", panel: Panel) -> None:
    for area in panel.areas:
        axes.fill_between(
            area.x, area.low, area.high, color=FIGURE_COLOURS[area.colour], alpha=0.4, lw=0,
            label=area.name,
        )  # fmt: skip
    for band in panel.bands:
        _band(axes, band)
    for mark in panel.marks:
        _mark(axes, mark)
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


def _band(axes: "Axes", band: Band) -> None:
    span = axes.axvspan if band.axis == "x" else axes.axhspan
    span(band.low, band.high, color=FIGURE_COLOURS[band.colour], alpha=0.25, lw=0, label=band.name)


def _mark(axes: "Axes", mark: Mark) -> None:
    across = axes.axvline if mark.axis == "x" else axes.axhline
    across(mark.at, color=GREY, lw=0.8, ls="--")


def _line(axes: "Axes", one: Line) -> None:
    colour = FIGURE_COLOURS[one.colour]
    if one.look == "dots":
        keep = evenly_spread(len(one.x))
        axes.plot(
            one.x[keep], one.y[keep], ".", ms=3, mew=0, color=colour, alpha=0.6, rasterized=True,
            label=one.name,
        )  # fmt: skip
    else:
        line(axes, one.x, one.y, color=colour, label=one.name, **LOOKS[one.look])
