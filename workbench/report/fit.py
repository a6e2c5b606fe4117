"""Section: measured and simulated position and force over time."""

from typing import TYPE_CHECKING

import numpy as np

from identification.arrays import Array
from identification.log import Log
from identification.model.inverse_model import Smoothing, force_predicted
from identification.simulation.free_run import FreeRun
from workbench.cards.parameter_units import shown
from workbench.documents.model import Model
from workbench.report.figures import MEASURED, MODEL, figure, inline, label, line, style
from workbench.report.model_tables import held
from workbench.report.page import Section, render

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ZOOM = 0.12  # part of the log shown enlarged


def fit(model: Model, log: Log, run: FreeRun | None) -> Section:
    """Position and force of one log, the whole of it and its liveliest part."""
    with style():
        drawn = fit_figure(model, log, run)
        svg = inline(drawn, "fit", "measured and simulated position and force over time")
    return Section("Fit over time", render("figure", svg=svg, caption=_caption(model)))


def fit_figure(model: Model, log: Log, run: FreeRun | None) -> "Figure":
    """The figure of `fit`."""
    units = shown(model.rotary)
    t = log["t"] - log["t"][0]
    position = run.y if run else None
    predicted = run.F if run else log["F"]
    if model.fit.drive == "force" or model.rig.kind == "motor":
        how = Smoothing(held=model.rig.kind == "motor")
        predicted = force_predicted(log, model.karnopp, how)
    with style():
        drawn = figure(9.0, 5.0)
        axes = drawn.subplots(2, 2, width_ratios=[1.5, 1.0])
        part = liveliest(log["y"])
        for column, where in enumerate((slice(None), part)):
            for row, (name, simulated) in enumerate((("y", position), ("F", predicted))):
                at = axes[row][column]
                line(at, t[where], log[name][where], color=MEASURED, label="measured")
                if simulated is not None:
                    line(at, t[where], simulated[where], color=MODEL, ls="--", label="model")
        label(axes[0][0], "", f"position [{units.position}]", "whole log")
        label(axes[0][1], "", "", "its liveliest part")
        label(axes[1][0], "time [s]", f"applied force [{units.force}]")
        label(axes[1][1], "time [s]", "")
        drawn.legend(*axes[1][0].get_legend_handles_labels(), loc="outside upper right", ncols=2)
    return drawn


def _caption(model: Model) -> str:
    inverse = " The model's force is that of the inverse model: what this motion needs."
    if model.imposed:
        return f"The motion is imposed, so no position is simulated.{inverse}"
    if model.fit.drive == "command":
        return (
            "The model is driven by the logged command alone, from the start of the log; it never"
            f" sees the measured position.{inverse if model.rig.kind == 'motor' else ''}"
        )
    return (
        f"The model is driven by the measured force, {held(model)}: a free run on a measured force"
        f" drifts at every stop.{inverse}"
    )


def liveliest(y: Array) -> slice:
    """The stretch of the log in which the position moves most."""
    size = max(50, round(ZOOM * len(y)))
    way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(y)))])
    if len(y) <= size:
        return slice(0, len(y))
    # Blocks keep the noise of a fast log from counting as motion.
    block = max(1, size // 50)
    coarse = y[::block]
    way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(coarse)))])
    wide = max(2, size // block)
    gain = way[wide:] - way[:-wide]
    start = int(np.argmax(gain)) * block if gain.size else 0
    return slice(start, min(start + size, len(y)))
