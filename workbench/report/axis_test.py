"""The axis test on one page: a light, why, the numbers with their limits, and two pictures."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from identification.arrays import Array
from workbench.cards.readable import in_digits, number, shown_unit, units_of
from workbench.output import Row, written
from workbench.report.chart import Area, Band, Chart, Line, Panel, chart_html
from workbench.report.page import Section, page
from workbench.report.templating import render
from workbench.screen import Screen, listed, screen, tabled
from workbench.steps.axis_test import AxisTest, Earlier, Quantity

AXIS_HEAD = ("what", "value", "unit", "95 % interval", "limits", "light")
WORDS = {"green": "green", "yellow": "YELLOW", "red": "RED", "": "-"}
SOURCE = {"card": "card", "registry": "own logs", "usual": "usual"}
AXIS_HEIGHT = 210
HISTORY_NAMES = (
    ("F_cp", "positive direction", "measured"),
    ("F_cn", "negative direction", "other"),
)


def axis_sentence(test: AxisTest) -> str:
    """The answer: the light and, where it is not green, the first reason."""
    light = test.light.upper()
    judged = sum(1 for one in test.quantities if one.light)
    if test.light == "green":
        return f"{light}: {test.machine} is within its limits in {judged} of {judged} numbers."
    first, *rest = test.reasons
    more = f" (and {len(rest)} more)" if rest else ""
    return f"{light}: {first}{more}."


def axis_rows(test: AxisTest) -> list[Row]:
    """A row a quantity."""
    return [_row(one) for one in test.quantities]


def _row(one: Quantity) -> Row:
    told = one.estimate
    (unit, factor) = ("%", 100.0) if told.unit == "1" else shown_unit(told.unit)
    limits = "-"
    if one.allowed is not None:
        low, high = (number(factor * x, 4) for x in (one.allowed.low, one.allowed.high))
        limits = f"{low} to {high} ({SOURCE[one.allowed.source]})"
    if told.value is None:
        why = (told.reason or "not told").partition(";")[0]
        return one.meaning, "-", unit, why, limits, WORDS[one.light]
    if told.low is None or told.high is None:
        return one.meaning, number(factor * told.value, 4), unit, "", limits, WORDS[one.light]
    spread = 0.25 * (told.high - told.low)
    value, low, high = in_digits(
        [factor * x for x in (told.value, told.low, told.high)], factor * told.value,
        factor * spread,
    )  # fmt: skip
    return one.meaning, value, unit, f"{low} to {high}", limits, WORDS[one.light]


def axis_view(test: AxisTest, folder: Path) -> Screen:
    """The light, the numbers and the reasons, for a terminal."""
    return screen(
        axis_sentence(test),
        tabled(AXIS_HEAD, axis_rows(test)),
        listed(f"{n}. {line}" for n, line in enumerate(test.reasons, 1)),
        listed((f"note: {line}" for line in test.remarks), most=4),
        written(folder, "axis_test.json", "report.html"),
    )


def axis_report(test: AxisTest, tested: str) -> str:
    """HTML of one printed page; tested: when, in words."""
    log = test.source.log
    facts = [
        f"log {test.source.file}, {number(log.duration, 4)} s at {number(1.0 / log.h, 4)} Hz",
        f"{test.breakaways[0]} breakaways in positive, {test.breakaways[1]} in negative direction",
        _limits_said(test.earlier),
        f"tested {tested}",
    ]
    body = render(
        "axis_test", light=test.light, sentence=axis_sentence(test).partition(": ")[2],
        reasons=test.reasons if len(test.reasons) > 1 else (),
        head=AXIS_HEAD, rows=list(zip(axis_rows(test), test.quantities, strict=True)),
    )  # fmt: skip
    charts = chart_html(axis_chart(test), _caption(test))
    end = render("axis_test_end", facts=[one for one in facts if one], remarks=test.remarks)
    lead = f"{test.machine}: friction, breakaway, mass and play of one log, each with its limits."
    return page(
        f"Axis test of {test.machine}", lead,
        [Section("Result", body), Section("Friction", str(charts)), Section("Test", end)],
    )  # fmt: skip


def axis_chart(test: AxisTest) -> Chart:
    """Friction along the travel and, where there is a past, over the last logs."""
    panels = [along_panel(test)]
    past = history_panel(test)
    if past is not None:
        panels.append(past)
    return Chart("axis", "friction along the travel, and over the last logs", panels,
                 columns=2 if past else 1, shared_x=False)  # fmt: skip


def along_panel(test: AxisTest) -> Panel:
    """Coulomb friction of both directions along the travel, as sizes."""
    units, travel = units_of(test.rotary), test.travel
    x = units.position.factor * travel.place
    lines, areas = [], []
    for name, level, sd, colour in (
        ("positive direction", travel.positive, travel.positive_sd, "measured"),
        ("negative direction", travel.negative, travel.negative_sd, "other"),
    ):
        areas.append(Area("", x, level - 2 * sd, level + 2 * sd))
        lines.append(Line(name, x, level, colour))  # type: ignore[arg-type]
    return Panel(
        f"position [{units.position.name}]", f"Coulomb friction [{units.force.name}]", lines,
        "along the travel", areas=areas, y_range=_from_zero(*(one.y for one in lines)),
        height=AXIS_HEIGHT,
    )  # fmt: skip


def history_panel(test: AxisTest) -> Panel | None:
    """Coulomb friction over the last logs and this one, with its limits; None without a past."""
    if test.earlier is None:
        return None
    lines, bands = [], []
    for name, said, colour in HISTORY_NAMES:
        one = test.of(name)
        past = [value for _, value in test.earlier.values.get(name, ())]
        if not past:
            continue
        now = [] if one.estimate.value is None else [one.estimate.value]
        at = np.arange(1.0 - len(past), 1.0)
        values = np.array(past)
        lines.append(Line(f"{said}, earlier logs", at - 1, values, colour))  # type: ignore[arg-type]
        if now:
            lines.append(Line(f"{said}, this log", np.zeros(1), np.array(now), "model", "dots"))
        if one.allowed is not None:
            bands.append(Band(f"limits, {said}", one.allowed.low, one.allowed.high))
    if not lines:
        return None
    edges = [np.array([band.low, band.high]) for band in bands]
    return Panel(
        "logs before this one", f"Coulomb friction [{units_of(test.rotary).force.name}]", lines,
        "over the last logs", bands=bands, y_range=_close(*(one.y for one in lines), *edges),
        height=AXIS_HEIGHT,
    )  # fmt: skip


def _from_zero(*values: Array) -> tuple[float, float]:
    """From 0 to a little above the largest."""
    most = max((float(np.nanmax(one)) for one in values if np.any(np.isfinite(one))), default=1.0)
    return 0.0, 1.2 * most


def _close(*values: Sequence[float] | Array) -> tuple[float, float]:
    every = np.concatenate([np.asarray(one, dtype=np.float64) for one in values])
    low, high = float(np.nanmin(every)), float(np.nanmax(every))
    room = 0.1 * (high - low) or 0.1 * abs(high)
    return low - room, high + room


def _limits_said(earlier: Earlier | None) -> str:
    if earlier is None:
        return "limits of the card alone; no registry was given"
    many = max((len(values) for values in earlier.values.values()), default=0)
    return (
        f"limits of the card; else the mean of the machine's last {many} logs +- 3 sd (wider of few"
        " logs, and never nearer than 2 %)"
    )


def _caption(test: AxisTest) -> str:
    text = (
        "Coulomb friction of each direction along the travel, with twice its deviation: a hump is a"
        " tight spot, a slope a guide out of true."
    )
    if test.earlier is not None and test.earlier.values.get("F_cp"):
        text += " Right: over the machine's last logs, within the shaded limits."
    return text
