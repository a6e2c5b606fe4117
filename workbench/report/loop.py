"""Sections of a validation: verdict, steps and smooth reference in the simulated loop."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from design.loop import LoopRun
from workbench.cards.parameter_units import shown
from workbench.report.figures import (
    CONTROLLER_COLOURS,
    GREY,
    OTHER,
    figure,
    inline,
    label,
    line,
    style,
)
from workbench.report.page import Section, render
from workbench.report.validation_tables import validation_head, validation_lines, validation_rows
from workbench.steps.loop_figures import COMPENSATED, PRESENT, Traces
from workbench.steps.validate import Validation

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DASHED = "--"  # with the compensator


def judged(found: Validation, rotary: bool) -> Section:
    """Every controller on every plant, and what it misses."""
    lines = validation_lines(found, rotary)
    head, rows = validation_head(found, rotary), validation_rows(found, rotary)
    html = render("table", head=head, rows=rows, lines=lines)
    return Section("Verdict", html)


def loop(
    found: Validation, traces: Mapping[tuple[str, str], Traces], place: str, rotary: bool
) -> Section:
    """Position, error, force and command in the loop on one plant, all controllers."""
    units, first = shown(rotary), found.figures[found.judged][place]
    limit = first.command_limit
    unit = first.command_unit if first.command_peak is not None else units.force
    with style():
        drawn = figure(9.0, 7.8)
        axes = drawn.subplots(4, 2, sharex="col")
        runs = {name: run for (name, where), run in traces.items() if where == place}
        for column, kind in enumerate(("step", "smooth")):
            for number, (name, run) in enumerate(runs.items()):
                trace = run.step if kind == "step" else run.smooth
                _lines([row[column] for row in axes], trace, name, number == 0)
            axes[3][column].set_xlabel("time [s]")
            for edge in () if limit is None else (-limit, limit):
                axes[3][column].axhline(edge, color=GREY, ls="--", lw=0.8)
        label(axes[0][0], "", f"position [{units.position}]", "steps")
        label(axes[0][1], "", "", "smooth reference")
        label(axes[1][0], "", f"error [{units.position}]")
        label(axes[2][0], "", f"applied force [{units.force}]")
        label(axes[3][0], "time [s]", f"command [{unit}]")
        handles = axes[0][0].get_legend_handles_labels()
        drawn.legend(*handles, loc="outside upper right", ncols=6)
        svg = inline(drawn, f"loop-{place}", "simulated loop: position, error, force, command")
    caption = (
        "The loop with the identified Karnopp friction and the logs' noise; broken lines: with the"
        " compensator; the command's limits are broken grey lines."
        " Left and right have their own time axes."
    )
    title = "Loop on the identified plant" if place == "model" else "Loop on the other plant"
    return Section(title, render("figure", svg=svg, caption=caption))


def _lines(axes: "list[Axes]", trace: LoopRun, name: str, first: bool) -> None:
    position, error, force, command = axes
    if first:
        line(position, trace.t, trace.r, color=OTHER, ls=":", label="reference")
    alone = name.removesuffix(COMPENSATED)
    colour, look = CONTROLLER_COLOURS[alone], "-" if alone == name else DASHED
    shown = name if alone == PRESENT else name.replace(alone, alone.upper())
    line(position, trace.t, trace.y, color=colour, ls=look, label=shown)
    line(error, trace.t, trace.r - trace.y, color=colour, ls=look)
    line(force, trace.t, trace.F, color=colour, ls=look, lw=0.8)
    line(command, trace.t, trace.u, color=colour, ls=look, lw=0.8)
