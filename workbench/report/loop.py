"""Sections of a validation: verdict, steps and smooth reference in the simulated loop."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from design.loop import LoopRun
from workbench.cards.parameter_units import shown
from workbench.report.figures import (
    CONTROLLER_COLOURS,
    OTHER,
    figure,
    inline,
    label,
    line,
    style,
)
from workbench.report.page import Section, render
from workbench.report.validation_tables import VALIDATION_HEAD, validation_lines, validation_rows
from workbench.steps.validate import COMPENSATED, Traces, Validation

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DASHED = "--"  # with the compensator


def judged(found: Validation, rotary: bool) -> Section:
    """Every controller on every plant, and what it misses."""
    lines = validation_lines(found, rotary)
    html = render("table", head=VALIDATION_HEAD, rows=validation_rows(found, rotary), lines=lines)
    return Section("Verdict", html)


def loop(traces: Mapping[tuple[str, str], Traces], place: str, rotary: bool) -> Section:
    """Position, error and force in the loop on one plant, both controllers."""
    with style():
        drawn = loop_figure(traces, place, rotary)
        svg = inline(drawn, f"loop-{place}", "simulated loop: position, error and force")
    caption = (
        "The loop with the identified Karnopp friction and the logs' noise; broken lines: with the"
        " compensator."
        " Left and right have their own time axes."
    )
    title = "Loop on the identified plant" if place == "model" else "Loop on the other plant"
    return Section(title, render("figure", svg=svg, caption=caption))


def loop_figure(traces: Mapping[tuple[str, str], Traces], place: str, rotary: bool) -> "Figure":
    """The figure of `loop`."""
    units = shown(rotary)
    with style():
        drawn = figure(9.0, 6.2)
        axes = drawn.subplots(3, 2, sharex="col")
        runs = {name: run for (name, where), run in traces.items() if where == place}
        for column, kind in enumerate(("step", "smooth")):
            for number, (name, run) in enumerate(runs.items()):
                trace = run.step if kind == "step" else run.smooth
                _lines([row[column] for row in axes], trace, name, number == 0)
            axes[2][column].set_xlabel("time [s]")
        label(axes[0][0], "", f"position [{units.position}]", "steps")
        label(axes[0][1], "", "", "smooth reference")
        label(axes[1][0], "", f"error [{units.position}]")
        label(axes[2][0], "time [s]", f"applied force [{units.force}]")
        handles = axes[0][0].get_legend_handles_labels()
        drawn.legend(*handles, loc="outside upper right", ncols=5)
    return drawn


def _lines(axes: "list[Axes]", trace: LoopRun, name: str, first: bool) -> None:
    position, error, force = axes
    if first:
        line(position, trace.t, trace.r, color=OTHER, ls=":", label="reference")
    alone = name.removesuffix(COMPENSATED)
    colour, look = CONTROLLER_COLOURS[alone], "-" if alone == name else DASHED
    shown = name.replace(alone, alone.upper())
    line(position, trace.t, trace.y, color=colour, ls=look, label=shown)
    line(error, trace.t, trace.r - trace.y, color=colour, ls=look)
    line(force, trace.t, trace.F, color=colour, ls=look, lw=0.8)
