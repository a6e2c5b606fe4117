"""Reports: whole, self-contained, labelled, small; lines keep their peaks."""

import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

from design.controllers.validate import validate
from design.identified.identify_logs import Identified
from design.machine.readable import Display
from identification.model.plant import Actuator, actuator_units
from identification.signals.envelope import evenly_spread, liveliest
from tests.chain import TABLES, designed, identified, model_of
from workbench.report.chart import Chart
from workbench.report.chart_figure import LINE_POINTS, thinned
from workbench.report.friction import friction_curve
from workbench.report.validation import (
    validation_lines,
    validation_table,
)
from workbench.report.view import Section, page, view

LARGEST = 2_000_000
VOID = {"meta", "br", "img", "hr"}


class Balance(HTMLParser):
    """Whether every tag is closed in order."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        pass

    def handle_endtag(self, tag: str) -> None:
        assert self.open and self.open.pop() == tag


def checked(html: str, figures: int) -> str:
    parser = Balance()
    parser.feed(html)
    assert parser.open == []
    assert len(html) < LARGEST
    assert html.count("<svg") + html.count('<figure class="chart">') == figures
    # Only our own scripts, and only where there is a chart to draw.
    assert ("uPlot" in html) == ('<figure class="chart">' in html)
    # Names of XML vocabularies are no addresses that a browser would fetch.
    fetched = re.findall(r'(?:src|href)="(?!#|data:)([^"]+)"|url\((?!#)([^)]+)\)', html)
    assert fetched == []
    ids = re.findall(r' id="([^"]+)"', html)
    assert len(ids) == len(set(ids))
    assert not re.search(r"\bnan\b", html)
    return html


def test_identification_report() -> None:
    html = checked(view(identified()).page(), 4)
    for text in ("position [mm]", "applied force [N]", "velocity [mm/s]", "friction force [N]",
                 "time [s]", "moving mass", "95 % interval", "short.csv", "a remark",
                 "Over frequency", "from force to position [m/N]"):  # fmt: skip
        assert text in html


def test_a_breakaway_limit_that_is_not_identified_is_drawn_at_the_coulomb_level() -> None:
    found = identified()
    known = found.model.friction
    for value, top in ((500.0, 500.0), (None, found.model.karnopp.F_cp)):
        limit = replace(known["F_sp"], value=value, assumed=500.0, reason="no rest")
        model = replace(found.model, friction={**known, "F_sp": limit})
        chart = friction_curve(model, found.fit, found.sources).content
        assert isinstance(chart, Chart)
        for panel in chart.panels:
            curve = panel.lines[-1]
            assert np.nanmax(curve.y[np.abs(curve.x) < 1e-2]) == pytest.approx(top)


def test_a_rotary_report_shows_rotary_units() -> None:
    found = turned(identified())
    html = checked(view(found).page(), 4)
    for text in ("position [rad]", "applied force [N m]", "velocity [rad/s]", "N m s/rad",
                 "kg m^2", "moment of inertia", "breakaway torque", "N m/(V s)"):  # fmt: skip
        assert text in html
    for text in ("[mm]", "[N]", "[mm/s]", ">kg<", ">N s/m<", "moving mass", " mm rms", " N/m "):
        assert text not in html


def turned(found: Identified) -> Identified:
    """The same numbers as those of a rotary machine."""
    model = found.model
    friction, actuator = Display("rotary").friction, actuator_units("rotary")
    turning = replace(
        model,
        rig=replace(model.rig, motion="rotary"),
        controller=None,
        friction={name: replace(e, unit=friction[name]) for name, e in model.friction.items()},
        actuator={n: replace(e, unit=actuator[n]) for n, e in (model.actuator or {}).items()},
    )
    return replace(found, model=turning)


@pytest.mark.slow
def test_a_rotary_design_and_validation_show_rotary_units() -> None:
    model = turned(identified()).model
    found = designed(model)
    html = checked(view(found).page(), 2)
    assert "[dB, N m/rad]" in html and " V/(N m)," in html
    assert "N/m" not in html and "V/N," not in html
    result, _ = validate(model, found, np.random.default_rng(0))
    for display, unit in ((Display("rotary"), "rad"), (Display(), "mm")):
        said = validation_lines(result, display)
        assert any(re.match(rf"steps of [\d.]+ {unit};", line) for line in said)


def test_design_report() -> None:
    html = checked(view(designed(identified().model)).page(), 2)
    for text in (
        "frequency [rad/s]",
        "|S_yp| [dB]",
        "modulus margin",
        "RST</abbr> S:",
        "compensator",
    ):
        assert text in html


@pytest.mark.slow
def test_validation_report_shows_both_plants() -> None:
    model, other = (model_of(TABLES[f"paper_table{k}"], Actuator(19530, 10405)) for k in (1, 2))
    result, traces = validate(model, designed(model), np.random.default_rng(0), plant=other)
    html = checked(view(result, traces, Display()).page(), 4)
    assert "Steps on the identified plant" in html and "Steps on the other plant" in html
    rotary = view(result, traces, Display("rotary")).page()
    assert "position [rad]" in rotary and "force N m" in rotary


def test_text_is_escaped() -> None:
    html = page("<b>x</b>", "a & b", [Section("<i>", "<p>kept</p>")])
    assert "<b>x</b>" not in html
    assert "a &amp; b" in html
    assert "<p>kept</p>" in html


def test_thinning_keeps_ends_and_peaks() -> None:
    x = np.arange(100_000.0)
    y = np.sin(x / 5e3)
    y[54_321] = 7.0
    y[12_345] = -9.0
    xs, ys = thinned(x, y)
    assert len(xs) <= LINE_POINTS + 4
    assert ys.max() == 7.0 and ys.min() == -9.0
    assert (xs[0], xs[-1]) == (0.0, 99_999.0)
    assert np.all(np.diff(xs) > 0)
    short, _ = thinned(x[:50], y[:50])
    assert len(short) == 50


@pytest.mark.parametrize(("count", "most"), [(10, 100), (1000, 100), (1001, 100)])
def test_spread_is_even_and_bounded(count: int, most: int) -> None:
    index = evenly_spread(count, most)
    assert len(index) <= most
    assert len(set(np.diff(index).tolist())) <= 1


def test_the_liveliest_part_is_where_it_moves() -> None:
    y = np.zeros(10_000)
    y[6000:7000] = np.sin(np.linspace(0, 20, 1000))
    part = liveliest(y)
    assert part.start <= 6100 and part.stop >= 6900
    assert liveliest(y[:20]) == slice(0, 20)


@pytest.mark.slow
def test_a_rotary_validation_has_rotary_columns() -> None:
    model = turned(identified()).model
    result, _ = validate(model, designed(model), np.random.default_rng(0))
    found = validation_table(result, Display("rotary"))
    assert "force N m" in found.head and "force N" in validation_table(result, Display()).head
    assert all(len(row) == len(found.head) for row in found.whole)
