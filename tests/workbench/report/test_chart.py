"""Charts: data that keep peaks and gaps, coded so that a page can read them."""

import base64
import json
import re
from typing import Any

import numpy as np
import pytest

from identification.arrays import Array
from identification.signals.envelope import thinned_together
from workbench.report.chart import (
    ALL_POINTS,
    FINEST_POINTS,
    FIRST_VIEW,
    Area,
    Band,
    Chart,
    Line,
    Mark,
    Panel,
    Part,
    chart_assets,
    chart_data,
    chart_html,
    coded_x,
)
from workbench.report.chart_figure import chart_figure


def decoded(coded: dict[str, Any]) -> Array:
    if "step" in coded:
        return np.asarray(coded["start"] + coded["step"] * np.arange(coded["count"]))
    kind = {"f4": "<f4", "f8": "<f8"}[coded["type"]]
    return np.frombuffer(base64.b64decode(coded["base64"]), dtype=kind).astype(np.float64)


def example(n: int = 1000) -> Chart:
    t = 1e-3 * np.arange(float(n))
    v = np.array([3.0, -2.0, 3.0, 3.0])
    over_time = Panel(
        "time [s]", "position [mm]",
        [Line("measured", t, np.sin(t), "measured"), Line("model", t, np.cos(t), style="dashed")],
        bands=[Band("noise", -0.1, 0.1)], marks=[Mark(0.5, "x")], y_range=(-2.0, 2.0),
    )  # fmt: skip
    curve = np.array([-3.0, 0.0, 4.0])
    against = Panel(
        "v", "F", [Line("model", curve, curve, style="bold"), Line("dots", v, 2 * v, style="dots")],
        areas=[Area("95 %", curve, curve - 1, curve + 1)],
    )  # fmt: skip
    return Chart("example", "two panels", [over_time, against], parts=[Part("first", 0.0, 0.5)])


@pytest.mark.parametrize("points", [100, 4000])
def test_thinned_lines_share_their_places_and_keep_peaks(points: int) -> None:
    x = np.arange(100_001.0)
    one, two = np.sin(x / 5e3), np.cos(x / 5e3)
    one[54_321], two[12_345], two[-1] = 7.0, -9.0, 8.0
    places, (thin_one, thin_two) = thinned_together(x, [one, two], points)
    assert len(places) == len(thin_one) == len(thin_two) <= points
    assert np.all(np.diff(places) >= 0) and (places[0], places[-1]) == (0.0, 1e5)
    assert thin_one.max() == 7.0 and thin_one.min() == one.min()
    assert thin_two.min() == -9.0 and thin_two.max() == 8.0


def test_short_lines_are_left_as_they_are() -> None:
    x, y = np.arange(50.0), np.arange(50.0) ** 2
    places, (kept,) = thinned_together(x, [y], 50)
    assert np.array_equal(places, x) and np.array_equal(kept, y)


def test_a_gap_stays_a_gap() -> None:
    x, y = np.arange(10_000.0), np.ones(10_000)
    y[4000:6000] = np.nan
    places, (kept,) = thinned_together(x, [y], 1000)
    within = (places > 4020) & (places < 5980)
    assert np.all(np.isnan(kept[within])) and np.all(kept[places < 3980] == 1.0)


def test_even_places_are_reported_by_their_step() -> None:
    even = 5.0 + 1e-3 * np.arange(10_000.0)
    assert coded_x(even)["count"] == 10_000
    assert decoded(coded_x(even)) == pytest.approx(even, abs=1e-9)
    uneven = np.array([0.0, 1.0, 1.5, 4.0])
    assert "step" not in coded_x(uneven) and np.array_equal(decoded(coded_x(uneven)), uneven)


def test_data_hold_every_column_in_the_order_of_the_lines() -> None:
    over_time, against = chart_data(example())["panels"]
    (table,) = over_time["tables"]
    assert [line["name"] for line in over_time["lines"]] == ["measured", "model"]
    assert decoded(table["y"][1]) == pytest.approx(np.cos(decoded(table["x"])), abs=1e-6)
    dots, lines = against["tables"]
    assert [one["name"] for one in against["lines"]] == ["dots", "", "95 %", "model"]
    assert [one["look"] for one in against["lines"]] == ["dots", "edge", "edge", "bold"]
    assert np.all(np.diff(decoded(dots["x"])) > 0)  # dots at one place are set apart
    assert decoded(dots["x"]) == pytest.approx([-2.0, 3.0, 3.0, 3.0], abs=1e-4)
    assert decoded(dots["y"][0]) == pytest.approx([-4.0, 6.0, 6.0, 6.0])
    assert decoded(lines["y"][1]) == pytest.approx([-2.0, 1.0, 5.0])


@pytest.mark.parametrize("lines", [1, 8, 80])
def test_a_chart_is_bounded_whatever_the_log(lines: int) -> None:
    t = np.arange(300_000.0)
    panel = Panel("t", "y", [Line(str(k), t, np.sin(t + k)) for k in range(lines)])
    (found,) = chart_data(Chart("long", "long", [panel]))["panels"]
    counts = [len(decoded(y)) for table in found["tables"] for y in table["y"]]
    assert max(counts) <= FINEST_POINTS and min(counts) > 0.9 * FIRST_VIEW
    assert sum(counts) <= max(ALL_POINTS, lines * FIRST_VIEW)


def test_text_in_the_page_ends_no_element() -> None:
    t = np.arange(3.0)
    html = str(chart_html(Chart("a", 'says "<b>"', [Panel("</script>", "y", [Line("l", t, t)])])))
    assert html.count("</script>") == 1
    found = re.search(r'<script type="application/json">(.*?)</script>', html)
    assert found and json.loads(found[1])["panels"][0]["x"] == "</script>"
    assert 'aria-label="says &#34;&lt;b&gt;&#34;"' in html


def test_what_a_page_needs_comes_in_order() -> None:
    names = list(chart_assets())
    assert names == ["uPlot.min.css", "chart.css", "uPlot.iife.min.js", "chart.js"]
    assert all("</script" not in text for text in chart_assets().values())


def test_a_notebook_sees_the_same_panels() -> None:
    drawn = chart_figure(example())
    over_time, against = drawn.axes
    assert over_time.get_ylabel() == "position [mm]" and over_time.get_ylim() == (-2.0, 2.0)
    assert [one.get_label() for one in over_time.get_lines()][-2:] == ["measured", "model"]
    assert against.get_xlabel() == "v"
