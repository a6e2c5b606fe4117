"""Section of a trace: friction against velocity, by the model before and after."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from identification.arrays import Array
from identification.effects._base import Acting
from identification.model.karnopp import NAMES, Karnopp
from identification.simulation.effect_along_motion import contribution
from identification.tracing.result import Trace
from workbench.cards.parameter_units import shown
from workbench.documents.model import used
from workbench.report.figures import (
    MEASURED,
    MODEL,
    REFERENCE,
    evenly_spread,
    figure,
    inline,
    label,
    style,
)
from workbench.report.friction import SHOWN_RANGE, friction_data
from workbench.report.page import Section, render
from workbench.report.trace_tables import words
from workbench.steps.trace import Traced

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Curve = tuple[Karnopp, list[Acting], str, str]  # a model, its effects of speed, colour and name
CURVE = 160  # points of a friction curve


def friction_before_after(traced: Traced) -> Section:
    """Friction against velocity, the whole and without its viscous part, before and after.

    Where the machine has drifted without lacking an effect, on training and test logs.
    """
    with style():
        drawn = friction_figure(traced)
        svg = inline(drawn, "trace-friction", "friction against velocity, before and after")
    speeds = _of_speed(traced)
    other = [words(a.key) for a in traced.model.acting if a not in speeds]
    caption = "Dots: the log's samples, smoothed. The bar at 0 spans the breakaway limits."
    if other:
        caption += f" Not a function of velocity, so not in the curve: {', '.join(other)}."
    return Section("Friction", render("figure", svg=svg, caption=caption))


def _of_speed(traced: Traced) -> list[Acting]:
    """The effects that are a function of velocity."""
    every = traced.model.acting
    return [a for a in every if a.effect.place.rubs and a.effect.depends_on == ("v",)]


def friction_figure(traced: Traced) -> "Figure":
    """The figure of `friction_before_after`."""
    found, model = traced.trace, traced.model
    units, after = shown(model.rotary), model.karnopp
    speeds = _of_speed(traced)
    curves = _curves(found, after, speeds)
    source = traced.test[0] if _drifted(found) and traced.test else traced.train[0]
    data = friction_data(model, source.log)
    reach = max(float(np.quantile(np.abs(data.v), 0.999)), 2 * max(after.dv_p, -after.dv_n))
    keep = evenly_spread(len(data.v))
    v, F_f = data.v[keep], data.F_f[keep]
    with style():
        drawn = figure(9.0, 3.8)
        whole, dry = drawn.subplots(1, 2)
        for axes, bare in ((whole, False), (dry, True)):
            axes.plot(
                v, F_f - bare * viscous(v, after), ".", ms=3.0, color=MEASURED, alpha=0.3, mew=0,
                rasterized=True, label=f"{source.file}: F_e − m a",
            )  # fmt: skip
            _friction_lines(axes, curves, reach, after if bare else None)
        label(whole, f"velocity [{units.velocity}]", f"friction force [{units.force}]")
        label(dry, f"velocity [{units.velocity}]", "", "less the viscous part")
        lines = dict(zip(*reversed(whole.get_legend_handles_labels()), strict=True))
        drawn.legend(
            lines.values(), lines.keys(), loc="outside upper right", ncols=3, markerscale=3
        )
    return drawn


def _drifted(found: Trace) -> bool:
    return bool(found.drift) and not found.effects


def _curves(found: Trace, after: Karnopp, speeds: list[Acting]) -> list[Curve]:
    """Models whose friction is drawn."""
    if found.effects:
        before = Karnopp(**{name: used(found.parameters_before[name]) for name in NAMES})
        return [(before, [], REFERENCE, "before"), (after, speeds, MODEL, "after")]
    if not _drifted(found):
        return [(after, speeds, MODEL, "model")]
    changed = {one.name: max(one.after, 0.0) for one in found.drift if one.name in NAMES}
    return [
        (after, [], REFERENCE, "on the training logs"),
        (replace(after, **changed), [], MODEL, "on the test logs"),
    ]


def _friction_lines(axes: "Axes", curves: list[Curve], reach: float, less: Karnopp | None) -> None:
    """Friction of each model up to `reach` [m/s]; less: without the viscous part of this one."""
    top = 0.0
    for p, acting, colour, name in curves:
        for low, high in ((-reach, p.dv_n), (p.dv_p, reach)):
            at = np.linspace(low, high, CURVE)
            F = sliding_friction(at, p, acting) - (viscous(at, less) if less else 0.0)
            axes.plot(at, F, color=colour, lw=1.8, label=name)
            top = max(top, float(np.max(np.abs(F))))
        axes.plot([0, 0], [p.F_sn, p.F_sp], color=colour, marker="_", ms=9, lw=1.2)
        top = max(top, p.F_sp, -p.F_sn)
    axes.set_ylim(-SHOWN_RANGE * top, SHOWN_RANGE * top)


def viscous(v: Array, p: Karnopp) -> Array:
    """Viscous part of Karnopp's friction at `v` [m/s], (n,) [N]."""
    return np.asarray(np.where(v > 0, p.F_vp, p.F_vn) * v)


def sliding_friction(v: Array, p: Karnopp, acting: list[Acting]) -> Array:
    """Friction while sliding at `v` [m/s], (n,): Karnopp's and what effects of speed add [N]."""
    d = np.sign(v)
    blank = np.zeros(len(v))
    signals = {"t": blank, "y": blank, "F": blank, "u": blank, "v": v, "d": d}
    plain = np.where(v > 0, p.F_cp, -p.F_cn) + viscous(v, p)
    more = [d * contribution(a.effect, a.values, signals, 1e-3, p) for a in acting]
    return np.asarray(plain + np.sum(more, axis=0)) if more else plain
