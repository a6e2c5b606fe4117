"""Sections: friction against velocity, the data under the identified curve; of a trace, before and
after."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from design.identified.trace_logs import Traced
from design.machine.model import Model, used
from design.machine.readable import units_of
from design.machine.source import Source
from design.measured.predict import of_one_instant
from identification.arrays import Array
from identification.effects._base import Acting
from identification.log import Log
from identification.model.estimates import NORMAL_95, Estimate, KarnoppFit
from identification.model.inverse_model import zoh_force
from identification.model.karnopp import NAMES, Karnopp
from identification.model.resonance import load_acceleration
from identification.model.size import Size
from identification.model.surroundings import Surroundings
from identification.signals.differentiate import differentiate, low_pass
from identification.simulation.effect_along_motion import contribution
from workbench.report.chart import Area, Band, Chart, Colour, Line, Panel
from workbench.report.chart_figure import evenly_spread
from workbench.report.trace_words import words
from workbench.report.view import Section

POINTS = 80  # of a branch of the curve
CURVE = 160  # of one in a trace
FRICTION_DOTS = 3000  # of a panel
SLIDING_PARAMETERS = ("F_cp", "F_cn", "F_vp", "F_vn")
SHOWN_RANGE = 1.6  # of the curve's range shown; the force of a fast start lies far outside
LOW_IN_BANDS, LOW_SHARE = 4.0, 0.25  # low speeds: in widths of the band, and of all speeds
UNSEEN_BAND = 1e-4  # of all speeds, up to which a band is not seen
Curve = tuple[Karnopp, Sequence[Acting], Colour, str]  # colour and name of its line


def _friction_data(model: Model, log: Log) -> tuple[Array, Array]:
    """Velocity [m/s] and friction force F_e - m a [N] of a log, (n,), both smoothed alike.

    Of the instants at which the force acts, without the model's position-dependent forces (gravity,
    cogging, a spring), and of two masses with the second's own acceleration, so that what is left
    is friction alone.
    """
    late = sum(a.values["tau"] for a in model.acting if a.effect.place.delays)
    log = Surroundings(lag=Size(late)).of_one_instant(log) if late else of_one_instant(log, model)
    motion = differentiate(log["y"], log.h)
    F = zoh_force(log["F"]) if model.holds_force else log["F"]
    F = low_pass(F + _of_place(model, log), log.h, motion.cutoff)
    inner = slice(motion.edge, len(F) - motion.edge)
    left = F - _inertia(model, motion.a, log.h)
    return motion.v[inner], left[inner]


def _of_place(model: Model, log: Log) -> Array:
    """Force [N] of the effects that depend on the place alone, (n,)."""
    force = np.zeros(len(log))
    signals = {**dict.fromkeys("tvFud", force), "y": np.asarray(log["y"])}
    for one in model.acting:
        if one.effect.acts == "force" and set(one.effect.depends_on) <= {"y"}:
            force = force + contribution(one.effect, one.values, signals, log.h, model.karnopp)
    return force


def _inertia(model: Model, a: Array, h: float) -> Array:
    """Force [N] that accelerates the body, or both masses behind each other, (n,)."""
    if model.resonance is None:
        return model.karnopp.m * a
    found = {name: used(one) for name, one in model.resonance.items()}
    behind = load_acceleration(a, h, found["frequency"], found["anti_resonance"], found["damping"])
    return found["m_1"] * a + found["m_2"] * behind


def friction_curve(model: Model, fit: KarnoppFit, sources: Sequence[Source]) -> Section:
    """Friction of the logs' samples against velocity, with the Karnopp curve and its band."""
    p, dots = _identified(model.karnopp, model.friction), _dots("log: F_e − m a", model, sources)
    reach = min(float(dots.x.min()), 1.2 * p.dv_n), max(float(dots.x.max()), 1.2 * p.dv_p)
    panels = _panels(model, dots, [(p, [], "model", "Karnopp model")], reach, fit)
    what = "friction force against velocity, samples of the logs and the model"
    chart = Chart("friction", what, panels, 2, shared_x=False, caption=_caption(model))
    return Section("Friction", chart)


def _identified(p: Karnopp, known: Mapping[str, Estimate]) -> Karnopp:
    """The friction to draw: a breakaway limit that the logs do not identify ends at the Coulomb
    level, whatever a run has made of it."""
    limits = {"F_sp": p.F_cp, "F_sn": -p.F_cn}
    return replace(p, **{n: level for n, level in limits.items() if known[n].value is None})


def _panels(
    model: Model, dots: Line, curves: Sequence[Curve], reach: tuple[float, float],
    fit: KarnoppFit | None = None,
) -> list[Panel]:  # fmt: skip
    """All speeds and the low ones; fit: of the one curve, for its band. Dots are those samples
    that lie in the range shown."""
    p, units, out = model.karnopp, units_of(model.rotary), list[Panel]()
    (speed, factor), points = units.velocity, POINTS if fit else CURVE
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
                f"velocity [{speed}]", f"friction force [{units.force.name}]",
                [replace(one, x=factor * one.x) for one in shown], title,
                areas=[replace(one, x=factor * one.x) for one in areas],
                bands=[Band("stick band", factor * p.dv_n, factor * p.dv_p, "x")],
                x_range=(factor * begin, factor * end),
                y_range=(SHOWN_RANGE * bottom, SHOWN_RANGE * top), height=280,
            )
        )  # fmt: skip
    return out


def low_speeds(p: Karnopp, reach: tuple[float, float]) -> tuple[float, float]:
    """The speeds [m/s] around the stick band, where friction bends; the slow ones where the band is
    too narrow to be seen."""
    band, most = max(p.dv_p, -p.dv_n), max(reach[1], -reach[0])
    low = LOW_SHARE * most
    low = min(LOW_IN_BANDS * band, low) if band > UNSEEN_BAND * most else low
    low = max(low, 1.5 * p.dv_p, -1.5 * p.dv_n)
    return -low, low


def _dots(name: str, model: Model, sources: Sequence[Source]) -> Line:
    """What the logs of these sources say of friction."""
    data = [_friction_data(model, one.log) for one in sources]
    v, F_f = (np.concatenate(one) for one in zip(*data, strict=True))
    return Line(name, v, F_f, "measured", "dots")


def _branches(p: Karnopp, begin: float, end: float, points: int) -> tuple[Array, Array]:
    """Speeds of either direction outside the stick band [m/s]."""
    return np.linspace(begin, p.dv_n, points), np.linspace(p.dv_p, end, points)


def _curve(
    p: Karnopp, acting: Sequence[Acting], colour: Colour, name: str, begin: float, end: float,
    points: int,
) -> Line:  # fmt: skip
    """Friction at these speeds [m/s], and between both ways the bar of breakaway at rest."""
    v_n, v_p = _branches(p, begin, end, points)
    at_rest, gap = 1e-6 * (v_p[-1] - v_n[0]), [np.nan]
    v = np.concatenate([v_n, [-3 * at_rest, -at_rest, at_rest, 3 * at_rest], v_p])
    F_n, F_p = (sliding_friction(branch, p, acting) for branch in (v_n, v_p))
    return Line(name, v, np.concatenate([F_n, gap, [p.F_sn, p.F_sp], gap, F_p]), colour, "bold")


def sliding_friction(v: Array, p: Karnopp, acting: Sequence[Acting]) -> Array:
    """Friction while sliding at `v` [m/s], (n,): Karnopp's and what effects of speed add [N]."""
    d, blank = np.sign(v), np.zeros(len(v))
    signals = {"t": blank, "y": blank, "F": blank, "u": blank, "v": v, "d": d}
    plain = np.where(v > 0, p.F_cp + p.F_vp * v, -p.F_cn + p.F_vn * v)
    more = [d * contribution(a.effect, a.values, signals, 1e-3, p) for a in acting]
    return np.asarray(plain + np.sum(more, axis=0)) if more else plain


def _interval(fit: KarnoppFit, p: Karnopp, begin: float, end: float) -> list[Area]:
    """95 % interval of the sliding friction each way, by the covariance of its parameters."""
    out, at = list[Area](), [fit.free.index(n) for n in SLIDING_PARAMETERS if n in fit.free]
    for name, v in zip(("95 % interval", ""), _branches(p, begin, end, POINTS), strict=True):
        up = 1.0 * (v > 0)
        change = dict(zip(SLIDING_PARAMETERS, (up, up - 1.0, up * v, (1.0 - up) * v), strict=True))
        J = np.array([change[fit.free[i]] for i in at])
        variance = np.einsum("in,ij,jn->n", J, fit.covariance[np.ix_(at, at)], J)
        half = NORMAL_95 * np.sqrt(np.maximum(variance, 0.0))
        middle = sliding_friction(v, p, ())
        out.append(Area(name, v, middle - half, middle + half))
    return out


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
    after = _identified(model.karnopp, model.friction)
    every = model.acting
    speeds = [a for a in every if a.effect.place.rubs and a.effect.depends_on == ("v",)]
    drifted = bool(found.drift) and not found.effects
    curves: list[Curve] = [(after, speeds, "model", "after" if found.effects else "model")]
    if found.effects:
        before = Karnopp(**{name: used(found.parameters_before[name]) for name in NAMES})
        before = _identified(before, found.parameters_before)
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
