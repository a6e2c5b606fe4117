"""A robust design as a table for a terminal and as a page: shares of machines, and their curves."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from design.closed_loop.loop_figures import FIGURES_SAID, PRESENT
from design.machine.documents import design_document
from design.machine.readable import Display, number
from design.robust.outcomes import MEASURES, Measure
from design.robust.robust import NOMINAL, ROBUST, Promise, Robust, Spread, robust_document
from design.robust.search import WEIGHED
from identification.arrays import Array
from workbench.report.chart import Chart, Colour, Line, LineStyle, Mark, Panel, chart_html
from workbench.report.next_steps import after_robust
from workbench.report.reports import controllers, program_sections
from workbench.report.view import Section, View, notes, table, view
from workbench.screen import Part, Row, listed, tabled

ROBUST_HEAD = ("over the machines drawn", "limit", "met", "5 %", "median", "95 %")
BESIDE_HEAD = ("median, and share that meets the limit", "robust", "nominal", "present")
CURVE_STYLES: dict[str, tuple[Colour, LineStyle]] = {
    ROBUST: ("model", "line"),
    NOMINAL: ("before", "dotted"),
    PRESENT: ("measured", "dashed"),
}
ROBUST_CAPTION = (
    "Share of the machines drawn (upwards) on which a measure is at most the value (to the right):"
    " the robust loop, the nominal design's, the present one. Broken: the limit."
)
UNITS_OF_KIND = {"share": (100.0, "%"), "time": (1.0, "s"), "samples": (1.0, "samples")}
UPWARDS = 1e-7  # of the largest value, from machine to machine
AXIS_WIDEST = 12.0  # times the middle of all curves, to which an axis goes


def robust_sentence(found: Robust) -> str:
    """What was found, in one or two sentences."""
    promise, share = found.promises[ROBUST], 100 * found.asked.probability
    if not found.passed:
        return (
            f"No loop of {found.tried} keeps each limit on {share:g} % of the machines drawn; the"
            f" nearest misses: {'; '.join(found.missed)}."
        )
    called = promise.controller.upper()
    with_it = " with the compensator" if promise.compensator else ""
    drawn = f"{found.asked.draws} machines drawn"
    if promise.every == 1.0:
        return f"{called}{with_it}: meets every limit on each of {drawn}."
    shares = [one.share for one in promise.measures.values() if one.share is not None]
    return (
        f"{called}{with_it}: each limit holds on at least {100 * min(shares, default=1.0):.0f} % of"
        f" {drawn}, all of them at once on {100 * promise.every:.0f} %."
    )


def promise_table(found: Robust) -> Part:
    """A row a measure of the robust loop."""
    display, rows = found.design.display, list[Row]()
    for one, spread in _of(found.promises[ROBUST]):
        limit = "" if spread.limit is None else _said(one, spread.limit, display)
        if limit not in ("", "none"):
            limit = f"{'at least' if one.floor else 'at most'} {limit}"
        values = (_said(one, value, display) for value in (spread.low, spread.median, spread.high))
        rows.append((one.words, limit, _percent(spread), *values))
    return tabled(ROBUST_HEAD, rows, right=(2, 3, 4, 5))


def beside_table(found: Robust) -> Part:
    """The medians of every loop, and the shares."""
    rows = list[Row]()
    for one, _ in _of(found.promises[ROBUST]):
        cells = dict.fromkeys(CURVE_STYLES, "-")
        for name, promise in found.promises.items():
            if spread := promise.measures.get(one.name):
                share = f" ({_percent(spread)})" if _percent(spread) else ""
                cells[name] = _said(one, spread.median, found.design.display) + share
        rows.append((one.words, *cells.values()))
    return tabled(BESIDE_HEAD, rows, right=(1, 2, 3))


def _percent(spread: Spread) -> str:
    return "" if spread.share is None else f"{100 * spread.share:.0f} %"


def _of(promise: Promise) -> list[tuple[Measure, Spread]]:
    return [(one, promise.measures[one.name]) for one in MEASURES if one.name in promise.measures]


def _said(one: Measure, value: float, display: Display) -> str:
    """A value of a measure in words."""
    if not np.isfinite(value):
        return "any" if one.floor else "runs away"
    if one.kind == "length":
        return "none" if value == 0.0 else display.length_text(value)
    factor, unit = UNITS_OF_KIND.get(one.kind, (1.0, ""))
    return f"{number(factor * value)} {unit}".rstrip()


def robust_lines(found: Robust) -> list[str]:
    """How it was chosen, what it misses, and remarks."""
    remarks = (*found.missed, *found.remarks)
    return [*choice_lines(found), *(f"note: {one}" for one in remarks)]


def choice_lines(found: Robust) -> list[str]:
    """How it was chosen."""
    speed, factor = found.design.display.shown("velocity")
    drift = ", ".join(f"{n} {100 * s:.2g} %" for n, s in (found.asked.drift or {}).items())
    return [
        f"the best of {found.tried} loops on {found.asked.draws} machines: of those whose limits"
        f" hold on {100 * found.asked.probability:g} % of them, the one with the least"
        f" {', '.join(WEIGHED)} (mean logarithm of the medians); the shares are counted on as many"
        f" drawn anew (seed {found.asked.seed})",
        FIGURES_SAID,
        *([f"drawn with the drift found so far: {drift}"] if drift else []),
        f"slow ramp: {number(factor * found.speed)} {speed}, half the narrowest stick band",
    ]


@view.register
def _(found: Robust) -> View:
    """The shares of the machines, the curves over them, the controllers and their equations."""
    return View(
        f"Robust design for {found.design.card}",
        robust_sentence(found),
        [
            promise_table(found),
            beside_table(found),
            listed(choice_lines(found)),
            notes((*found.missed, *found.remarks)),
        ],
        {
            "design.json": lambda: design_document(found.design),
            "robust.json": lambda: robust_document(found),
        },
        lambda: _sections(found),
        lambda: robust_chart(found),
        step=after_robust(found, Path("MODEL"), Path()),
        content=lambda: robust_document(found),
    )


def _sections(found: Robust) -> list[Section]:
    chart = robust_chart(found)
    promised = table(promise_table(found), robust_lines(found))
    picture = chart_html(chart) if chart.panels else ""
    return [
        Section("Over the machines that there may be", picture + promised),
        Section("Beside the nominal design and the present controller", beside_table(found)),
        controllers(found.design),
        *program_sections(found.design),
    ]


def robust_chart(found: Robust) -> Chart:
    """The share of machines over each measure's value, for every loop."""
    panels = list[Panel]()
    for one, _ in _of(found.promises[ROBUST]):
        every = [promise.found.values.get(one.name) for promise in found.promises.values()]
        values = np.concatenate([np.zeros(0), *(each for each in every if each is not None)])
        values = values[np.isfinite(values)]
        if values.size and float(np.ptp(values)) > 0.0:  # where all are one there is no curve
            panels.append(_shares(found, one))
    what = "shares of machines by measure"
    return Chart("robust", what, panels, columns=2, shared_x=False, caption=ROBUST_CAPTION)


def _shares(found: Robust, one: Measure) -> Panel:
    factor, unit = UNITS_OF_KIND.get(one.kind, (1.0, ""))
    if one.kind == "length":
        unit, factor = found.design.display.shown("position")
    limit = found.promises[ROBUST].measures[one.name].limit
    lines = []
    for name, promise in found.promises.items():
        values = promise.found.values.get(one.name)
        if values is None:
            continue
        at = np.sort(factor * values)
        share = 100.0 * np.arange(1, len(at) + 1) / len(at)
        finite = np.isfinite(at)
        at, share = at[finite], share[finite]
        # Where many machines have one value the line goes up, which an axis takes as going on.
        apart = UPWARDS * float(np.max(np.abs(at), initial=1e-9)) * np.arange(len(at))
        lines.append(Line(name, at + apart, share, *CURVE_STYLES[name]))
    return Panel(
        one.words.split(",")[0] + (f" [{unit}]" if unit else ""), "share of machines [%]", lines,
        marks=[] if limit is None else [Mark(factor * limit, "x")],
        x_range=_within([line.x for line in lines], None if limit is None else factor * limit),
        y_range=(-3.0, 103.0),
    )  # fmt: skip


def _within(arrays: Sequence[Array], limit: float | None) -> tuple[float, float] | None:
    """The axis to the curves, but not to the far end of one that runs off."""
    every = np.concatenate([*arrays, [] if limit is None else [limit]])
    if every.size == 0:
        return None
    low, high = float(np.min(every)), float(np.max(every))
    middle = max(float(np.median(np.abs(every))), limit or 0.0)
    high = min(high, AXIS_WIDEST * middle) if middle > 0.0 else high
    room = 0.05 * max(high - low, 1e-9 * max(abs(high), 1.0))
    return low - room, high + room
