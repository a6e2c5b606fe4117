"""A drift test: verdict, parameters before and after, the statistic over the logs."""

from collections.abc import Sequence

import numpy as np

from identification.arrays import Array
from workbench.report.chart import Band, Chart, Colour, Line, Mark, Panel, chart_html
from workbench.report.drift_tables import (
    detectable_lines,
    drift_parts,
    drift_sentence,
    logs_of_drift,
    run_table,
    shift_table,
    then_of_drift,
    what_the_columns_say,
)
from workbench.report.view import Section, View, lines_section, report_notes, table_section
from workbench.steps.drift import Drifted, Tested, drift_document

WIDEST_CHANGE = 1e4  # half an interval that is drawn [%]
LEAST_STATISTIC = 1e-3  # over its threshold, that is drawn
BESIDE = 0.12  # of this log beside the model, in places of the axis of the parameters
UPRIGHT = 0.01  # half the width of an upright line, which goes on in x
LINEAR_UP_TO = 10.0  # statistic over threshold up to which the axis is linear
NAMED_HEIGHT = 280
THIS_LOG: tuple[tuple[str, bool, Colour], ...] = (
    ("this log", False, "measured"),
    ("this log, moved", True, "model"),
)
STATISTICS: tuple[tuple[str, str, Colour], ...] = (
    ("this log", "single", "measured"),
    ("mean of the logs", "mean", "reference"),
)
DRIFT_CAPTION = (
    "Left: each parameter of this log and of the active model, with 95 % intervals. Right:"
    " how far all of them together have moved; above 1 it is drift."
)


def drift_view(found: Drifted, model_name: str) -> View:
    """Whether the machine has changed, in what, and how the logs before it looked."""
    return View(
        f"Drift test of {found.model.card}",
        drift_sentence(found),
        drift_parts(found),
        lambda: drift_document(found, model_name),
        {"drift.json": lambda: drift_document(found, model_name)},
        lambda: _sections(found),
        lambda: drift_chart(found, (_judged(found) or found.tests)[-1]),
        then_of_drift(found),
        then_by_command=found.verdict not in ("none", "not_judged"),
    )


def _sections(found: Drifted) -> list[Section]:
    sections, logs = [], table_section("The logs", run_table(found))
    judged = _judged(found)
    if judged:
        last = judged[-1]
        picture = chart_html(drift_chart(found, last), DRIFT_CAPTION)
        sections.append(Section("Before and after, and over the logs", picture))
    sections.append(logs)
    if judged:
        title = f"Parameters before and after, {last.source.file}"
        sections.append(table_section(title, shift_table(last)))
    lines = [*what_the_columns_say(found), *detectable_lines(found), *found.remarks]
    notes = report_notes(lines, logs_of_drift(found))
    return [*sections, lines_section("Notes", notes)]


def _judged(found: Drifted) -> list[Tested]:
    return [one for one in found.tests if one.test.shifts]


def drift_chart(found: Drifted, last: Tested) -> Chart:
    """The parameters of a tested run before and after, and the statistics over the logs."""
    what = "Parameters before and after, and the statistic over logs"
    panels = [_changes(found, last), _over_logs(found)]
    return Chart("drift", what, panels, columns=2, shared_x=False)


def _changes(found: Drifted, last: Tested) -> Panel:
    """Every tested parameter's change with its interval, the model's own, and the margin."""
    shifts = list(last.test.shifts.values())
    moved = {shift.name for shift in last.test.moved}
    margin, n = 100 * found.settings.margin, len(shifts)
    place = np.arange(n, dtype=np.float64)
    change = np.array([100 * shift.change for shift in shifts])
    half = np.array([196 * shift.sd for shift in shifts])
    own = np.array([196 * one.before_sd / max(abs(one.before), 1e-300) for one in shifts])
    lines = _with_intervals("active model", place - BESIDE, np.zeros(n), own, "reference")
    for name, is_moved, colour in THIS_LOG:
        of = np.array([(shift.name in moved) is is_moved for shift in shifts], dtype=bool)
        if np.any(of):
            where = place[of] + BESIDE
            lines += _with_intervals(name, where, change[of], half[of], colour)
    return Panel(
        "", "change [%]", lines, f"{last.source.file}: change from the active model",
        bands=[Band("does not matter", -margin, margin, "y", "band")],
        x_range=(-0.5, n - 0.5), names=[shift.name for shift in shifts], height=NAMED_HEIGHT,
    )  # fmt: skip


def _with_intervals(
    name: str, place: Array, values: Array, half: Array, colour: Colour
) -> list[Line]:
    """Dots, and an upright line through each."""
    half = np.minimum(half, WIDEST_CHANGE)
    upright = [
        Line("", at + np.array([-UPRIGHT, UPRIGHT]), value + np.array([-size, size]), colour)
        for at, value, size in zip(place, values, half, strict=True)
    ]
    return [*upright, Line(name, place, values, colour, "dots")]


def _over_logs(found: Drifted) -> Panel:
    """Both statistics over their thresholds, log by log since the model became active."""
    seen = found.stream.seen
    number = np.arange(1.0, len(seen) + 1.0)
    lines = []
    for name, key, colour in STATISTICS:
        known = _known([getattr(one, key) for one in seen])
        lines += [Line("", number, known, colour), Line(name, number, known, colour, "dots")]
    most = max([1.0, *(float(np.nanmax(one.y, initial=0.0)) for one in lines)])
    wide = most > LINEAR_UP_TO
    other = number[[one.verdict == "structure" for one in seen]]
    if len(other):
        lines.append(Line("other structure", other, np.ones(len(other)), "model", "dots"))
    return Panel(
        "log since the model became active", "statistic over its threshold", lines,
        marks=[Mark(1.0)], x_range=(0.5, len(seen) + 0.5), log_y=wide,
        y_range=None if wide else (0.0, 1.1 * most), height=NAMED_HEIGHT,
    )  # fmt: skip


def _known(values: Sequence[float | None]) -> Array:
    return np.array([np.nan if one is None else max(one, LEAST_STATISTIC) for one in values])
