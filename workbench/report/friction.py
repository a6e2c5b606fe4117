"""Section: friction against velocity, the data under the identified curve."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from identification.arrays import Array
from identification.log import Log
from identification.model.estimates import KarnoppFit
from identification.model.inverse_model import held_force
from identification.model.karnopp import NAMES, Karnopp
from identification.signals.differentiate import differentiate, low_pass
from workbench.cards.parameter_units import shown
from workbench.documents.model import Model
from workbench.report.figures import (
    BAND,
    MEASURED,
    MODEL,
    evenly_spread,
    figure,
    inline,
    label,
    style,
)
from workbench.report.page import Section, render

if TYPE_CHECKING:
    from matplotlib.axes import Axes

CURVES = 200
SLIDING_PARAMETERS = ("F_cp", "F_cn", "F_vp", "F_vn")
SHOWN_RANGE = 1.6  # of the curve's range shown; the force of a fast start lies far outside


@dataclass(frozen=True)
class FrictionData:
    """Velocity [m/s], acceleration [m/s^2] and friction force F_e - m a [N] of a log, (n,)."""

    v: Array
    a: Array
    F_f: Array


def friction_data(model: Model, log: Log) -> FrictionData:
    """What the log says of friction, force and motion smoothed alike."""
    motion = differentiate(log["y"], log.h)
    F = held_force(log["F"]) if model.rig.kind == "motor" else log["F"]
    F = low_pass(F, log.h, motion.cutoff)
    inner = slice(motion.edge, len(F) - motion.edge)
    return FrictionData(motion.v[inner], motion.a[inner], (F - model.karnopp.m * motion.a)[inner])


def friction_curve(model: Model, fit: KarnoppFit, log: Log) -> Section:
    """Friction of the log's samples against velocity, with the Karnopp curve and its band."""
    units = shown(model.rotary)
    data, p = friction_data(model, log), model.karnopp
    v_p = np.linspace(p.dv_p, max(float(data.v.max()), 1.2 * p.dv_p), 80)
    v_n = np.linspace(min(float(data.v.min()), 1.2 * p.dv_n), p.dv_n, 80)
    with style():
        drawn = figure(9.0, 4.6)
        axes = drawn.subplots()
        keep = evenly_spread(len(data.v))
        axes.plot(
            data.v[keep], data.F_f[keep], ".", ms=3.5, color=MEASURED, alpha=0.45, mew=0,
            rasterized=True, label="log: F_e − m a",
        )  # fmt: skip
        for v in (v_n, v_p):
            low, high = _interval(fit, p, v)
            first = v is v_n
            axes.fill_between(
                v, low, high, color=BAND, alpha=0.5, lw=0, label="95 % interval" if first else None
            )
            axes.plot(v, _slip(v, p), color=MODEL, lw=1.8, label="Karnopp model" if first else None)
        axes.plot([0, 0], [p.F_sn, p.F_sp], color=MODEL, lw=1.8, marker="_", ms=10)
        axes.axvspan(p.dv_n, p.dv_p, color="#0072b2", alpha=0.10, lw=0, label="stick band")
        _limits(axes, p, v_n[0], v_p[-1])
        axes.legend(loc="upper left", markerscale=2.5)
        label(axes, f"velocity [{units.velocity}]", f"friction force [{units.force}]")
        svg = inline(drawn, "friction", "friction force against velocity, data and model")
    return Section("Friction", render("figure", svg=svg, caption=_caption(model)))


def _slip(v: Array, p: Karnopp) -> Array:
    return np.where(v > 0, p.F_cp + p.F_vp * v, -p.F_cn + p.F_vn * v)


def _interval(fit: KarnoppFit, p: Karnopp, v: Array) -> tuple[Array, Array]:
    """95 % interval of the sliding friction at `v` over equally likely parameters."""
    nine = np.tile(p.array, (min(CURVES, len(fit.samples)), 1))
    drawn = fit.samples[evenly_spread(len(fit.samples), CURVES)][: len(nine)]
    for column, name in enumerate(fit.free):
        if name in NAMES:
            nine[: len(drawn), NAMES.index(name)] = drawn[:, column]
    F_cp, F_cn, F_vp, F_vn = (nine[:, NAMES.index(name), None] for name in SLIDING_PARAMETERS)
    curves = np.where(v > 0, F_cp + F_vp * v, -F_cn + F_vn * v)
    low, high = np.quantile(curves, [0.025, 0.975], axis=0)
    return low, high


def _limits(axes: "Axes", p: Karnopp, v_low: float, v_high: float) -> None:
    top = max(p.F_sp, p.F_cp + p.F_vp * v_high)
    bottom = min(p.F_sn, -p.F_cn + p.F_vn * v_low)
    axes.set_ylim(SHOWN_RANGE * bottom, SHOWN_RANGE * top)
    axes.set_xlim(1.05 * v_low, 1.05 * v_high)


def _caption(model: Model) -> str:
    text = (
        "Each dot is one sample: applied force less inertia, smoothed as the velocity is. Inside"
        " the shaded band the model sticks; there, friction takes any value between the two"
        " breakaway limits (the bar at zero)."
    )
    if model.friction["m"].value is None:
        text += " The mass is not identified, so the assumed one stands in for the inertia."
    return text
