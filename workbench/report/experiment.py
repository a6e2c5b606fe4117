"""An experiment as a reference file, a page with its picture, and a table for a terminal."""

import numpy as np

from design.experiment.planned import Experiment, experiment_document
from workbench.report.chart import Area, Chart, Colour, Line, Mark, Panel, chart_html
from workbench.report.view import Section, View, notes, table, view
from workbench.screen import Part, Row, listed, more, tabled

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
PROMISE_STYLES: tuple[tuple[str, Colour, float, str], ...] = (
    ("before", "before", -0.1, "now"),
    ("after", "measured", 0.1, "expected after the run"),
)
RUN_CAPTION = (
    "Reference and simulated run on the model and on machines drawn from what the model leaves open"
    " (band); broken grey: the limits."
)


def reference_text(found: Experiment) -> str:
    """The reference as CSV: t [s] and r, a row a sample of the controller."""
    unit = found.display.position
    rows = [f"{found.h * i:.9g},{r:.9g}" for i, r in enumerate(found.r.tolist())]
    return "\n".join([f"t [s],r [{unit}]", *rows, ""])


def _promised(found: Experiment) -> Part:
    rows = list[Row]()
    for one in found.promise:
        share = "-"
        if one.after is not None and one.value != 0.0:
            share = f"{100.0 * one.after / abs(one.value):.2g} %"
        both = (one.before, one.after)
        halves = ("not identifiable" if x is None else f"{x:.2g}" for x in both)
        rows.append((one.name, f"{one.value:.4g}", one.unit, *halves, share))
    return tabled(PROMISE_HEAD, rows, right=(1, 3, 4, 5))


def experiment_lead(found: Experiment) -> str:
    """What the run is for and what it promises, in a sentence or two."""
    identified = [one for one in found.promise if one.after is not None]
    seconds = f"{found.h * (len(found.r) - 1):.3g} s"
    what = (
        f"{len(identified)} of {len(found.promise)} parameters identifiable from a run of {seconds}"
    )
    shares = [((one.after or 0.0) / max(abs(one.value), 1e-300), one) for one in identified]
    share, worst = max(shares, key=lambda both: both[0], default=(0.0, None))
    if worst is not None and worst.value != 0.0:
        what += f"; the least certain, {worst.name}, within {100.0 * share:.2g} %"
    if found.separation:
        least = min(found.separation, key=lambda one: one.deviations)
        what += (
            f". Hardest to discriminate: {least.one} and {least.other}, by"
            f" {least.deviations:.3g} standard deviations of the noise"
        )
    return (
        f"{what}. No limit is exceeded on {found.safety.machines} simulated machines drawn from"
        " what the model leaves open."
    )


def limit_lines(found: Experiment) -> list[str]:
    """How to run it, and what it uses of the limits."""
    units, limits, used = found.display, found.limits, found.safety.peaks
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
            f"D-efficiency of the whole pieces: {found.efficiency:.0%} of that of the optimal"
            " shares of time"
        )
    return out


@view.register
def _(found: Experiment) -> View:
    """The run, what it promises, its pieces; how it was searched with --verbose."""
    return View(
        f"The run to make next on {found.card}",
        experiment_lead(found),
        [
            _promised(found),
            listed(limit_lines(found)),
            more(listed(search_lines(found))),
            notes(found.remarks),
        ],
        {
            "reference.csv": lambda: reference_text(found),
            "experiment.json": lambda: experiment_document(found),
        },
        lambda: _sections(found),
        lambda: run_chart(found),
        content=lambda: experiment_document(found),
    )


def _sections(found: Experiment) -> list[Section]:
    units, pieces = found.display, list[Row]()
    for i, one in enumerate(found.segments, 1):
        pace = f"{1.0 / one.rate:.3g} s each"
        if one.kind in ("strokes", "creep"):
            pace = f"{one.rate:.3g} {units.velocity}"
        elif one.kind in ("sine", "sweep", "multisine"):
            pace = f"{one.rate:.3g} Hz"
        size = f"{one.amplitude:.4g} {units.position}"
        pieces.append((str(i), PIECE_NAMES[one.kind], size, pace))
    lines = [*limit_lines(found), *search_lines(found), *found.remarks]
    promised = table(_promised(found), lines)
    sections = [
        Section("The run", run_chart(found)),
        Section("What it promises", promised + chart_html(promise_chart(found))),
    ]
    if found.separation:
        apart = [(one.one, one.other, f"{one.deviations:.3g}") for one in found.separation]
        between = ("if the machine has", "rival", "deviations of the noise")
        sections.append(Section("What it discriminates", tabled(between, apart)))
    return [*sections, Section("Pieces", tabled(("", "piece", "amplitude", "pace"), pieces))]


def run_chart(found: Experiment) -> Chart:
    """Position, speed and force along the run, with the limits."""
    units, limits = found.display, found.limits
    seen, panels = found.runs[0], []
    for key, name, unit, edges in (
        ("y", "position", units.position, limits.stroke),
        ("v", "speed", units.velocity, (-limits.speed, limits.speed)),
        ("F", "applied force", units.force, (-limits.force, limits.force)),
    ):
        values = np.array([getattr(run, key) for run in found.runs])
        low, high = np.min(values, axis=0), np.max(values, axis=0)
        lines = [Line("the model", seen.t, values[0])]
        if name == "position":
            lines.append(Line("reference", seen.t, seen.r, "reference", "dotted"))
        marks = [Mark(edge) for edge in edges if np.all(np.isfinite(edges))]
        areas = [Area("machines that it may be", seen.t, low, high)]
        ends = [float(low.min()), float(high.max()), *(mark.at for mark in marks)]
        room = 0.05 * (max(ends) - min(ends))
        panels.append(
            Panel(
                "time [s]", f"{name} [{unit}]", lines, areas=areas, marks=marks,
                y_range=(min(ends) - room, max(ends) + room),
            )
        )  # fmt: skip
    what = "reference, motion, speed and force"
    return Chart("experiment", what, panels, caption=RUN_CAPTION)


def promise_chart(found: Experiment) -> Chart:
    """Half intervals over the value, now and after the run; none where one is not identified."""
    lines = []
    for key, colour, shift, name in PROMISE_STYLES:
        sizes = [getattr(one, key) for one in found.promise]
        identified = [i for i, one in enumerate(sizes) if one and found.promise[i].value]
        shares = [100.0 * sizes[i] / abs(found.promise[i].value) for i in identified]
        lines.append(Line(name, np.array(identified) + shift, np.array(shares), colour, "dots"))
    panel = Panel(
        "", "half interval [% of value]", lines, log_y=True,
        x_range=(-0.5, len(found.promise) - 0.5), names=[one.name for one in found.promise],
    )  # fmt: skip
    return Chart("promise", "half intervals of the parameters, now and after the run", [panel])
