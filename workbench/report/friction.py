"""Sections: friction against velocity, the data under the identified curve; of a trace, before and
after."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from design.identified.trace_logs import Traced
from design.machine.model import Model, used
from design.machine.source import Source
from design.measured.friction_curve import (
    branches,
    friction_samples,
    low_speeds,
    sliding_friction,
    sliding_interval,
    with_identified_limits,
)
from identification.effects._base import Acting
from identification.model.estimates import KarnoppFit
from identification.model.karnopp import NAMES, Karnopp
from identification.signals.envelope import evenly_spread
from workbench.report.chart import Area, Band, Chart, Colour, Line, Panel
from workbench.report.trace_words import words
from workbench.report.view import Section

POINTS = 80  # of a branch of the curve
CURVE = 160  # of one in a trace
FRICTION_DOTS = 3000  # of a panel
SHOWN_RANGE = 1.6  # of the curve's range shown; the force of a fast start lies far outside
Curve = tuple[Karnopp, Sequence[Acting], Colour, str]  # colour and name of its line


def friction_curve(model: Model, fit: KarnoppFit, sources: Sequence[Source]) -> Section:
    """Friction of the logs' samples against velocity, with the Karnopp curve and its band."""
    p, dots = (
        with_identified_limits(model.karnopp, model.friction),
        _dots("log: F_e − m a", model, sources),
    )
    reach = min(float(dots.x.min()), 1.2 * p.dv_n), max(float(dots.x.max()), 1.2 * p.dv_p)
    panels = _panels(model, dots, [(p, [], "model", "Karnopp model")], reach, fit)
    what = "friction force against velocity, samples of the logs and the model"
    chart = Chart("friction", what, panels, 2, shared_x=False, caption=_caption(model))
    return Section("Friction", chart)


def _panels(
    model: Model, dots: Line, curves: Sequence[Curve], reach: tuple[float, float],
    fit: KarnoppFit | None = None,
) -> list[Panel]:  # fmt: skip
    """All speeds and the low ones; fit: of the one curve, for its band. Dots are those samples
    that lie in the range shown."""
    p, display, out = model.karnopp, model.display, list[Panel]()
    (speed, factor), points = display.shown("velocity"), POINTS if fit else CURVE
    for title, (begin, end) in (("all speeds", reach), ("low speeds", low_speeds(p, reach))):
        lines = [_curve(*one, begin, end, points) for one in curves]
        bottom = min(float(np.nanmin(one.y)) for one in lines)
        top = max(float(np.nanmax(one.y)) for one in lines)
        if fit is None:
            top = max(top, -bottom)
            bottom = -top
        inside = np.flatnonzero((dots.x >= begin) & (dots.x <= end))
        inside = inside[evenly_spread(len(inside), FRICTION_DOTS)]
        shown = [replace(dots, x=dots.x[inside], y=dots.y[inside]), *lines]
        areas = _interval(fit, p, begin, end) if fit else []
        out.append(
            Panel(
                f"velocity [{speed}]", f"friction force [{display.force}]",
                [replace(one, x=factor * one.x) for one in shown], title,
                areas=[replace(one, x=factor * one.x) for one in areas],
                bands=[Band("stick band", factor * p.dv_n, factor * p.dv_p, "x")],
                x_range=(factor * begin, factor * end),
                y_range=(SHOWN_RANGE * bottom, SHOWN_RANGE * top), height=280,
            )
        )  # fmt: skip
    return out


def _dots(name: str, model: Model, sources: Sequence[Source]) -> Line:
    """What the logs of these sources say of friction."""
    data = [friction_samples(model, one.log) for one in sources]
    v, F_f = (np.concatenate(one) for one in zip(*data, strict=True))
    return Line(name, v, F_f, "measured", "dots")


def _curve(
    p: Karnopp, acting: Sequence[Acting], colour: Colour, name: str, begin: float, end: float,
    points: int,
) -> Line:  # fmt: skip
    """Friction at these speeds [m/s], and between both ways the bar of breakaway at rest."""
    v_n, v_p = branches(p, begin, end, points)
    at_rest, gap = 1e-6 * (v_p[-1] - v_n[0]), [np.nan]
    v = np.concatenate([v_n, [-3 * at_rest, -at_rest, at_rest, 3 * at_rest], v_p])
    F_n, F_p = (sliding_friction(branch, p, acting) for branch in (v_n, v_p))
    return Line(name, v, np.concatenate([F_n, gap, [p.F_sn, p.F_sp], gap, F_p]), colour, "bold")


def _interval(fit: KarnoppFit, p: Karnopp, begin: float, end: float) -> list[Area]:
    """95 % interval of the sliding friction each way."""
    both = sliding_interval(fit, p, begin, end, POINTS)
    names = ("95 % interval", "")
    return [Area(name, *one) for name, one in zip(names, both, strict=True)]


def _caption(model: Model) -> str:
    text = (
        "Each dot is one sample: applied force less inertia, smoothed as the velocity is. Within"
        " the shaded band the model sticks; there, friction takes any value between the two"
        " breakaway limits (the bar at zero; a limit that is not identified at the Coulomb level)."
    )
    if model.friction["m"].value is None:
        text += " The mass is not identified, so the assumed one is used for the inertia."
    return text


def trace_friction_chart(traced: Traced) -> Chart:
    """Friction against velocity at all speeds and at low ones, before and after a trace.

    Where the machine has drifted without lacking an effect, on training and test logs.
    """
    found, model = traced.trace, traced.model
    after = with_identified_limits(model.karnopp, model.friction)
    every = model.acting
    speeds = [a for a in every if a.effect.place.rubs and a.effect.depends_on == ("v",)]
    drifted = bool(found.drift) and not found.effects
    curves: list[Curve] = [(after, speeds, "model", "after" if found.effects else "model")]
    if found.effects:
        before = Karnopp(**{name: used(found.parameters_before[name]) for name in NAMES})
        before = with_identified_limits(before, found.parameters_before)
        curves.insert(0, (before, [], "reference", "before"))
    if drifted:
        changed = {one.name: max(one.after, 0.0) for one in found.drift if one.name in NAMES}
        curves = [
            (after, [], "reference", "on the training logs"),
            (replace(after, **changed), [], "model", "on the test logs"),
        ]
    sources = traced.test if drifted and traced.test else traced.train
    name = "logs: F_e − m a" if len(sources) > 1 else f"{sources[0].file}: F_e − m a"
    dots = _dots(name, model, sources)
    reach = max(float(np.quantile(np.abs(dots.x), 0.999)), 2 * max(after.dv_p, -after.dv_n))
    panels = _panels(model, dots, curves, (-reach, reach))
    caption = (
        "Dots: the logs' samples, smoothed. The bar at 0 spans the breakaway limits, one that is"
        " not identified at the Coulomb level."
    )
    other = [words(a.key) for a in every if a not in speeds]
    if other:
        caption += f" Not a function of velocity, so not in the curve: {', '.join(other)}."
    what = "friction force against velocity, before and after"
    return Chart("trace-friction", what, panels, 2, shared_x=False, caption=caption)
