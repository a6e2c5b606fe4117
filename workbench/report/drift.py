"""A drift test in words, tables and pictures: verdict, parameters before and after, the
statistic over the logs."""

from collections.abc import Sequence

import numpy as np

from design.machine.readable import number, shown_unit
from design.measured.drift_document import drift_document
from design.measured.drift_of_logs import Drifted, Tested
from identification.arrays import Array
from identification.drift.drift_result import DriftTest, Shift, Statistic
from identification.estimation.estimates import reported_estimate
from workbench.remarks import printed_once
from workbench.report.chart import Band, Chart, Colour, Line, Mark, Panel
from workbench.report.model_tables import reasons_once
from workbench.report.next_steps import after_drift
from workbench.report.view import Section, View, notes, report_notes, view
from workbench.screen import Part, Row, instead, tabled
from workbench.verdicts import counted, in_words

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


@view.register
def _(found: Drifted, model_name: str) -> View:
    """Whether the machine has changed, in what, and how the logs before it looked."""
    return View(
        f"Drift test of {found.model.card}",
        drift_sentence(found),
        drift_parts(found),
        {"drift.json": lambda: drift_document(found, model_name)},
        lambda: _sections(found),
        lambda: drift_chart(found, (_judged(found) or found.tests)[-1]),
        advice(found),
        after_drift(found, [one.source.file for one in found.tests], "CARD"),
    )


def _sections(found: Drifted) -> list[Section]:
    sections = [Section("The logs", run_table(found))]
    if judged := _judged(found):
        last = judged[-1]
        picture = Section("Before and after, and over the logs", drift_chart(found, last))
        table = Section(f"Parameters before and after, {last.source.file}", shift_table(last))
        sections = [picture, *sections, table]
    lines = [*what_the_columns_say(found), *detectable_lines(found), *found.remarks]
    return [*sections, Section("Notes", report_notes(lines, logs_of_drift(found)))]


def _judged(found: Drifted) -> list[Tested]:
    return [one for one in found.tests if one.test.shifts]


def drift_chart(found: Drifted, last: Tested) -> Chart:
    """The parameters of a tested run before and after, and the statistics over the logs."""
    what = "Parameters before and after, and the statistic over logs"
    panels = [_changes(found, last), _over_logs(found)]
    return Chart("drift", what, panels, columns=2, shared_x=False, caption=DRIFT_CAPTION)


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
        values = [getattr(one, key) for one in seen]
        known = np.array([np.nan if x is None else max(x, LEAST_STATISTIC) for x in values])
        lines += [Line("", number, known, colour), Line(name, number, known, colour, "dots")]
    most = max([1.0, *(float(np.nanmax(one.y, initial=0.0)) for one in lines)])
    wide = most > LINEAR_UP_TO
    other = number[[one.verdict == "structure" for one in seen]]
    if len(other):
        lines.append(Line("structure changed", other, np.ones(len(other)), "model", "dots"))
    return Panel(
        "log since the model became active", "statistic over its threshold", lines,
        marks=[Mark(1.0)], x_range=(0.5, len(seen) + 0.5), log_y=wide,
        y_range=None if wide else (0.0, 1.1 * most), height=NAMED_HEIGHT,
    )  # fmt: skip


def drift_sentence(found: Drifted) -> str:
    """The verdict over all runs in one or two plain sentences."""
    tests = [one.test for one in found.tests]
    match found.verdict:
        case "structure":
            names = _files(found, "structure")
            return (
                f"Structure changed: no parameters of the model follow {names}. This is no drift;"
                " trace finds the effect that joined."
            )
        case "drift":
            last = [test for test in tests if test.verdict == "drift"][-1]
            if found.slip:
                return f"In {_files(found, 'drift')}: {found.slip}."
            by = ", by the mean over the logs" if last.found_by == "mean" else ""
            parts = [", ".join(map(_changed, last.moved)) + by] if last.moved else []
            if last.unsure:
                first = "something more" if parts else "something changed"
                names = ", ".join(last.unsure)
                parts.append(f"{first}, this log cannot say which of: {names}")
            return f"Drift in {_files(found, 'drift')}: {'; '.join(parts)}; the structure holds."
        case "not_judged":
            newest = [test for test in tests if test.tested] or tests
            return f"INCONCLUSIVE, which is no all-clear: {newest[-1].reason}"
    known = sum(test.verdict == "none" for test in tests)
    margin = f"{100 * found.settings.margin:.3g} %"
    of = counted(len(tests), "log")
    said = f"No drift in {known} of {of}: no change significantly beyond {margin}."
    coarse = sum(test.verdict == "not_judged" for test in tests)
    return said + (f" {coarse} INCONCLUSIVE: see the notes." if coarse else "")


def detectable_sentence(test: DriftTest, limit: float) -> str:
    """The minimum detectable changes of a test, and on which parameters it is inconclusive.

    limit: relative change that it must be able to see. "" where nothing was tested.
    """
    sizes = test.could_have_seen
    if not sizes:
        return ""
    seen = [f"{n} {_percent(x)}" for n, x in sizes.items() if x <= limit]
    coarse = [f"{n} ({_percent(x)})" for n, x in sizes.items() if x > limit]
    coarse += [f"{n} (not identifiable)" for n in test.inconclusive]
    said = f"minimum detectable change: {', '.join(seen) or 'none'}"
    return said + (f"; inconclusive: {', '.join(coarse)}" if coarse else "")


def reason_sentence(test: DriftTest, limit: float) -> str:
    """Why a test has its verdict and, without an alarm, its minimum detectable changes."""
    seen = "" if test.found_by else detectable_sentence(test, limit)
    return "; ".join(filter(None, (test.reason or _all_that_moved(test), seen)))


def _all_that_moved(test: DriftTest) -> str:
    if not test.found_by:
        return "no parameter has moved"
    by = "" if test.found_by != "mean" else " (by the mean of the last logs)"
    moved = []
    for one in test.moved:
        unit, factor = shown_unit(one.unit)
        before, after = (number(factor * value, 4) for value in (one.before, one.after))
        moved.append(f"{one.name} {before} -> {after} {unit}")
    if test.unsure:
        moved.append(f"one of several that are not separable: {', '.join(test.unsure)}")
    return f"moved{by}: {', '.join(moved)}"


def _percent(value: float) -> str:
    return f"{100 * value:.2g} %" if value < 1.0 else "more than 100 %"


def _files(found: Drifted, verdict: str) -> str:
    names = [one.source.file for one in found.tests if one.test.verdict == verdict]
    return ", ".join(dict.fromkeys(names))


def _changed(shift: Shift) -> str:
    change, low, high = map(signed_percent, (shift.change, *shift.interval))
    return f"{shift.name} {change} ({low} to {high})"


def signed_percent(value: float) -> str:
    """A relative change in percent, with its sign."""
    return f"{100 * value:+.2f} %" if abs(value) < 0.1 else f"{100 * value:+.1f} %"


def run_table(found: Drifted) -> Part:
    """Every run's verdict and statistics."""
    head = ("log", "verdict", "this log", "mean of logs", "chi-square", "moved")
    rows = list[Row]()
    for one in found.tests:
        test, verdict = one.test, in_words(one.test.verdict)
        chi = "-" if test.chi_square is None else f"{test.chi_square:.3g} of {test.allowed:.3g}"
        names = ", ".join([*(shift.name for shift in test.moved), *(f"{n}?" for n in test.unsure)])
        statistics = (_over(test.single), _over(test.mean), chi)
        rows.append((one.source.file, verdict, *statistics, names or "-"))
    return tabled(head, rows, right=(), latest=True)


def _over(found: Statistic | None) -> str:
    return "-" if found is None else f"{found.value:.3g} of {found.threshold:.3g}"


def shift_table(one: Tested, logs: Sequence[str] = ()) -> Part:
    """Every parameter of a run before and after; those inconclusive with the reason."""
    head = ("parameter", "before", "after", "unit", "change", "95 % interval")
    rows = list[Row]()
    for shift in one.test.shifts.values():
        change, low, high = map(signed_percent, (shift.change, *shift.interval))
        pairs = ((shift.before, shift.before_sd), (shift.after, shift.after_sd))
        values = [reported_estimate(value, shift.unit, sd).value for value, sd in pairs]
        unit, factor = shown_unit(shift.unit)
        both = ("-" if value is None else number(factor * value, 5) for value in values)
        rows.append((shift.name, *both, unit, change, f"{low} to {high}"))
    rows += [(name, "-", "-", "", "-", why) for name, why in one.test.inconclusive.items()]
    return tabled(head, reasons_once(rows, logs, (4, 3, 5)), right=(1, 2), whole=rows)


def advice(found: Drifted) -> list[str]:
    """What to do next after a drift test, beside a command."""
    if found.slip:
        return ["where a unit is wrong, correct it in the card or the logger, and test again"]
    if found.verdict == "not_judged":
        return ["log longer, with more speeds, reversals and rests; the notes give the minimum"
                " detectable change"]  # fmt: skip
    if found.verdict == "none":
        return ["nothing to change; test the next log with the same `--state FILE`, which finds"
                " slow changes too"]  # fmt: skip
    return []


def what_the_columns_say(found: Drifted) -> list[str]:
    """Legend of the tables, and what counts as a change."""
    setting = found.settings
    return [
        "this log, mean of logs: drift statistic, of its threshold; chi-square: residual of the"
        " model, of its limit",
        f"a change counts beyond {100 * setting.margin:.3g} % of the model's value, and where"
        f" significant: thresholds for a false alarm in {setting.run_length:g} logs or more",
        "the intervals contain the errors of the model and of the log, and how much the machine"
        " varies"
        f" from log to log ({100 * setting.variation:.3g} % until its logs have shown it)",
    ]


def detectable_lines(found: Drifted) -> list[str]:
    """The minimum detectable change of each test, and why a log was inconclusive."""
    out = []
    for one in found.tests:
        said = detectable_sentence(one.test, found.settings.to_be_seen)
        if said:
            out.append(f"{one.source.file}: {said}")
        if one.test.reason:
            out.append(one.test.reason)
        if one.test.found_by == "mean":
            out.append(f"{one.source.file}: found by the mean over the logs, not by this log alone")
    return out


def logs_of_drift(found: Drifted) -> tuple[str, ...]:
    """Names of the logs, as remarks begin with them."""
    names = ((one.source.file, one.source.log.name) for one in found.tests)
    return tuple(dict.fromkeys(name for both in names for name in both))


def drift_parts(found: Drifted) -> list[Part | str]:
    """Every run, the parameters of the last one, and what to know of the tests."""
    logs = logs_of_drift(found)
    legend, seen = what_the_columns_say(found), detectable_lines(found)
    # What is inconclusive, and why, stands in the table too.
    once = printed_once((line.partition("; inconclusive: ")[0] for line in seen), logs)
    short = [line for line in once if line not in drift_sentence(found)]
    return [
        run_table(found),
        shift_table(found.tests[-1], logs),
        instead([f"note: {legend[0]}"], [f"note: {line}" for line in legend]),
        instead([f"note: {x}" for x in short], [f"note: {x}" for x in seen], 4, yields=True),
        notes(found.remarks, logs),
    ]
