"""Section of a trace: friction against velocity, by the model before and after."""

from dataclasses import replace

import numpy as np

from identification.arrays import Array
from identification.effects._base import Acting
from identification.model.karnopp import NAMES, Karnopp
from identification.simulation.effect_along_motion import contribution
from identification.tracing.result import Trace
from workbench.cards.readable import units_of
from workbench.documents.model import used
from workbench.report.chart import Chart, Colour, Line, chart_html
from workbench.report.friction import (
    SHOWN_RANGE,
    friction_data,
    friction_panel,
    low_speeds,
    with_bar,
)
from workbench.report.trace_words import words
from workbench.report.view import Section
from workbench.steps.trace import Traced

Curve = tuple[Karnopp, list[Acting], Colour, str]  # a model, its effects of speed, colour and name
CURVE = 160  # points of a friction curve


def friction_before_after(traced: Traced) -> Section:
    """Friction against velocity at all speeds and at low ones, before and after.

    Where the machine has drifted without lacking an effect, on training and test logs.
    """
    speeds = _of_speed(traced)
    other = [words(a.key) for a in traced.model.acting if a not in speeds]
    caption = "Dots: the logs' samples, smoothed. The bar at 0 spans the breakaway limits."
    if other:
        caption += f" Not a function of velocity, so not in the curve: {', '.join(other)}."
    return Section("Friction", chart_html(friction_chart(traced), caption))


def _of_speed(traced: Traced) -> list[Acting]:
    """The effects that are a function of velocity."""
    every = traced.model.acting
    return [a for a in every if a.effect.place.rubs and a.effect.depends_on == ("v",)]


def friction_chart(traced: Traced) -> Chart:
    """The chart of `friction_before_after`."""
    found, model = traced.trace, traced.model
    after, curves = model.karnopp, _curves(found, model.karnopp, _of_speed(traced))
    sources = traced.test if _drifted(found) and traced.test else traced.train
    data = [friction_data(model, one.log) for one in sources]
    v, F_f = (np.concatenate([getattr(one, name) for one in data]) for name in ("v", "F_f"))
    reach = max(float(np.quantile(np.abs(v), 0.999)), 2 * max(after.dv_p, -after.dv_n))
    name = "logs: F_e − m a" if len(sources) > 1 else f"{sources[0].file}: F_e − m a"
    dots = Line(name, v, F_f, "measured", "dots")
    panels = []
    for title, high in (
        ("all speeds", reach),
        ("low speeds", low_speeds(after, (-reach, reach))[1]),
    ):
        lines = [_line(curve, high) for curve in curves]
        top = max(float(np.nanmax(np.abs(one.y))) for one in lines)
        panels.append(
            friction_panel(
                title, units_of(model.rotary), dots, lines, (-high, high),
                (-SHOWN_RANGE * top, SHOWN_RANGE * top), after,
            )
        )  # fmt: skip
    what = "friction force against velocity, before and after"
    return Chart("trace-friction", what, panels, columns=2, shared_x=False)


def _line(curve: Curve, high: float) -> Line:
    """Friction of a model at speeds up to `high` [m/s]."""
    p, acting, colour, name = curve
    v_n, v_p = np.linspace(-high, p.dv_n, CURVE), np.linspace(p.dv_p, high, CURVE)
    F_n, F_p = (sliding_friction(v, p, acting) for v in (v_n, v_p))
    return Line(name, *with_bar(v_n, F_n, v_p, F_p, p, 2 * high), colour, "bold")


def _drifted(found: Trace) -> bool:
    return bool(found.drift) and not found.effects


def _curves(found: Trace, after: Karnopp, speeds: list[Acting]) -> list[Curve]:
    """Models whose friction is drawn."""
    if found.effects:
        before = Karnopp(**{name: used(found.parameters_before[name]) for name in NAMES})
        return [(before, [], "reference", "before"), (after, speeds, "model", "after")]
    if not _drifted(found):
        return [(after, speeds, "model", "model")]
    changed = {one.name: max(one.after, 0.0) for one in found.drift if one.name in NAMES}
    return [
        (after, [], "reference", "on the training logs"),
        (replace(after, **changed), [], "model", "on the test logs"),
    ]


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
