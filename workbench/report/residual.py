"""Section: what the model leaves, beside the sensors' noise."""

import numpy as np

from identification.arrays import Array
from identification.log import Log
from identification.model.inverse_model import SURE_SLIDING
from identification.signals.differentiate import differentiate
from identification.simulation.free_run import FreeRun
from workbench.cards.parameter_units import shown
from workbench.documents.model import Model
from workbench.report.figures import MODEL, REFERENCE, figure, inline, label, line, style
from workbench.report.friction import friction_data
from workbench.report.page import Section, render

BAND_ALPHA = 0.45


def residual(model: Model, log: Log, run: FreeRun | None) -> Section:
    """Position's and force's residual over time, with the noise that a perfect model leaves."""
    units = shown(model.rotary)
    t = log["t"] - log["t"][0]
    noise = model.fit.noise_y
    with style():
        drawn = figure(9.0, 4.4)
        top, bottom = drawn.subplots(2, 1, sharex=True)
        if run:
            line(top, t, log["y"] - run.y, color=MODEL)
        top.axhspan(
            -2 * noise, 2 * noise, color=REFERENCE, alpha=BAND_ALPHA, lw=0, zorder=3,
            label="±2σ of the sensor",
        )  # fmt: skip
        label(top, "", f"position [{units.position}]", "measured less simulated")
        drawn.legend(*top.get_legend_handles_labels(), loc="outside upper right")
        if run and model.rig.kind != "motor" and model.fit.drive == "command":
            sigma = 2 * model.fit.noise_F
            line(bottom, t, log["F"] - run.F, color=MODEL)
            bottom.axhspan(-sigma, sigma, color=REFERENCE, alpha=BAND_ALPHA, lw=0, zorder=3)
            title = "measured less simulated"
        else:
            times, left = _force_residual(model, log)
            bottom.plot(times, left, ".", ms=2.5, mew=0, color=MODEL, rasterized=True)
            title = "applied force less the equation of motion's, while sliding"
        label(bottom, "time [s]", f"force [{units.force}]", title)
        svg = inline(drawn, "residual", "residual of position and force over time")
    return Section("What the model leaves", render("figure", svg=svg, caption=_caption(model)))


def _force_residual(model: Model, log: Log) -> tuple[Array, Array]:
    """Times and friction data less Karnopp curve on sliding samples."""
    motion = differentiate(log["y"], log.h)
    data, p = friction_data(model, log), model.karnopp
    times = (log["t"] - log["t"][0])[motion.edge : len(log) - motion.edge]
    fast = np.abs(data.v) > SURE_SLIDING * motion.v_noise
    slides = fast & ((data.v > p.dv_p) | (data.v < p.dv_n))
    curve = np.where(data.v > 0, p.F_cp + p.F_vp * data.v, -p.F_cn + p.F_vn * data.v)
    index = np.flatnonzero(slides)
    index = index[:: max(1, len(index) // 6000)]
    return times[index], (data.F_f - curve)[index]


def _caption(model: Model) -> str:
    how = np.sqrt(model.fit.chi_square)
    if model.imposed:
        return "No position is simulated where the motion is imposed; below, the force's residual."
    if model.fit.adequate:
        return f"What is left is {how:.2f} times the sensors' noise: nothing is missing."
    return (
        f"What is left is {how:.3g} times the sensors' noise: the machine has an effect that the"
        " model has not, or another structure. The command workbench trace tells which."
    )
