"""What `identify` and `design` show: which tables and pictures, under which words."""

from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

from design.controllers.cascade import filter_words
from design.identified.identify_logs import Identified
from design.loop_frequencies import open_loop_response
from design.machine.design import Controller, Design
from design.machine.documents import design_document, model_document
from design.machine.model import Model, used
from design.margins import sensitivities
from design.measured.predict import fitted_run, missing_force
from design.rst import RST, closed_loop
from identification.arrays import Array
from identification.estimation.windowed_run.parameters import AT_ZERO
from identification.simulation.free_run import FreeRun
from workbench.report.chart import Chart, Colour, Line, Mark, Panel
from workbench.report.design_tables import (
    design_lines,
    design_parts,
    design_sentence,
    drive_lines,
    drive_table,
    margins_table,
)
from workbench.report.fit import fit_chart, residual
from workbench.report.friction import friction_curve
from workbench.report.model_tables import (
    fit_lines,
    logs_of,
    model_parts,
    parameter_rows,
    plant_lines,
    summary,
)
from workbench.report.next_steps import after_design, after_identify
from workbench.report.response import over_frequency
from workbench.report.templating import render
from workbench.report.validation import LOOP_COLOURS
from workbench.report.view import Section, View, report_notes, table, view
from workbench.screen import more


@view.register
def _(found: Identified) -> View:
    """What was identified, how well it follows the log, what it leaves."""
    model, sources, friction = found.model, found.sources, found.fit.friction

    @cache
    def runs() -> list[FreeRun | None]:
        return [fitted_run(model, one.log, number, friction) for number, one in enumerate(sources)]

    def sections() -> Sequence[Section]:
        said = (*fit_lines(model), *plant_lines(model), *found.remarks, *model.fit.remarks)
        return (
            *residual(model, sources, runs(), missing, friction),
            parameters_section(model),
            friction_curve(model, found.fit, sources),
            Section("Fit over time", fit_chart(model, sources, runs())),
            *over_frequency(model, sources),
            Section("In words", report_notes(said, logs_of(model))),
        )

    missing = missing_force(model, [one.log for one in sources])
    return View(
        f"Identification of {model.card}",
        summary(model, missing),
        model_parts(model, found.remarks),
        {"model.json": lambda: model_document(model)},
        sections,
        lambda: fit_chart(model, sources, runs()),
        step=after_identify(model, [one.file for one in model.log], "CARD", Path()),
    )


@view.register
def _(found: Design) -> View:
    """The controllers, their margins, what they do to noise, how fast they are.

    Behind --verbose: the equations that a drive runs, which `export` writes as code.
    """
    chosen = None if found.recommended == "none" else found.recommended

    def sections() -> Sequence[Section]:
        has_filter = found.p_pi is not None and found.p_pi.series is not None
        return (
            Section("Step response", step_chart(found)),
            controllers(found),
            *([Section(BODE_TITLE, bode_chart(found))] if has_filter else []),
            Section("Sensitivity", sensitivity_chart(found)),
            *program_sections(found),
        )

    return View(
        f"Design for {found.card}",
        design_sentence(found),
        [*design_parts(found), *map(more, drive_lines(found, chosen))],
        {"design.json": lambda: design_document(found)},
        sections,
        lambda: step_chart(found),
        step=after_design(found, Path("MODEL"), False, (), Path()),
    )


def parameters_section(model: Model) -> Section:
    """The parameters with units and intervals, or why there is none."""
    estimates = {**model.friction, **(model.actuator or {})}
    assumed = ", ".join(
        # What a plant keeps of 0 is 0.
        f"{name} = {'0' if abs(used(e)) <= AT_ZERO else f'{used(e):.3g}'} {e.unit}"
        for name, e in estimates.items()
        if e.value is None
    )
    return Section("Parameters", render("parameters", rows=parameter_rows(model), assumed=assumed))


MOST_DB = float(20 * np.log10(2.0))  # of |S_yp| at a modulus margin of 0.5


def controllers(found: Design) -> Section:
    """Margins of both loops and what they rest on."""
    margins = table(margins_table(found), design_lines(found))
    return Section("Controllers", margins + table(drive_table(found)))


def program_sections(found: Design) -> tuple[Section, Section]:
    """The polynomials in ascending powers of z^-1, for whoever programs the controller, and the
    same as difference equations, in the unit that the drive takes."""
    polynomials = [
        f"{name.upper()} {letter}: [{', '.join(f'{v:.7g}' for v in getattr(one, letter))}]"
        for name, one in found.controllers.items()
        for letter in "RST"
    ]
    text = [*polynomials, "S(z^-1) F_ref = T(z^-1) r - R(z^-1) y"]
    return Section("Coefficients", text), Section("As the drive runs it", drive_lines(found))


def sensitivity_chart(found: Design) -> Chart:
    """|S_yp| with its limit, and |S_up|."""
    A, B = np.array(found.plant.A), np.array(found.plant.B)
    w = np.geomspace(1e-3, 1.0, 400) * np.pi / found.plant.h
    noise: list[Line] = []
    disturbance = [Line("modulus margin 0.5", w, np.full(len(w), MOST_DB), "other", "dotted")]
    for name, one in found.controllers.items():
        s, colour = sensitivities(A, B, one.rst, w), LOOP_COLOURS[name]
        disturbance.append(Line(name.upper(), w, _db(s.S_yp), colour))
        noise.append(Line(name.upper(), w, _db(s.S_up), colour))
    top = max(float(line.y.max()) for line in noise) + 5.0 if noise else 0.0
    unit, frequency = found.display.stiffness, "frequency [rad/s]"
    panels = (
        Panel(frequency, "|S_yp| [dB]", disturbance, "disturbance to position", log_x=True),
        Panel(
            frequency, f"|S_up| [dB, {unit}]", noise, "measurement noise to force",
            log_x=True, y_range=(top - 80.0, top),
        ),
    )  # fmt: skip
    caption = "Below 0 dB the loop suppresses disturbances; the peak of |S_yp| is 1/modulus margin."
    what = "sensitivity functions against frequency"
    return Chart("sensitivity", what, panels, columns=2, caption=caption)


def step_chart(found: Design) -> Chart:
    """Linear step response of both loops, without Coulomb friction."""
    caption = (
        "Response of the linear loop. The machine has Coulomb friction too: `workbench validate`"
        " shows the loop with it."
    )
    lines = []
    for name, one in found.controllers.items():
        t, y = linear_step(found, one)
        # Held from sample to sample.
        staircase = np.repeat(t, 2)[1:], np.repeat(y, 2)[:-1]
        lines.append(Line(name.upper(), *staircase, LOOP_COLOURS[name]))
    panel = Panel("time [s]", "position / step [-]", lines, marks=[Mark(1.0)])
    return Chart("step", "linear step response of the closed loop", [panel], caption=caption)


def linear_step(found: Design, one: Controller) -> tuple[Array, Array]:
    """Time [s] and position of a unit step through B T/P, (n,)."""
    n = int(np.clip(15.0 / (one.dominant[0] * one.h), 40, 4000))
    forward = np.convolve(np.array(found.plant.B), np.array(one.T))
    P = closed_loop(np.array(found.plant.A), np.array(found.plant.B), one.rst)
    t = one.h * np.arange(n, dtype=np.float64)
    return t, np.asarray(lfilter(forward, P, np.ones(n)), dtype=np.float64)


def _db(values: object, least: float = 1e-12) -> Array:
    return np.asarray(20 * np.log10(np.maximum(np.abs(np.asarray(values)), least)))


LOWEST_DRAWN = 1e-3  # of half the sampling rate
POINTS_OF_BODE = 1200
HERTZ = "frequency [Hz]"
BODE_TITLE = "Bode plot, before and after the filter"


def bode_chart(found: Design) -> Chart:
    """Magnitude, phase and |S_yp| of the cascade's loop with its filter and with the same gains
    without it; raises ValueError where the design has no filter."""
    one = found.p_pi
    if one is None or one.cascade is None or one.series is None:
        raise ValueError("a design without a filter has no Bode plot before and after it")
    A, B = np.array(found.plant.A), np.array(found.plant.B)
    f = 0.5 / one.h * np.geomspace(LOWEST_DRAWN, 1.0, POINTS_OF_BODE)[:-1]  # at the last it is real
    before, after = one.cascade.rst(one.h), one.rst
    pairs: tuple[tuple[str, RST, Colour], ...] = (
        ("without the filter", before, "before"), (f"with the {one.series.kind}", after, "model"),
    )  # fmt: skip
    size, phase, sensitivity = list[Line](), list[Line](), list[Line]()
    for name, rst, colour in pairs:
        L = open_loop_response(A, B, rst, f)
        size.append(Line(name, f, _db(L, 1e-9), colour))
        turned = np.degrees(np.unwrap(np.angle(L)))
        phase.append(Line(name, f, turned - 360.0 * np.ceil(turned[0] / 360.0), colour))
        S = sensitivities(A, B, rst, 2.0 * np.pi * f).S_yp
        sensitivity.append(Line(name, f, _db(S, 1e-9), colour))
    panels = (
        Panel(HERTZ, "|L| [dB]", size, "open loop, magnitude", log_x=True, marks=[Mark(0.0)]),
        Panel(HERTZ, "phase [deg]", phase, "open loop, phase", log_x=True, marks=[Mark(-180.0)]),
        Panel(HERTZ, "|S_yp| [dB]", sensitivity, "disturbance to position", log_x=True,
              marks=[Mark(6.0)]),
    )  # fmt: skip
    caption = (
        f"Open loop on two masses with the {filter_words(one.series)}, and with the same gains"
        " without it: the peak of the resonance comes down, and |S_yp| with it. What is above 6 dB"
        " there has a modulus margin below 0.5."
    )
    what = "open loop and sensitivity before and after the filter"
    return Chart("bode", what, panels, caption=caption)
