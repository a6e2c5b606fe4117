"""A prediction in words and as a picture."""

from typing import TYPE_CHECKING

import numpy as np

from workbench.cards.parameter_units import shown
from workbench.report.figures import MEASURED, MODEL, OTHER, figure, inline, label, line, style
from workbench.report.page import Section, render
from workbench.steps.predict import Predicted

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def prediction_lines(found: Predicted, rotary: bool) -> list[str]:
    """How far the model lies from the log, and what to know of it, a line each."""
    summary = found.summary
    length, _, force, *_ = shown(rotary)
    by = "the command" if summary["drive"] == "command" else "the applied force"
    window = summary["window"]
    start = "free run" if window is None else f"restarted every {window} s"
    lines = []
    if summary["position_rms"] is not None:
        rms = f"{summary['position_rms']:.4g} {length} rms"
        lines.append(f"position ({start}, driven by {by}): {rms}")
    if summary["run_refused"] is not None:
        lines.append(f"position: {summary['run_refused']}")
    if summary["force_predicted_rms"] is not None:
        rms = f"{summary['force_predicted_rms']:.4g} {force} rms"
        lines.append(f"force, inverse model: {rms} while sliding, outside the stick band")
    if summary["force_simulated_rms"] is not None:
        lines.append(f"force, simulated: {summary['force_simulated_rms']:.4g} {force} rms")
    return [*lines, *(f"note: {remark}" for remark in summary["remarks"])]


def prediction_section(found: Predicted, rotary: bool) -> Section:
    """Position and force over time."""
    with style():
        drawn = prediction_figure(found, rotary)
        svg = inline(drawn, "prediction", "measured and predicted position and force over time")
    return Section("Over time", render("figure", svg=svg, caption="Nothing is fitted on this log."))


def prediction_figure(found: Predicted, rotary: bool) -> "Figure":
    """Position and force of the log and of the model over time, run after run."""
    units = shown(rotary)
    with style():
        drawn = figure(9.0, 5.0)
        position, force = drawn.subplots(2, 1, sharex=True)
        for number, run in enumerate(found.runs):
            pairs = (
                (position, run.position_measured, MEASURED, "-", "measured"),
                (position, run.position_simulated, MODEL, "--", "simulated"),
                (force, run.force_applied, MEASURED, "-", "applied"),
                (force, run.force_predicted, MODEL, "--", "predicted: inverse model"),
                (force, run.force_simulated, OTHER, "--", "simulated"),
            )
            for axes, values, colour, look, name in pairs:
                if np.any(np.isfinite(values)):
                    shown_as = name if number == 0 else None
                    line(axes, run.t, values, color=colour, ls=look, label=shown_as)
        for axes in (position, force):
            axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3)
        label(position, "", f"position [{units.position}]")
        label(force, "time [s]", f"force [{units.force}]")
    return drawn
