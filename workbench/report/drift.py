"""The report of a drift test: verdict, parameters before and after, the statistic over the logs."""

from typing import TYPE_CHECKING

import numpy as np

from workbench.report.drift_tables import (
    RUN_HEAD,
    SHIFT_HEAD,
    drift_notes,
    drift_sentence,
    logs_of_drift,
    run_rows,
    shift_rows,
    then_of_drift,
)
from workbench.report.figures import BAND, MEASURED, MODEL, REFERENCE, figure, inline, label, style
from workbench.report.notes import report_notes
from workbench.report.page import Section, page
from workbench.report.templating import render
from workbench.steps.drift import Drifted, Tested

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LINEAR_UP_TO = 1.0  # statistic over threshold up to which the axis is linear


def drift_report(found: Drifted) -> str:
    """HTML: whether the machine has changed, in what, and how the logs before it looked."""
    sections, logs = [], _table("The logs", RUN_HEAD, run_rows(found))
    judged = [one for one in found.tests if one.test.shifts]
    if judged:
        last = judged[-1]
        sections += [_pictures(found, last), logs]
        sections.append(
            _table(f"Parameters before and after, {last.source.file}", SHIFT_HEAD, shift_rows(last))
        )
    else:
        sections.append(logs)
    told = report_notes(drift_notes(found), logs_of_drift(found))
    sections.append(Section("Notes", render("lines", lines=told)))
    then = then_of_drift(found)
    return page(f"Drift test of {found.model.card}", drift_sentence(found), sections, then)


def _pictures(found: Drifted, last: Tested) -> Section:
    with style():
        drawn = drift_figure(found, last)
        html = inline(drawn, "drift", "Parameters before and after, and the statistic over logs")
    caption = (
        "Left: each parameter of this log and of the model in force, with 95 % intervals. Right:"
        " how far all of them together have moved; above 1 it is drift."
    )
    html = render("figure", svg=html, caption=caption)
    return Section("Before and after, and over the logs", html)


def drift_figure(found: Drifted, last: Tested) -> "Figure":
    """The parameters of a tested run before and after, and the statistics over the logs."""
    with style():
        drawn = figure(9.0, 4.2)
        left, right = drawn.subplots(1, 2)
        _changes(left, found, last)
        _over_logs(right, found)
    return drawn


def _changes(axes: "Axes", found: Drifted, last: Tested) -> None:
    """Every judged parameter's change with its interval, the model's own, and the margin."""
    shifts = list(last.test.shifts.values())
    place = np.arange(len(shifts), dtype=np.float64)
    margin = 100 * found.settings.margin
    axes.axvspan(-margin, margin, color=BAND, alpha=0.25, lw=0, label="does not matter")
    moved = {shift.name for shift in last.test.moved}
    own = [196 * shift.before_sd / max(abs(shift.before), 1e-300) for shift in shifts]
    axes.errorbar(
        np.zeros(len(shifts)), place - 0.15, xerr=np.minimum(own, 1e4), fmt="o", ms=4,
        color=REFERENCE, label="model in force",
    )  # fmt: skip
    for at, shift in zip(place, shifts, strict=True):
        colour = MODEL if shift.name in moved else MEASURED
        axes.errorbar(
            100 * shift.change, at + 0.15, xerr=196 * shift.sd, fmt="s", ms=4, color=colour,
            label="this log" if at == 0 else None,
        )  # fmt: skip
    axes.set_yticks(place, [shift.name for shift in shifts])
    axes.invert_yaxis()
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=3)
    label(axes, "change from the model in force [%]", "", last.source.file)


def _over_logs(axes: "Axes", found: Drifted) -> None:
    """Both statistics over their thresholds, log by log since the model was put in force."""
    from matplotlib.ticker import MaxNLocator

    seen = found.stream.seen
    number = np.arange(1, len(seen) + 1)
    for name, values, mark, colour in (
        ("this log", [one.single for one in seen], "s", MEASURED),
        ("mean of the logs", [one.mean for one in seen], "o", REFERENCE),
    ):
        known = np.array([np.nan if value is None else value for value in values])
        axes.plot(number, known, mark + "-", ms=4, lw=0.8, color=colour, label=name)
    other = [n for n, one in zip(number, seen, strict=True) if one.verdict == "structure"]
    if other:
        axes.plot(other, np.full(len(other), 1.0), "x", ms=7, color=MODEL, label="other structure")
    axes.axhline(1.0, color=MODEL, lw=1.0)
    axes.set_yscale("symlog", linthresh=LINEAR_UP_TO)
    axes.set_ylim(bottom=-0.05)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=3)
    label(axes, "log since the model was put in force", "statistic over its threshold")


def _table(title: str, head: tuple[str, ...], rows: list[tuple[str, ...]]) -> Section:
    return Section(title, render("table", head=head, rows=rows, lines=[]))
