"""The open loop of a P-PI cascade over frequency, before and after its notch or low-pass."""

from collections.abc import Iterator

import numpy as np

from design.loop_frequencies import open_loop_response
from design.margins import sensitivities
from design.rst import RST
from identification.arrays import Array
from workbench.documents.design import Design
from workbench.report.chart import Chart, Colour, Line, Mark, Panel, chart_html
from workbench.report.page import Section
from workbench.steps.cascade import filter_words

LOWEST_DRAWN = 1e-3  # of half the sampling rate
POINTS_OF_BODE = 1200
HERTZ = "frequency [Hz]"


def bode_section(found: Design) -> Iterator[Section]:
    """Magnitude, phase and |S_yp| of the cascade's loop with its filter and with the same gains
    without it; nothing where there is no filter."""
    one = found.p_pi
    if one is None or one.cascade is None or one.series is None:
        return
    caption = (
        f"Open loop on two masses with the {filter_words(one.series)}, and with the same gains"
        " without it: the peak of the resonance comes down, and |S_yp| with it. What is above 6 dB"
        " there has a modulus margin below 0.5."
    )
    yield Section("Bode plot, before and after the filter", chart_html(bode_chart(found), caption))


def bode_chart(found: Design) -> Chart:
    """The chart of `bode_section`; raises ValueError where the design has no filter."""
    one = found.p_pi
    if one is None or one.cascade is None or one.series is None:
        raise ValueError("a design without a filter has no Bode plot before and after it")
    A, B = np.array(found.plant.A), np.array(found.plant.B)
    f = 0.5 / one.h * np.geomspace(LOWEST_DRAWN, 1.0, POINTS_OF_BODE)
    before, after = one.cascade.rst(one.h), one.rst
    pairs: tuple[tuple[str, RST, Colour], ...] = (
        ("without the filter", before, "before"), (f"with the {one.series.kind}", after, "model"),
    )  # fmt: skip
    size, phase, sensitivity = list[Line](), list[Line](), list[Line]()
    for name, rst, colour in pairs:
        L = open_loop_response(A, B, rst, f)
        size.append(Line(name, f, _decibels(np.abs(L)), colour))
        turned = np.degrees(np.unwrap(np.angle(L)))
        phase.append(Line(name, f, turned - 360.0 * np.ceil(turned[0] / 360.0), colour))
        S = np.abs(sensitivities(A, B, rst, 2.0 * np.pi * f).S_yp)
        sensitivity.append(Line(name, f, _decibels(S), colour))
    panels = (
        Panel(HERTZ, "|L| [dB]", size, "open loop, magnitude", log_x=True, marks=[Mark(0.0)]),
        Panel(HERTZ, "phase [deg]", phase, "open loop, phase", log_x=True, marks=[Mark(-180.0)]),
        Panel(HERTZ, "|S_yp| [dB]", sensitivity, "disturbance to position", log_x=True,
              marks=[Mark(6.0)]),
    )  # fmt: skip
    return Chart("bode", "open loop and sensitivity before and after the filter", panels, columns=1)


def _decibels(size: Array) -> Array:
    return np.asarray(20.0 * np.log10(np.maximum(size, 1e-9)))
