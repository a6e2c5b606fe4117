"""Pictures of a trace: the residual before and after over time and against what explains it."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from identification.arrays import Array, BoolArray
from identification.effects._base import Acting, Effect
from identification.model.karnopp import Karnopp
from identification.simulation.effect_along_motion import contribution
from identification.tracing.result import Residual, Trace
from workbench.cards.parameter_units import shown
from workbench.report.figures import (
    MEASURED,
    MODEL,
    OTHER,
    REFERENCE,
    evenly_spread,
    figure,
    inline,
    label,
    style,
)
from workbench.report.page import Section, render
from workbench.report.trace_tables import words

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Equation = Literal["mechanical", "actuator"]
BEFORE = "#8a8a8a"
LEVELS = 30  # of a signal, over which the running median is taken
FINE = 90  # of a signal, for the curve of what the effect takes away, which has no noise
DOTS = 3000
SHOWN_SHARE = 0.995  # share of the points that the axes hold
SIGNALS = {
    "v": "velocity [{velocity}]",
    "y": "position [{position}]",
    "t": "time [s]",
    "F": "applied force [{force}]",
    "u": "command [V]",
    "p_p": "pressure p_p [Pa]",
    "p_n": "pressure p_n [Pa]",
    "a": "acceleration [{velocity}/s]",
    "phase": "part of the swing's period [1]",
    "reversal": "time since the last reversal [s]",
    "du": "rate of the command [V/s]",
}
# Sign with which an effect enters the residual; 0: that of the motion.
GAP = 0.2  # of a signal's range, over which a running median is not drawn
EQUATION_TITLES = {
    "mechanical": "equation of motion",
    "actuator": "actuator equation",
    "position": "position of the free run",
}
ROWS_TAKEN = {"position": "sample by sample, run in windows of 2 s from measured states"}
WINDOWS = "averaged over short windows"  # rows of the equations


@dataclass(frozen=True, eq=False)
class Picture:
    """A residual, the signal against which it is drawn, and the effect that it is to show.

    without: the residual of the model without this effect, (r,), and `how` it is called; curve:
    what the effect takes away, (r,), where it depends on this signal only.
    """

    residual: Residual
    signal: str
    effect: Effect | None
    without: Array
    how: str
    curve: Array | None


def in_equation(effect: Effect) -> Equation | None:
    """The equation in whose residual an effect shows; None where in neither while sliding."""
    if effect.place.in_actuator:
        return "actuator"
    return None if effect.place.in_stops else "mechanical"


def pictures(found: Trace) -> list[Picture]:
    """What to draw: each effect against its signal, and what is left against those unexplained."""
    residuals = {r.equation: r for r in found.residuals}
    out: list[Picture] = []
    for e in found.effects:
        equation = in_equation(e.effect)
        residual = residuals.get(equation) if equation else None
        if residual is None:
            continue
        others = [o for o in found.effects if in_equation(o.effect) == equation]
        out.append(
            _of_effect(
                next(a for a in found.plant.effects if a.key == e.effect.key),
                residual,
                found.plant.friction,
                len(others) == 1,
            )
        )
    rest = _unexplained(found)
    if rest is not None and all(_place(p) != _place(rest) for p in out):
        out.append(rest)
    return _once(out)


def _of_effect(acting: Acting, residual: Residual, p: Karnopp, alone: bool) -> Picture:
    """The picture of one effect; not alone in its equation, it is taken out by its own equation."""
    effect = acting.effect
    signal = signal_of(effect, residual)
    taken, how = residual.before - residual.after, "before"
    if not alone:
        own = along_rows(acting, residual, p)
        if own is not None:
            taken, how = own, f"without {words(effect.key)}"
    single = len(effect.depends_on) == 1 and (alone or how != "before")
    return Picture(residual, signal, effect, residual.after + taken, how, taken if single else None)


def along_rows(acting: Acting, residual: Residual, p: Karnopp) -> Array | None:
    """What an effect contributes at each row, (r,); None where it is no function of the signals."""
    effect = acting.effect
    if effect.place.sign is None or effect.evolve is not None or "v" not in residual.signals:
        return None
    blank = np.zeros(len(residual.t) + 1)  # a first row at t = 0, from which kernels count
    rows = {k: np.concatenate([[0.0], x]) for k, x in residual.signals.items()}
    signals = {"t": blank, "y": blank, "F": blank, "u": blank, **rows}
    signals["d"] = np.sign(signals["v"])
    value = contribution(effect, acting.values, signals, 1e-3, p)[1:]
    sign = effect.place.sign
    return np.asarray(value * (signals["d"][1:] if sign == 0.0 else sign))


def _once(drawn: list[Picture]) -> list[Picture]:
    """One picture of each residual and signal."""
    return list({_place(p): p for p in reversed(drawn)}.values())[::-1]


def _place(picture: Picture) -> tuple[str, str]:
    return picture.residual.equation, picture.signal


def _unexplained(found: Trace) -> Picture | None:
    """What no effect explains, or (where there is no effect) the residual that is largest."""
    wanted = found.unknown.depends_on
    if not found.residuals or (found.effects and not wanted):
        return None
    having = [r for r in found.residuals if set(wanted) & set(r.signals)]
    residual = max(having or found.residuals, key=_in_noise)
    if found.unknown.swing > 0.0 and "t" in residual.signals:
        folded = folded_at(residual, found.unknown.swing)
        return Picture(folded, "phase", None, folded.before, "before", None)
    named = [name for name in (*wanted, "v", "y", *residual.signals) if name in residual.signals]
    return Picture(residual, named[0], None, residual.before, "before", None) if named else None


def folded_at(residual: Residual, rate: float) -> Residual:
    """The first log's rows, with the part of a swing's period [1] at `rate` [Hz] as a signal.

    A swing keeps its rate from log to log, not its phase.
    """
    own = residual.log == residual.log[0]
    signals = {k: v[own] for k, v in residual.signals.items()}
    signals["phase"] = signals["t"] * rate % 1.0
    return Residual(
        residual.equation, residual.t[own], residual.log[own], residual.before[own],
        residual.after[own], residual.noise[own], signals,
    )  # fmt: skip


def _in_noise(residual: Residual) -> float:
    """What is left, in units of the sensors' noise."""
    return float(np.median(np.abs(residual.after) / np.maximum(residual.noise, 1e-300)))


def signal_of(effect: Effect, residual: Residual) -> str:
    """The signal against which an effect shows."""
    wanted = [*effect.depends_on, "v", "y"]
    for name in ["du", *wanted] if effect.place.delays else wanted:
        if name in residual.signals:
            return name
    return next(iter(residual.signals))


def over_time(residual: Residual, rotary: bool) -> Section:
    """Residual against time before and after, with the band of the sensors' noise."""
    noise = 2 * float(np.median(residual.noise))
    with style():
        drawn = figure(9.0, 3.2)
        axes = drawn.subplots()
        keep = evenly_spread(len(residual.t))
        for values, colour, name in _both(residual):
            axes.plot(
                residual.t[keep], values[keep], ".", ms=3, mew=0, color=colour, label=name,
                rasterized=True,
            )  # fmt: skip
        axes.axhspan(
            -noise, noise, color=REFERENCE, alpha=0.3, lw=0, zorder=3, label="±2σ of the sensors"
        )
        for at in log_starts(residual)[1:]:
            axes.axvline(at, color="#bbbbbb", lw=0.8, ls="--")
        _limits(axes, residual)
        drawn.legend(
            *axes.get_legend_handles_labels(), loc="outside upper right", ncols=3, markerscale=4
        )
        label(axes, "time, training logs in a row [s]", f"residual [{_unit(residual, rotary)}]")
        name = f"trace-time-{residual.equation}"
        svg = inline(drawn, name, "residual against time, before and after")
    shares = [
        f"{share_inside(values, residual.noise):.0f} % ({name})"
        for values, _, name in _both(residual)
    ]
    equation = EQUATION_TITLES[residual.equation]
    caption = (
        f"{equation.capitalize()}, {ROWS_TAKEN.get(residual.equation, WINDOWS)}; a complete model"
        f" has 95 % of its points in the band, here {', '.join(shares)}."
    )
    title = f"What the model leaves over time: {equation}"
    return Section(title, render("figure", svg=svg, caption=caption))


def _both(residual: Residual) -> list[tuple[Array, str, str]]:
    """Residual before and after, their colours and names; one, where nothing was added."""
    after = (residual.after, MODEL, "after")
    if np.array_equal(residual.before, residual.after):
        return [(residual.after, MODEL, "model")]
    return [(residual.before, BEFORE, "before"), after]


def share_inside(values: Array, noise: Array) -> float:
    """Points within two standard deviations of the noise [%]."""
    return 100 * float(np.mean(np.abs(values) <= 2 * noise))


def log_starts(residual: Residual) -> Array:
    """Time of each log's first row [s]."""
    return np.array([residual.t[residual.log == k].min() for k in np.unique(residual.log)])


def against_signal(picture: Picture, rotary: bool) -> Section:
    """Residual against the signal that explains it, before and after, with running medians."""
    with style():
        drawn = signal_figure(picture, rotary)
        name = f"trace-{picture.residual.equation}-{picture.signal}"
        svg = inline(drawn, name, "residual against a signal")
    signal = axis_label(picture.signal, rotary).split(" [")[0]
    alone = len(_both(picture.residual)) == 1
    title = f"Against {signal}" if alone else f"What it depends on: {signal}"
    return Section(title, render("figure", svg=svg, caption=_caption(picture)))


def signal_figure(picture: Picture, rotary: bool) -> "Figure":
    """The figure of `against_signal`."""
    residual, x = picture.residual, picture.residual.signals[picture.signal]
    panels = _both(residual)
    if len(panels) > 1:
        panels[0] = (picture.without, BEFORE, picture.how)
    with style():
        drawn = figure(9.0, 3.6)
        every = drawn.subplots(1, len(panels), sharey=True, squeeze=False)[0]
        for axes, (values, colour, title) in zip(every, panels, strict=True):
            _cloud(axes, residual, x, values, colour)
            unit = f"residual [{_unit(residual, rotary)}]" if axes is every[0] else ""
            label(axes, axis_label(picture.signal, rotary), unit, title)
        if picture.curve is not None and picture.effect:
            for at, _ in by_direction(residual).values():
                every[0].plot(
                    *running_median(x[at], picture.curve[at], FINE), color=MEASURED, lw=1.0,
                    ls="--", label=f"fitted: {words(picture.effect.key)}",
                )  # fmt: skip
        _limits(every[0], residual, panels[0][0])
        lines = dict(zip(*reversed(every[0].get_legend_handles_labels()), strict=True))
        drawn.legend(lines.values(), lines.keys(), loc="outside upper right", ncols=3)
    return drawn


def _cloud(axes: "Axes", residual: Residual, x: Array, values: Array, colour: str) -> None:
    """Points against a signal, and their running median in each direction of motion."""
    keep = evenly_spread(len(x), DOTS)
    axes.plot(x[keep], values[keep], ".", ms=3, mew=0, color=colour, alpha=0.6, rasterized=True)
    for name, (at, way) in by_direction(residual).items():
        axes.plot(*running_median(x[at], values[at], LEVELS), color=way, lw=1.8, label=name)


def _caption(picture: Picture) -> str:
    text = (
        f"Residual of the {EQUATION_TITLES[picture.residual.equation]}; lines are running medians,"
        " by direction of motion. Flat at 0 is a complete model."
    )
    if picture.how != "before":
        text += " Left: the other effects are in the model, this one is not."
    if picture.curve is not None:
        text += " Dashed: what the fitted effect takes away."
    return text


def by_direction(residual: Residual) -> dict[str, tuple[BoolArray, str]]:
    """Rows of each direction of motion and its colour; those of too few points are left out."""
    v = residual.signals.get("v")
    if v is None:
        every: BoolArray = np.ones(len(residual.t), dtype=np.bool_)
        return {"running median": (every, REFERENCE)}
    ways = {"moving towards +": (v > 0, REFERENCE), "moving towards −": (v < 0, OTHER)}
    return {name: way for name, way in ways.items() if np.count_nonzero(way[0]) > LEVELS}


def running_median(x: Array, values: Array, levels: int) -> tuple[Array, Array]:
    """Medians of `values` over equally filled stretches of `x`, at most `levels` of them.

    NaN parts them where `x` has a wide gap, across which no line is to be drawn.
    """
    parts = np.array_split(np.argsort(x), min(levels, len(x)))
    at = np.array([np.median(x[p]) for p in parts])
    found = np.array([np.median(values[p]) for p in parts])
    gaps = 1 + np.flatnonzero(np.diff(at) > GAP * max(float(np.ptp(x)), 1e-300))
    return np.insert(at, gaps, np.nan), np.insert(found, gaps, np.nan)


def axis_label(signal: str, rotary: bool) -> str:
    """A signal's name and unit."""
    return SIGNALS.get(signal, signal).format(**shown(rotary)._asdict())


def _unit(residual: Residual, rotary: bool) -> str:
    units = shown(rotary)
    of = {"actuator": f"{units.force}/s", "position": units.position}
    return of.get(residual.equation, units.force)


def _limits(axes: "Axes", residual: Residual, values: Array | None = None) -> None:
    """Range that holds all but the rarest points (by default of the residual before), and noise."""
    top = float(np.quantile(np.abs(residual.before if values is None else values), SHOWN_SHARE))
    top = 1.25 * max(top, 2 * float(np.median(residual.noise)), 1e-300)
    axes.set_ylim(-top, top)
