"""Sections of a design: margins in a table, sensitivity functions, the linear step response."""

import numpy as np
from scipy.signal import lfilter

from design.margins import sensitivities
from design.rst import closed_loop
from identification.arrays import Array
from workbench.cards.parameter_units import shown
from workbench.documents.design import Controller, Design
from workbench.report.design_tables import (
    DESIGN_HEAD,
    design_lines,
    drive_lines,
    margin_rows,
    polynomial_lines,
)
from workbench.report.figures import (
    CONTROLLER_COLOURS,
    OTHER,
    figure,
    inline,
    label,
    style,
)
from workbench.report.page import Section, render


def controllers(found: Design, rotary: bool = False) -> Section:
    """Margins of both loops and what they rest on."""
    html = render(
        "table", head=DESIGN_HEAD, rows=margin_rows(found), lines=design_lines(found, rotary)
    )
    return Section("Controllers", html)


def coefficients(found: Design) -> Section:
    """The polynomials, for whoever programs the controller."""
    text = [*polynomial_lines(found), "S(z^-1) F_ref = T(z^-1) r - R(z^-1) y"]
    return Section("Coefficients", render("lines", lines=text))


def drive_section(found: Design) -> Section:
    """The same as difference equations, in the unit that the drive takes."""
    return Section("As the drive runs it", render("lines", lines=drive_lines(found)))


def sensitivity_section(found: Design, rotary: bool = False) -> Section:
    """|S_yp| with its limit, and |S_up|."""
    A, B = np.array(found.plant.A), np.array(found.plant.B)
    w = np.geomspace(1e-3, 1.0, 400) * np.pi / found.plant.h
    with style():
        drawn = figure(9.0, 3.4)
        left, right = drawn.subplots(1, 2)
        for name, one in found.controllers.items():
            s = sensitivities(A, B, one.rst, w)
            left.semilogx(w, _db(s.S_yp), color=CONTROLLER_COLOURS[name], label=name.upper())
            right.semilogx(w, _db(s.S_up), color=CONTROLLER_COLOURS[name])
        left.axhline(20 * np.log10(2.0), color=OTHER, ls=":", label="modulus margin 0.5")
        top = right.get_ylim()[1]
        right.set_ylim(top - 80.0, top)
        label(left, "frequency [rad/s]", "|S_yp| [dB]", "disturbance to position")
        label(
            right,
            "frequency [rad/s]",
            f"|S_up| [dB, {shown(rotary).stiffness}]",
            "measurement noise to force",
        )
        left.legend(loc="lower right")
        svg = inline(drawn, "sensitivity", "sensitivity functions against frequency")
    caption = "Below 0 dB the loop suppresses disturbances; the peak of |S_yp| is 1/modulus margin."
    return Section("Sensitivity", render("figure", svg=svg, caption=caption))


def step_response(found: Design) -> Section:
    """Linear step response of both loops, without Coulomb friction."""
    with style():
        drawn = figure(9.0, 3.0)
        axes = drawn.subplots()
        for name, one in found.controllers.items():
            t, y = linear_step(found, one)
            axes.step(t, y, where="post", color=CONTROLLER_COLOURS[name], label=name.upper())
        axes.axhline(1.0, color=OTHER, ls=":", lw=1.0)
        label(axes, "time [s]", "position / step [-]")
        axes.legend(loc="lower right")
        svg = inline(drawn, "step", "linear step response of the closed loop")
    caption = (
        "Response of the linear loop. The machine has Coulomb friction too: workbench validate"
        " shows the loop with it."
    )
    return Section("Step response", render("figure", svg=svg, caption=caption))


def linear_step(found: Design, one: Controller) -> tuple[Array, Array]:
    """Time [s] and position of a unit step through B T/P, (n,)."""
    n = int(np.clip(15.0 / (one.dominant[0] * one.h), 40, 4000))
    forward = np.convolve(np.array(found.plant.B), np.array(one.T))
    P = closed_loop(np.array(found.plant.A), np.array(found.plant.B), one.rst)
    t = one.h * np.arange(n, dtype=np.float64)
    return t, np.asarray(lfilter(forward, P, np.ones(n)), dtype=np.float64)


def _db(values: object) -> Array:
    return np.asarray(20 * np.log10(np.maximum(np.abs(np.asarray(values)), 1e-12)))
