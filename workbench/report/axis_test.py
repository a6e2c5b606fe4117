"""The axis test on one page: a light, why, the numbers with their limits, and two pictures."""

import numpy as np

from design.machine.readable import in_digits, number, shown_unit
from design.measured.axis_document import axis_document
from design.measured.axis_test import AxisTest, Quantity
from identification.estimation.estimates import counted
from workbench.report.chart import Area, Band, Chart, Line, Panel, chart_html
from workbench.report.templating import render
from workbench.report.view import Section, View, view
from workbench.screen import Row, listed, tabled

AXIS_HEAD = ("what", "value", "unit", "95 % interval", "limits", "light")
LAMPS = {"green": "green", "yellow": "YELLOW", "red": "RED", "": "-"}
SOURCE_OF_LIMITS = {"card": "card", "registry": "logs", "usual": "usual"}
AXIS_LEAD = "friction, breakaway, mass and play of one log, each with its limits."
MOST_REASONS = 4  # on the printed page
AXIS_HEIGHT = 160
EACH_DIRECTION = (("F_cp", "positive direction"), ("F_cn", "negative direction"))


def axis_sentence(test: AxisTest) -> str:
    """The answer: the light and, where it is not green, the first reason."""
    light = test.light.upper()
    judged = sum(1 for one in test.quantities if one.light)
    if test.light == "green":
        return f"{light}: {test.machine} is within its limits in {judged} of {judged} quantities."
    first, *rest = test.reasons
    return f"{light}: {first}{f' (and {len(rest)} more)' if rest else ''}."


def _row(one: Quantity) -> Row:
    estimate = one.estimate
    (unit, factor) = ("%", 100.0) if estimate.unit == "1" else shown_unit(estimate.unit)
    limits = "-"
    if one.allowed is not None:
        low, high = (number(factor * x, 4) for x in (one.allowed.low, one.allowed.high))
        limits = f"{low} to {high} ({SOURCE_OF_LIMITS[one.allowed.source]})"
    value, interval = "-", (estimate.reason or "not identifiable").partition(";")[0]
    if estimate.value is not None:
        value, interval = number(factor * estimate.value, 4), ""
        if estimate.low is not None and estimate.high is not None:
            every = [factor * x for x in (estimate.value, estimate.low, estimate.high)]
            sd = factor * (0.25 * (estimate.high - estimate.low))
            value, *ends = in_digits(every, every[0], sd)
            interval = " to ".join(ends)
    return one.meaning, value, unit, interval, limits, LAMPS[one.light]


@view.register
def _(test: AxisTest) -> View:
    """The light, the numbers and the reasons; a page to be printed."""
    return View(
        f"Axis test of {test.machine}",
        axis_sentence(test),
        [
            tabled(AXIS_HEAD, map(_row, test.quantities)),
            listed(f"{n}. {line}" for n, line in enumerate(test.reasons, 1)),
            listed((f"note: {line}" for line in test.remarks), most=4),
        ],
        {"axis_test.json": lambda: axis_document(test)},
        lambda: _sections(test),
        lambda: axis_charts(test)[0],
        lead=f"{test.machine}: {AXIS_LEAD}",
    )


def _sections(test: AxisTest) -> list[Section]:
    log = test.source.log
    facts = [
        f"log {test.source.file}, {number(log.duration, 4)} s at {number(1.0 / log.h, 4)} Hz",
        f"{counted(test.breakaways[0], 'breakaway')} in positive, {test.breakaways[1]} in negative"
        " direction",
        "limits of the card alone; no registry was given",
    ]
    if test.earlier is not None:
        many = max((len(values) for values in test.earlier.values.values()), default=0)
        facts[-1] = (
            f"limits of the card; else the mean of the machine's last {many} sound logs +- 3 sd"
            " (wider of few logs; never nearer than 2 %, of breakaway 5 %)"
        )
    reasons, most = list(test.reasons), MOST_REASONS
    if len(reasons) > most:
        reasons[most - 1 :] = [f"{len(reasons) - most + 1} more, which the table shows"]
    if len(reasons) == 1:  # which stands beside the lamp
        reasons = []
    body = render(
        "axis_test", light=test.light, sentence=axis_sentence(test).partition(": ")[2],
        reasons=reasons, head=AXIS_HEAD, rows=[(_row(one), one) for one in test.quantities],
    )  # fmt: skip
    drawn = "".join(str(chart_html(one)) for one in axis_charts(test))
    end = render("axis_test_end", facts=facts, remarks=test.remarks)
    return [Section("Result", body), Section("Friction", drawn), Section("Test", end)]


def axis_charts(test: AxisTest) -> list[Chart]:
    """Friction along the travel and, where there is a past, over the last logs."""
    what = "Coulomb friction of each direction along the travel"
    along = Chart("travel", what, [_along_panel(test)], shared_x=False)
    past = [panel for name, said in EACH_DIRECTION if (panel := _history_panel(test, name, said))]
    if not past:
        return [along]
    what = "Coulomb friction over the last logs, with its limits"
    return [along, Chart("logs", what, past, columns=2)]


def _along_panel(test: AxisTest) -> Panel:
    """Coulomb friction of both directions along the travel, as sizes."""
    (unit, factor), travel = test.display.shown("position"), test.travel
    found = np.concatenate([travel.positive, travel.negative])
    found = found[np.isfinite(found)]
    x = factor * travel.place
    up, down = travel.positive, travel.negative
    return Panel(
        f"position [{unit}]", f"friction [{test.display.force}]",
        [Line("positive direction", x, up, "measured"),
         Line("negative direction", x, down, "other")],
        "along the travel",
        areas=[Area("", x, up - 2 * travel.positive_sd, up + 2 * travel.positive_sd),
               Area("", x, down - 2 * travel.negative_sd, down + 2 * travel.negative_sd)],
        y_range=(0.0, 1.2 * float(np.max(found)) if len(found) else 1.2), height=AXIS_HEIGHT,
    )  # fmt: skip


def _history_panel(test: AxisTest, name: str, said: str) -> Panel | None:
    """A Coulomb level over the last logs and this one, with its limits; None without a past."""
    one = test.of(name)
    past = [value for _, value in test.earlier.values.get(name, ())] if test.earlier else []
    if not past:
        return None
    own = [] if one.estimate.value is None else [one.estimate.value]
    values = np.array([*past, *own])
    lines = [Line("earlier logs", np.arange(-len(past), len(own), 1.0), values, "measured")]
    if own:
        lines.append(Line("this log", np.array([-0.4, 0.4]), np.repeat(own, 2), "model", "bold"))
    bands = [] if one.allowed is None else [Band("limits", one.allowed.low, one.allowed.high)]
    every = np.array([*values, *(edge for band in bands for edge in (band.low, band.high))])
    low, high = float(np.nanmin(every)), float(np.nanmax(every))
    room = 0.1 * (high - low) or 0.1 * abs(high)
    return Panel(
        "logs before this one", f"friction [{test.display.force}]", lines,
        f"{said}, over the last logs", bands=bands, x_range=(-len(past) - 0.5, 0.6),
        y_range=(low - room, high + room), height=AXIS_HEIGHT,
    )  # fmt: skip
