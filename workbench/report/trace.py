"""The report of a trace: verdict, residual before and after, what explains it, rivals."""

from typing import TYPE_CHECKING

import numpy as np

from identification.arrays import Array
from identification.effects._base import GIVES
from identification.trace_result import Residual, Trace
from workbench.parameter_units import shown
from workbench.report.figures import (
    MODEL,
    OTHER,
    REFERENCE,
    figure,
    inline,
    label,
    spread,
    style,
)
from workbench.report.page import Section, page, render
from workbench.trace_views import (
    CHANGE_HEAD,
    DRIFT_HEAD,
    EFFECT_HEAD,
    ERRORS_HEAD,
    RIVAL_HEAD,
    change_rows,
    drift_rows,
    effect_rows,
    error_rows,
    rival_rows,
    sentence,
)
from workbench.tracing import Traced

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BEFORE = "#888888"
LEVELS = 30  # of a signal, over which the running median is taken
UNITS = {
    "v": "velocity [{velocity}]",
    "y": "position [{position}]",
    "t": "time [s]",
    "F": "applied force [{force}]",
    "u": "command [V]",
    "p_p": "pressure p_p [Pa]",
    "p_n": "pressure p_n [Pa]",
    "reversal": "time since the last reversal [s]",
    "du": "rate of the command [V/s]",
}


def trace_report(traced: Traced) -> str:
    """HTML: what is missing, how it shows, and the errors before and after."""
    found, rotary = traced.trace, traced.model.rotary
    sections = [
        Section(
            "Before and after",
            render("table", head=ERRORS_HEAD, rows=error_rows(found, rotary), lines=[]),
        )
    ]
    for residual in found.residuals:
        if residual.equation == _where(found):
            sections += [over_time(residual, rotary), against_signal(found, residual, rotary)]
    sections += _tables(found, rotary)
    notes = [*traced.remarks, *found.remarks]
    if found.next_experiment:
        notes.insert(0, f"Next run: {found.next_experiment}.")
    if notes:
        sections.append(Section("Notes", render("lines", lines=notes)))
    return page(f"What {traced.model.card} lacks", sentence(found, rotary), sections)


def _where(found: Trace) -> str:
    """The equation whose residual is shown."""
    acts = {e.effect.acts for e in found.effects}
    in_actuator = bool(acts & {"actuator", "command", "delay"})
    return "actuator" if in_actuator else "mechanical"


def _tables(found: Trace, rotary: bool) -> list[Section]:
    lines = [
        f"{e.effect.key}: {e.effect.equation}; {GIVES[e.effect.acts]}. Source: {e.effect.source}."
        f" It explains {100 * e.explained:.3g} % of what was missing (by luck: p ="
        f" {e.p_value:.2g})."
        for e in found.effects
    ]
    out = []
    for title, head, rows, said in (
        ("The effect", EFFECT_HEAD, effect_rows(found), lines),
        ("Parameters without and with it", CHANGE_HEAD, change_rows(found), []),
        ("Rivals, in order", RIVAL_HEAD, rival_rows(found, rotary), []),
        ("Drift between training and test logs", DRIFT_HEAD, drift_rows(found), []),
    ):
        if rows and (found.effects or title.startswith("Drift")):
            out.append(Section(title, render("table", head=head, rows=rows, lines=said)))
    return out


def over_time(residual: Residual, rotary: bool) -> Section:
    """Residual against time before and after, with the band of the sensors' noise."""
    unit = _unit(residual, rotary)
    with style():
        drawn = figure(9.0, 3.2)
        axes = drawn.subplots()
        keep = spread(len(residual.t))
        for values, colour, name in (
            (residual.before, BEFORE, "before"),
            (residual.after, MODEL, "after"),
        ):
            axes.plot(
                residual.t[keep], values[keep], ".", ms=3, mew=0, color=colour, label=name,
                rasterized=True,
            )  # fmt: skip
        noise = 2 * float(np.median(residual.noise))
        axes.axhspan(
            -noise, noise, color=REFERENCE, alpha=0.35, lw=0, zorder=3, label="±2σ of the sensors"
        )
        _limits(axes, residual)
        drawn.legend(*axes.get_legend_handles_labels(), loc="outside upper right", ncols=3)
        label(axes, "time over all training logs [s]", f"residual [{unit}]")
        svg = inline(drawn, "trace-time", "residual against time, before and after")
    caption = "Each point is the mean of a window of about 60 ms; the equation holds at 0."
    return Section("What the model leaves over time", render("figure", svg=svg, caption=caption))


def against_signal(found: Trace, residual: Residual, rotary: bool) -> Section:
    """Residual against the signal that explains it, before and after, with running medians."""
    unit, name = _unit(residual, rotary), signal_of(found, residual)
    units = shown(rotary)._asdict()
    x = residual.signals[name]
    with style():
        drawn = figure(9.0, 3.6)
        left, right = drawn.subplots(1, 2, sharey=True)
        keep = spread(len(x), 3000)
        for axes, values, title in (
            (left, residual.before, "before"),
            (right, residual.after, "after"),
        ):
            axes.plot(
                x[keep], values[keep], ".", ms=3, mew=0, color=BEFORE, alpha=0.6, rasterized=True
            )
            for way, colour in ((1.0, MODEL), (-1.0, OTHER)):
                at = residual.signals.get("v", x) * way > 0
                if np.count_nonzero(at) > LEVELS:
                    axes.plot(
                        *running_median(x[at], values[at]), color=colour, lw=1.8,
                        label="moving towards +" if way > 0 else "moving towards −",
                    )  # fmt: skip
            text = UNITS.get(name, name).format(**units)
            label(axes, text, f"residual [{unit}]" if axes is left else "", title)
        _limits(left, residual)
        handles = left.get_legend_handles_labels()
        if handles[0]:
            drawn.legend(*handles, loc="outside upper right", ncols=2)
        svg = inline(drawn, "trace-signal", "residual against the signal that explains it")
    caption = (
        "Lines are running medians in each direction of motion: flat at 0 is a complete model."
    )
    return Section(f"What it depends on: {name}", render("figure", svg=svg, caption=caption))


def signal_of(found: Trace, residual: Residual) -> str:
    """The signal to show: the effect's first, or the one on which the unknown rest depends."""
    wanted = [*found.unknown.depends_on]
    for e in found.effects:
        wanted = [*e.effect.depends_on, *wanted]
    for name in [*wanted, "v", "y"]:
        if name in residual.signals:
            return name
    return next(iter(residual.signals))


def running_median(x: Array, values: Array) -> tuple[Array, Array]:
    """Medians of `values` over equally filled stretches of `x`."""
    order = np.argsort(x)
    parts = np.array_split(order, LEVELS)
    return (
        np.array([np.median(x[p]) for p in parts]),
        np.array([np.median(values[p]) for p in parts]),
    )


def _unit(residual: Residual, rotary: bool) -> str:
    unit = shown(rotary).force
    return f"{unit}/s" if residual.equation == "actuator" else unit


def _limits(axes: "Axes", residual: Residual) -> None:
    """Range that holds all but the rarest points of the residual before."""
    top = float(np.quantile(np.abs(residual.before), 0.995))
    axes.set_ylim(-1.25 * top, 1.25 * top)
