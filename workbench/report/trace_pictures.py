"""Pictures of a trace: the residual before and after over time and against what explains it."""

from collections.abc import Sequence

import numpy as np

from design.machine.readable import Display
from identification.arrays import Array, BoolArray
from identification.signals.envelope import SHOWN_SHARE, evenly_spread
from identification.signals.running_median import running_median
from identification.tracing.residual_rows import (
    log_starts,
    share_inside,
)
from identification.tracing.result import FreeCurve, Residual
from identification.tracing.shown_against import LEVELS, Picture
from workbench.report.chart import Area, Band, Chart, Colour, Line, Mark, Panel, parts_of
from workbench.report.trace_words import words
from workbench.report.view import Section

FINE = 90  # of a signal, for the curve of what the effect takes away, which has no noise
DOTS = 3000
# Name of a signal, and the quantity whose unit it has.
SIGNALS = {
    "v": ("velocity", "{velocity}"),
    "y": ("position", "{position}"),
    "t": ("time", "s"),
    "F": ("applied force", "{force}"),
    "u": ("command", "{command}"),
    "p_p": ("pressure p_p", "bar"),
    "p_n": ("pressure p_n", "bar"),
    "a": ("acceleration", "{velocity}/s"),
    "phase": ("part of the swing's period", "1"),
    "reversal": ("time since the last reversal", "s"),
    "du": ("rate of the command", "{command}/s"),
}
PASCALS = 1e-5  # bar
EQUATION_TITLES = {
    "mechanical": "equation of motion",
    "actuator": "actuator equation",
    "position": "position of the free run",
}
ROWS_TAKEN = {"position": "sample by sample, run in windows of 2 s from measured states"}


def over_time(residual: Residual, display: Display, logs: Sequence[str] = ()) -> Section:
    """Residual against time before and after, with the band of the sensors' noise; logs: names of
    those in a row."""
    equation, both = EQUATION_TITLES[residual.equation], _both(residual)
    shares = [f"{share_inside(y, residual.noise):.0f} % ({name})" for y, _, name in both]
    unit, factor = residual_unit(residual.equation, display)
    noise = 2 * factor * float(np.median(residual.noise))
    chosen = evenly_spread(len(residual.t))
    lines = [
        Line(name, residual.t[chosen], factor * values[chosen], colour, "dots")
        for values, colour, name in both
    ]
    starts = log_starts(residual)
    ends = np.append(starts[1:], residual.t.max())
    panel = Panel(
        "time, training logs in a row [s]", f"residual [{unit}]", lines,
        bands=[Band("±2σ of the sensors' noise", -noise, noise)],
        marks=[Mark(float(at), "x") for at in starts[1:]],
        y_range=_limits(residual, factor),
    )  # fmt: skip
    what = f"residual of the {equation} against time, before and after"
    rows = ROWS_TAKEN.get(residual.equation, "averaged over short windows")
    caption = (
        f"{equation.capitalize()}, {rows}; a complete model has 95 % of its points in the band,"
        f" here {', '.join(shares)}."
    )
    parts = parts_of(logs, starts.tolist(), ends.tolist())
    name = f"trace-time-{residual.equation}"
    chart = Chart(name, what, [panel], parts=parts, caption=caption)
    return Section(f"What the model leaves over time: {equation}", chart)


def _both(residual: Residual) -> list[tuple[Array, Colour, str]]:
    """Residual before and after, their colours and names; one, where nothing was added."""
    if np.array_equal(residual.before, residual.after):
        return [(residual.after, "model", "model")]
    return [(residual.before, "before", "before"), (residual.after, "model", "after")]


def against_signal(picture: Picture, display: Display) -> Section:
    """Residual against the signal that explains it, before and after, with running medians."""
    signal = axis_of(picture.signal, display)[0].split(" [")[0]
    alone = len(_both(picture.residual)) == 1
    title = f"Against {signal}" if alone else f"What it depends on: {signal}"
    return Section(title, signal_chart(picture, display))


def signal_chart(picture: Picture, display: Display) -> Chart:
    """The chart of `against_signal`: points, and running medians and what the fitted effect takes
    away in each direction of motion."""
    residual, ways, levels = picture.residual, by_direction(picture.residual), picture.levels
    label, x_factor = axis_of(picture.signal, display)
    unit, factor = residual_unit(residual.equation, display)
    x = x_factor * residual.signals[picture.signal]
    both = _both(residual)
    if len(both) > 1:
        both[0] = (picture.without, "before", picture.how)
    limits, chosen = _limits(residual, factor, both[0][0]), evenly_spread(len(x), DOTS)
    panels: list[Panel] = []
    for values, colour, name in both:
        lines = [Line("rows", x[chosen], factor * values[chosen], colour, "dots")]
        for said, (at, way) in ways.items():
            lines.append(
                Line(said, *running_median(x[at], factor * values[at], levels), way, "bold")
            )
        if picture.curve is not None and picture.effect and not panels:
            said = f"fitted: {words(picture.effect.key)}"
            for at, _ in ways.values():
                curve = running_median(x[at], factor * picture.curve[at], max(FINE, levels))
                lines.append(Line(said, *curve, "measured", "dashed"))
                said = ""
        title = name if len(both) > 1 else ""
        panels.append(Panel(label, f"residual [{unit}]", lines, title, y_range=limits, height=260))
    what = f"residual of the {EQUATION_TITLES[residual.equation]} against {label}, before and after"
    name, caption = f"trace-{residual.equation}-{picture.signal}", _caption(picture)
    return Chart(name, what, panels, columns=2, caption=caption)


def _caption(picture: Picture) -> str:
    equation = EQUATION_TITLES[picture.residual.equation]
    # Of the equation of motion the force that is missing is shown, beside rows of the others.
    smoothed = ", smoothed, while the body slides" if equation == "equation of motion" else ""
    text = (
        f"Residual of the {equation}{smoothed}; lines are running medians, by direction of motion."
        " Flat at 0 is a complete model."
    )
    if picture.how != "before":
        text += " Left: the other effects are in the model, this one is not."
    if picture.curve is not None:
        text += " Dashed: what the fitted effect takes away."
    return text


def by_direction(residual: Residual) -> dict[str, tuple[BoolArray, Colour]]:
    """Rows of each direction of motion and its colour; those of too few points are left out."""
    v = residual.signals.get("v")
    if v is None:
        every: BoolArray = np.ones(len(residual.t), dtype=np.bool_)
        return {"running median": (every, "reference")}
    ways: dict[str, tuple[BoolArray, Colour]] = {
        "moving towards +": (v > 0, "reference"),
        "moving towards −": (v < 0, "other"),
    }
    return {name: way for name, way in ways.items() if np.count_nonzero(way[0]) > LEVELS}


def axis_of(signal: str, display: Display) -> tuple[str, float]:
    """Label of a signal's axis, and what its values are multiplied by."""
    if signal not in SIGNALS:
        return signal, 1.0
    name, unit = SIGNALS[signal]
    known = {key: display.shown(key) for key in ("position", "velocity", "force")}
    shown = unit.format(**{key: one.name for key, one in known.items()}, command=display.command)
    factor = next((one.factor for key, one in known.items() if f"{{{key}}}" in unit), 1.0)
    return f"{name} [{shown}]", PASCALS if shown == "bar" else factor


def residual_unit(equation: str, display: Display) -> tuple[str, float]:
    """Unit of an equation's residual, and what its values are multiplied by."""
    of = {"actuator": (f"{display.force}/s", 1.0), "position": display.shown("position")}
    return of.get(equation, display.shown("force"))


def _limits(residual: Residual, factor: float, values: Array | None = None) -> tuple[float, float]:
    """Range that holds all but the rarest points (by default of the residual before), and noise."""
    top = float(np.quantile(np.abs(residual.before if values is None else values), SHOWN_SHARE))
    top = 1.25 * factor * max(top, 2 * float(np.median(residual.noise)), 1e-300)
    return -top, top


def free_curves(curves: Sequence[FreeCurve], display: Display) -> Section:
    """Each named effect that is a function of a logged signal, by its law and free of it."""
    panels = []
    for one in curves:
        label, x_factor = axis_of(one.signal, display)
        label = label if one.period is None else label.replace(" [", " within a period [")
        unit, factor = residual_unit(one.equation, display)
        x, free, wide = x_factor * one.at, factor * one.free, 1.96 * factor * one.sd
        panels.append(
            Panel(
                label, f"{words(one.effect)} [{unit}]",
                [Line("by its law", x, factor * one.law, "model", "bold")],
                areas=[Area("by the logs alone", x, free - wide, free + wide, "measured")],
            )
        )  # fmt: skip
    what = "what each effect gives against its signal, by its law and by the logs alone"
    caption = (
        "Band: mean of what the model without the effect leaves there, with its 95 % interval;"
        " a law that stays inside it says what the logs say."
    )
    chart = Chart("trace-curves", what, panels, columns=2, shared_x=False, caption=caption)
    return Section("Law and logs", chart)
