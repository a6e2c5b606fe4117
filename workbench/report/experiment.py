"""An experiment as a reference file, a page with its picture, and a table for a terminal."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from identification.arrays import Array
from workbench.cards.parameter_units import shown
from workbench.output import Row, written
from workbench.report.figures import (
    BAND,
    GREY,
    MEASURED,
    MODEL,
    REFERENCE,
    figure,
    inline,
    label,
    line,
    style,
    thinned,
)
from workbench.report.notes import notes
from workbench.report.page import Section, page
from workbench.report.templating import render
from workbench.screen import Screen, listed, more, screen, tabled
from workbench.steps.experiment.planned import Experiment, Promised

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PROMISE_HEAD = ("parameter", "value", "unit", "now +-", "after +-", "after / value")
PIECE_NAMES = {
    "steps": "a step there and back",
    "strokes": "a stroke there and back",
    "creep": "a triangle with reversals",
    "sine": "three sines",
    "sweep": "a sweep of sines",
    "stairs": "stairs up and down",
    "multisine": "a multisine",
}
EXPERIMENT_BAND_POINTS = 600


def reference_text(found: Experiment) -> str:
    """The reference as CSV: t [s] and r, a row a sample of the controller."""
    unit = shown(found.motion == "rotary").position
    rows = [f"{found.h * i:.9g},{r:.9g}" for i, r in enumerate(found.r.tolist())]
    return "\n".join([f"t [s],r [{unit}]", *rows, ""])


def promise_rows(found: Experiment) -> list[Row]:
    """A row a parameter, by `PROMISE_HEAD`."""
    return [_row(one) for one in found.promise]


def _row(one: Promised) -> Row:
    now = "not told" if one.before is None else f"{one.before:.2g}"
    after = "not told" if one.after is None else f"{one.after:.2g}"
    share = "-" if one.after is None or one.value == 0.0 else _percent(one.after / abs(one.value))
    return one.name, f"{one.value:.4g}", one.unit, now, after, share


def _percent(share: float) -> str:
    return f"{100.0 * share:.2g} %"


def experiment_lead(found: Experiment) -> str:
    """What the run is for and what it promises, in a sentence or two."""
    told = [one for one in found.promise if one.after is not None]
    seconds = f"{found.h * (len(found.r) - 1):.3g} s"
    what = f"{len(told)} of {len(found.promise)} parameters told by a run of {seconds}"
    worst = max(
        told, key=lambda one: (one.after or 0.0) / max(abs(one.value), 1e-300), default=None
    )
    if worst is not None and worst.value != 0.0:
        share = (worst.after or 0.0) / abs(worst.value)
        what += f"; the least certain, {worst.name}, within {_percent(share)}"
    if found.separation:
        least = min(found.separation, key=lambda one: one.deviations)
        what += (
            f". Tells {least.one} from {least.other}, the hardest to tell apart, by"
            f" {least.deviations:.3g} deviations of the noise"
        )
    return f"{what}. {_safe(found)}"


def _safe(found: Experiment) -> str:
    many = found.safety.machines
    if found.safety.exceeding:
        return f"NOT SAFE: {found.safety.exceeding} of {many} simulated machines exceed a limit."
    return (
        f"No limit is exceeded on {many} simulated machines drawn from what the model leaves open."
    )


def experiment_lines(found: Experiment) -> list[str]:
    """Limits and what the run uses of them, how it is put together, remarks."""
    return [*limit_lines(found), *search_lines(found), *found.remarks]


def limit_lines(found: Experiment) -> list[str]:
    """How to run it, and what it uses of the limits."""
    units, limits, used = shown(found.motion == "rotary"), found.limits, found.safety.peaks
    r_0 = float(found.r[0])
    return [
        f"begin with the machine at rest at {r_0:.4g} {units.position} ({found.controller} moves"
        f" it); log every {1e3 * found.h:.4g} ms or faster, then identify the log alone",
        f"position {used.low:.3g} to {used.high:.3g} of {limits.stroke[0]:.3g} to"
        f" {limits.stroke[1]:.3g} {units.position}, speed {used.speed:.3g} of {limits.speed:.3g}"
        f" {units.velocity}, force {used.force:.3g} of {limits.force:.3g} {units.force}, command"
        f" {used.command:.3g} {found.command_unit}",
    ]


def search_lines(found: Experiment) -> list[str]:
    """How the run is put together."""
    tried = found.tried
    out = [f"{len(found.segments)} pieces out of {tried[0]}, {tried[1]} whole runs tried"]
    if found.efficiency is not None:
        out.append(
            f"whole pieces tell {found.efficiency:.0%} of what the best shares of the time would,"
            " a parameter"
        )
    return out


def experiment_view(found: Experiment, folder: Path | None) -> Screen:
    """The experiment for a terminal; how it was searched with --verbose."""
    names = ("reference.csv", "experiment.json", "report.html")
    return screen(
        experiment_lead(found),
        tabled(PROMISE_HEAD, promise_rows(found), right=(1, 3, 4, 5)),
        listed(limit_lines(found)),
        more(listed(search_lines(found))),
        notes(found.remarks),
        *([] if folder is None else [written(folder, *names)]),
    )


def experiment_report(found: Experiment) -> str:
    """HTML: the picture, the promise, the pieces, remarks."""
    with style():
        svg = inline(experiment_figure(found), "experiment", "reference, motion, speed and force")
    caption = (
        "Reference and simulated run on the model (orange) and on machines drawn from what the"
        " model leaves open (band); broken grey: the limits."
    )
    units = shown(found.motion == "rotary")
    pieces = [
        (
            str(i + 1),
            PIECE_NAMES[one.kind],
            f"{one.amplitude:.4g} {units.position}",
            _rate(found, i),
        )
        for i, one in enumerate(found.segments)
    ]
    sections = [
        Section("The run", render("figure", svg=svg, caption=caption)),
        Section("What it promises", render("table", head=PROMISE_HEAD, rows=promise_rows(found),
                                           lines=experiment_lines(found))),
    ]  # fmt: skip
    if found.separation:
        apart = [(one.one, one.other, f"{one.deviations:.3g}") for one in found.separation]
        between = ("if the machine has", "rival", "deviations of the noise")
        sections.append(Section("What it tells apart", render("table", head=between, rows=apart,
                                                              lines=[])))  # fmt: skip
    head = ("", "piece", "amplitude", "pace")
    sections.append(Section("Pieces", render("table", head=head, rows=pieces, lines=[])))
    return page(f"The run to make next on {found.card}", experiment_lead(found), sections)


def _rate(found: Experiment, index: int) -> str:
    one = found.segments[index]
    if one.kind in ("strokes", "creep"):
        return f"{one.rate:.3g} {shown(found.motion == 'rotary').velocity}"
    if one.kind in ("sine", "sweep", "multisine"):
        return f"{one.rate:.3g} Hz"
    return f"{1.0 / one.rate:.3g} s each"


def experiment_figure(found: Experiment) -> "Figure":
    """Position, speed and force along the run, with the limits, and the intervals it promises."""
    units, seen, limits = shown(found.motion == "rotary"), found.traces, found.limits
    with style():
        drawn = figure(9.0, 8.6)
        top, speed, force, promise = drawn.subplots(
            4, 1, gridspec_kw={"height_ratios": [3, 1.6, 1.6, 1.8]}
        )
        for axes, values, name, unit in (
            (top, seen.y, "position", units.position),
            (speed, seen.v, "speed", units.velocity),
            (force, seen.F, "applied force", units.force),
        ):
            _band(axes, seen.t, values)
            line(axes, seen.t, values[0], color=MODEL, lw=1.0, label="the model")
            label(axes, "", f"{name} [{unit}]")
            axes.margins(x=0.0)
        line(top, seen.t, seen.r, color=REFERENCE, lw=0.9, ls=":", label="reference")
        for axes, edges in (
            (top, limits.stroke),
            (speed, (-limits.speed, limits.speed)),
            (force, (-limits.force, limits.force)),
        ):
            for edge in edges if np.all(np.isfinite(edges)) else ():
                axes.axhline(edge, color=GREY, ls="--", lw=0.9)
        force.set_xlabel("time [s]")
        top.legend(loc="upper right", ncols=3)
        _promise(promise, found)
    return drawn


def _band(axes: "Axes", t: Array, values: Array) -> None:
    low, high = np.min(values, axis=0), np.max(values, axis=0)
    at, low = thinned(t, low, EXPERIMENT_BAND_POINTS)
    on, high = thinned(t, high, EXPERIMENT_BAND_POINTS)
    both = np.union1d(at, on)
    axes.fill_between(both, np.interp(both, at, low), np.interp(both, on, high), color=BAND,
                      alpha=0.45, lw=0, label="machines that it may be")  # fmt: skip


def _promise(axes: "Axes", found: Experiment) -> None:
    """Half intervals over the value, now and after the run."""
    place = np.arange(len(found.promise))
    for key, colour, shift, name in (
        ("before", GREY, -0.18, "now"), ("after", MEASURED, 0.18, "promised after the run")
    ):  # fmt: skip
        sizes = [getattr(one, key) for one in found.promise]
        told = [i for i, one in enumerate(sizes) if one and found.promise[i].value]
        shares = [100.0 * sizes[i] / abs(found.promise[i].value) for i in told]
        axes.bar(place[told] + shift, shares, 0.34, color=colour, label=name)
        for i in (i for i, one in enumerate(sizes) if one is None):
            axes.text(place[i] + shift, 0.02, "not told", rotation=90, fontsize=7, ha="center",
                      va="bottom", color=colour, transform=axes.get_xaxis_transform())  # fmt: skip
    axes.set_yscale("log")
    axes.set_xticks(place, [one.name for one in found.promise], rotation=20)
    label(axes, "", "half interval [% of value]")
    axes.legend(loc="upper right", ncols=2)
