"""Frequency responses for a terminal and as Bode plots."""

from collections.abc import Sequence

import numpy as np

from design.machine.model import Model
from design.machine.readable import number
from design.machine.source import Source
from design.measured.response import (
    Responded,
    decibels,
    degrees,
    ranges,
    respond,
    response_document,
    sure_share,
)
from identification.arrays import Array
from identification.errors import UserError
from identification.estimation.estimates import reported_estimate
from identification.frequency.estimate import Response
from identification.frequency.modes import Peak
from identification.frequency.stretches import ComplexArray
from identification.model.size import Size
from identification.thresholds import COHERENCE_SURE
from workbench.report.chart import Area, Chart, Colour, Line, LineStyle, Mark, Panel, chart_html
from workbench.report.view import Section, View, notes, report_notes, table, view
from workbench.screen import Part, listed, tabled
from workbench.steps.response import response_frame

PEAK_HEAD = ("", "frequency", "95 % interval", "damping", "95 % interval")
FREQUENCY = "frequency [Hz]"
SAMPLES_IN_A_REPORT = 100_000  # after which no further log is taken
COHERENCE_SAID = (
    "The band holds 95 % of what the noise could make of it. Where the coherence is too low,"
    " nothing is drawn."
)


def response_sentence(found: Responded) -> str:
    """What the logs show of the machine, in a sentence or two."""
    body = found.found.body
    said = f"The plant is identified {_spans(ranges(body.f, body.seen))}"
    if found.peaks:
        said += f", with {_named(found.peaks)}"
    if found.felt:
        low, high = found.gap_around(found.felt)
        return (
            f"{said}. Between {number(low)} and {number(high)} Hz, where it is not identified at"
            f" every frequency, there is {_named(found.felt)}, by the curve below and above: log a"
            " run that moves the machine there."
        )
    return f"{said}." if found.peaks else f"{said}; no resonance stands out there."


def _named(peaks: Sequence[Peak]) -> str:
    """Peaks with frequency and damping, in words."""
    return _and(
        [
            f"{'a resonance' if one.kind == 'resonance' else 'an anti-resonance'} at"
            f" {number(one.frequency.value)} Hz (damping {number(one.damping.value, 2)})"
            for one in peaks
        ]
    )


def peak_table(found: Responded) -> Part:
    """Resonances and anti-resonances with their intervals, a row each."""
    rows = [
        (f"{one.kind}{'' if one in found.peaks else ', felt'}", *_cells(one.frequency, "Hz"),
         *_cells(one.damping, "1"))
        for one in (*found.peaks, *found.felt)
    ]  # fmt: skip
    return tabled(PEAK_HEAD, rows, right=(1, 3))


def _cells(one: Size, unit: str) -> tuple[str, str]:
    estimate = reported_estimate(one.value, unit, one.sd)
    shown_unit = "" if unit == "1" else f" {unit}"
    if estimate.low is None or estimate.high is None:
        return f"{number(one.value)}{shown_unit}", "not identifiable"
    return (
        f"{number(one.value, 4)}{shown_unit}",
        f"{number(estimate.low, 4)} to {number(estimate.high, 4)}",
    )  # fmt: skip


def loop_line(found: Responded) -> str:
    """The open loop's crossover and margins, in words."""
    if found.open_loop is None or found.margins is None:
        why = "" if found.found.instrument else " (no moving reference is logged)"
        return f"open loop: not shown, since the controller is not identifiable from the logs{why}"
    m = found.margins
    by = "the logs" if found.found.controller is not None else "the card's controller"
    if m.crossover is None:
        return f"open loop (by {by}): {_where_it_crosses(found.open_loop)}"
    gain = "not within what the logs show" if m.gain_db is None else f"{number(m.gain_db)} dB"
    said = (
        f"crosses 0 dB at {number(m.crossover)} Hz",
        "" if m.phase_deg is None else f"phase margin {number(m.phase_deg)} deg",
        f"gain margin {gain}",
        "" if m.delay_s is None else f"delay margin {number(1e3 * m.delay_s)} ms",
    )
    return f"open loop (by {by}): {', '.join(filter(None, said))}"


def _where_it_crosses(loop: Response) -> str:
    """On which side of what is seen an open loop crosses 0 dB, in words."""
    f, size = loop.f[loop.seen], np.abs(loop.H[loop.seen])
    if len(f) and np.all(size < 1.0):
        return (
            f"crosses 0 dB below {number(float(f[0]))} Hz, the lowest frequency at which the logs"
            " show it (--lowest reaches further down)"
        )
    if len(f) and np.all(size > 1.0):
        return (
            f"crosses 0 dB above {number(float(f[-1]))} Hz, the highest at which it is identified"
        )
    return "its crossing of 0 dB is not within what the logs show"


def friction_line(found: Responded) -> str:
    """Whether friction was taken off the force, and what that bought."""
    if found.left_in is not None:
        return f"friction: left in the force, {found.left_in}"
    every = found.found
    if not np.any(every.body.seen):
        return "friction: subtracted from the force; no frequency is seen surely enough"
    upto = float(every.f[every.body.seen][-1])
    with_, without = (sure_share(one, upto) for one in (every.with_friction, every.body))
    return (
        f"friction: subtracted from the force; that leaves a coherence above {COHERENCE_SURE:g} on"
        f" {100 * without:.0f} % of the octaves up to {number(upto)} Hz,"
        f" {100 * with_:.0f} % with friction left in"
    )


def response_lines(found: Responded) -> list[str]:
    """All that is said of the curves, and of the spectra of which they are made, a line each."""
    body, lengths = found.found.body, found.found.stretches
    by = "the reference as instrument" if found.found.instrument else "no instrument"
    return [
        loop_line(found),
        friction_line(found),
        f"coherence above {COHERENCE_SURE:g}: {_spans(ranges(body.f, body.sure))}",
        f"spectra: Welch, {by}; stretches of {number(lengths[0])} s at low frequencies to"
        f" {number(lengths[-1])} s at high ones, {body.averages[0]:.0f} to"
        f" {body.averages[-1]:.0f} averages",
    ]


@view.register
def _(found: Responded) -> View:
    """The responses with their resonances and margins."""
    logs, lines = tuple(one["file"] for one in found.logs), response_lines(found)
    return View(
        f"Frequency response of {found.card}",
        response_sentence(found),
        [peak_table(found), listed(lines), notes(found.remarks, logs)],
        {
            "response.json": lambda: response_document(found),
            "response.csv": lambda: response_frame(found).to_csv(index=False, float_format="%.7g"),
        },
        lambda: _sections(found, logs),
        lambda: plant_chart(found),
    )


def _sections(found: Responded, logs: Sequence[str]) -> list[Section]:
    sections = [
        Section("Plant", plant_chart(found)),
        Section("Resonances and margins", table(peak_table(found), response_lines(found))),
    ]
    if found.open_loop is not None:
        sections.append(Section("Open loop", loop_chart(found)))
    if found.found.controller is not None:
        sections.append(Section("Controller", controller_chart(found)))
    lines = report_notes(found.remarks, logs)
    return [*sections, Section("Notes", lines)] if lines else sections


def over_frequency(model: Model, runs: Sequence[Source]) -> list[Section]:
    """The section of other reports: the plant over frequency of the model's own logs (of many the
    longest), with its resonances; none where they show it nowhere."""
    ordered = sorted(runs, key=lambda one: -len(one.log))
    before = np.cumsum([0, *(len(one.log) for one in ordered[:-1])])
    taken = [one for one, n in zip(ordered, before, strict=True) if n < SAMPLES_IN_A_REPORT]
    try:
        found = respond(taken, model.rig, model.card, model)
    except UserError:
        return []
    lines = [response_sentence(found), friction_line(found)]
    drawn = chart_html(plant_chart(found))
    return [Section("Over frequency", drawn + table(peak_table(found), lines))]


def plant_chart(found: Responded) -> Chart:
    """Position over force: magnitude, phase and coherence."""
    every, units = found.found, found.display
    f, by_position = every.f, -1.0 / (2.0 * np.pi * every.f) ** 2 + 0j
    others = [("the model", None if found.curves is None else found.curves.plant)]
    beside = None if found.left_in else every.with_friction.times(by_position)
    marks = [Mark(one.frequency.value, "x") for one in found.peaks]
    title = f"from force to position [{units.position}/{units.force}]"
    panels = _bode(f, every.position, title, others, beside, marks)
    without = "" if found.left_in else " Grey: the same with friction left in the force."
    model = "" if found.curves is None else " Dashed: the model's mass, friction and springs."
    what, caption = (
        "Bode plot of the plant from force to position",
        f"{COHERENCE_SAID}{model}{without}",
    )
    return Chart("plant", what, panels, caption=caption)


def loop_chart(found: Responded) -> Chart:
    """The open loop: magnitude, phase and coherence."""
    assert found.open_loop is not None
    curves, L = found.curves, None
    if curves is not None and curves.controller is not None:
        L = curves.plant * curves.controller
    at = found.margins.crossover if found.margins else None
    by = "the card's controller"
    if found.found.controller is not None:
        by = "the controller that the logs show"
    marks = [] if at is None else [Mark(at, "x")]
    panels = _bode(
        found.found.f, found.open_loop, "open loop [-]", [("the model, card's controller", L)],
        None, marks, levels=(0.0, -180.0),
    )  # fmt: skip
    caption = f"Plant and {by} in series. {loop_line(found)}."
    return Chart("open-loop", "Bode plot of the open loop", panels, caption=caption)


def controller_chart(found: Responded) -> Chart:
    """The controller: magnitude, phase and coherence."""
    assert found.found.controller is not None
    curves, units = found.curves, found.display
    card = None if curves is None else curves.controller
    panels = _bode(
        found.found.f, found.found.controller, f"controller [{units.stiffness}]",
        [("of the card", card)], None, [],
    )  # fmt: skip
    caption = "From the position to the force that counters it, by the reference and the position."
    return Chart("controller", "Bode plot of the controller", panels, caption=caption)


def _bode(
    f: Array, one: Response, title: str, others: Sequence[tuple[str, ComplexArray | None]],
    beside: Response | None, marks: Sequence[Mark], levels: tuple[float, float] | None = None,
) -> list[Panel]:  # fmt: skip
    """Panels of magnitude, phase and coherence up to the highest frequency that is seen."""
    use = f <= f[one.seen][-1] * 1.3 if np.any(one.seen) else np.ones(len(f), dtype=bool)
    x = f[use]
    H = np.where(one.seen, one.H, np.nan)[use]
    half = np.where(one.seen, one.half_band, np.nan)[use]
    phase = degrees(H)
    spread = np.minimum(np.degrees(half), 180.0)
    low = decibels(np.maximum(np.abs(H) * (1.0 - np.minimum(half, 0.99)), 1e-300))
    areas = (
        Area("95 %", x, low, decibels(np.abs(H) * (1.0 + half)), "measured"),
        Area("95 %", x, phase - spread, phase + spread, "measured"),
    )
    drawn: list[tuple[str, ComplexArray, Colour, LineStyle]] = [("measured", H, "measured", "line")]
    coherence = [Line("measured", x, one.coherence[use], "measured")]
    if beside is not None:
        name, left_in = "friction left in", np.where(beside.seen, beside.H, np.nan)[use]
        drawn.insert(0, (name, left_in, "before", "line"))
        coherence.insert(0, Line(name, x, beside.coherence[use], "before"))
    drawn += [(name, own[use], "model", "dashed") for name, own in others if own is not None]
    magnitude, turn = list[Line](), list[Line]()
    for name, own, colour, style in drawn:
        magnitude.append(Line(name, x, decibels(np.abs(own)), colour, style))
        turn.append(Line(name, x, _near(degrees(own), phase), colour, style))
    shown_range = _round_range(x)
    level = [[], []] if levels is None else [[Mark(one)] for one in levels]
    return [
        Panel(FREQUENCY, "magnitude [dB]", magnitude, title, areas[:1],
              marks=[*marks, *level[0]], log_x=True, x_range=shown_range),
        Panel(FREQUENCY, "phase [deg]", turn, "", areas[1:], marks=[*marks, *level[1]],
              log_x=True, x_range=shown_range),
        Panel(FREQUENCY, "coherence [-]", coherence, marks=[Mark(COHERENCE_SURE)],
              y_range=(0.0, 1.02), log_x=True, height=150, x_range=shown_range),
    ]  # fmt: skip


def _round_range(f: Array) -> tuple[float, float]:
    """The least range with ends of 1, 2 or 5 that holds the frequencies."""
    ends = np.sort(np.outer(10.0 ** np.arange(-4, 6), [1.0, 2.0, 5.0]).ravel())
    low = ends[max(int(np.searchsorted(ends, f[0], side="right")) - 1, 0)]
    high = ends[min(int(np.searchsorted(ends, f[-1])), len(ends) - 1)]
    return float(low), float(high)


def _near(phase: Array, other: Array) -> Array:
    """A phase moved by whole turns to where the other one is."""
    apart = np.nanmedian(phase - other) if np.any(np.isfinite(phase - other)) else 0.0
    return phase - 360.0 * round(float(apart) / 360.0)


def _spans(spans: Sequence[tuple[float, float]]) -> str:
    """Ranges of frequency in words, the three widest of many."""
    if not spans:
        return "nowhere"
    widest = sorted(sorted(spans, key=lambda one: one[0] / one[1])[:3])
    said = _and([f"{number(a)} to {number(b)} Hz" for a, b in widest])
    return f"from {said}" + (" and in narrow stretches between" if len(spans) > 3 else "")


def _and(words: Sequence[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"
