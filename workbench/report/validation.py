"""A validation: verdict and figures, steps and smooth reference in the simulated loop; and the
demo, which ends in one: truth beside estimate, before beside after, and where to go next."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from design.closed_loop.loop_figures import (
    COMPENSATED,
    FIGURES_SAID,
    PRESENT,
    SCHEDULED,
    LoopFigures,
    Traces,
)
from design.closed_loop.loop_motion import worst_rest
from design.controllers.recommend import (
    called,
    in_thousandths,
    other_figures,
    own_figures,
    percent,
    settling_words,
)
from design.controllers.validate import Validation, validation_document
from design.identified.trace_logs import effect_estimates
from design.loop import LoopRun
from design.machine.readable import Display, number, shown_unit
from identification.arrays import Array
from identification.model.estimates import Estimate
from workbench.output import next_step, step, written
from workbench.report.chart import Chart, Colour, Line, LineStyle, Mark, Panel
from workbench.report.design_tables import design_lines, of_the_model
from workbench.report.model_tables import estimate_cells, not_identified
from workbench.report.next_steps import as_code
from workbench.report.trace import errors_table, logs_of_trace
from workbench.report.trace_words import trace_sentence, words
from workbench.report.view import Section, View, notes, view
from workbench.screen import Part, Row, Screen, listed, more, screen, tabled
from workbench.steps.demo import Demonstration

LOOP_COLOURS: dict[str, Colour] = {
    "rst": "reference", "pid": "model", "p-pi": "measured", PRESENT: "before",
}  # fmt: skip
SETTLING_TIMES_SHOWN = 4.0  # settling times shown after a step
SINCE = "time since the step [s]"
STEPS_CAPTION = (
    "The loop with the identified Karnopp friction and the logs' noise, all controllers from"
    " the moment of the step; dashed: with the compensator, dotted: with the gain schedule,"
    " broken grey lines: the command's limits."
)


@view.register
def _(found: Validation, traces: Mapping[tuple[str, str], Traces], display: Display) -> View:
    """Whether the design holds in simulation, and what the loop does."""

    def sections() -> Sequence[Section]:
        drawn = list[Section]()
        for place in dict.fromkeys(place for _, place in traces):
            on = "the identified plant" if place == "model" else "the other plant"
            steps = Section(f"Steps on {on}", _step_chart(found, traces, place, display))
            drawn += [steps, Section(f"Error on {on}", _error_chart(found, traces, place, display))]
        lines = validation_lines(found, display)
        verdict = Section("Verdict", validation_table(found, display), lines)
        return (*drawn[:1], verdict, *drawn[1:])

    return View(
        f"Validation for {found.card}",
        validation_sentence(found),
        validation_parts(found, display),
        {"validation.json": lambda: validation_document(found)},
        sections,
        lambda: _step_chart(found, traces, "model", display),
        step=as_code(Path("DESIGN"))
        if found.passed
        else step("slower poles, to validate again", "design", "MODEL", "--poles", "W_N,ZETA"),
    )


def validation_table(found: Validation, display: Display) -> Part:
    """A row a controller and plant."""
    alone, one = len(found.figures[found.judged]) == 1, _any(found)
    command = () if one.command_peak is None else (f"command {one.command_unit}",)
    figures = ("ok", "margin", "delay", "at rest", "over", "settling", "smooth")
    head = ("loop", *(() if alone else ("on",)), *figures, f"force {display.force}", *command)
    rows = [
        (loop_name(name), *(() if alone else (place,)), *_row(one, display))
        for name, places in found.figures.items()
        for place, one in places.items()
    ]
    return tabled((*head, "limit cycle"), rows, right=())


def _any(found: Validation) -> LoopFigures:
    return next(iter(found.figures[found.judged].values()))


def loop_name(name: str) -> str:
    """A loop's name as a narrow column takes it."""
    alone, _, beside = name.partition(" + ")
    shown = {"": "", "compensator": "+comp", "schedule": "+table"}[beside]
    return PRESENT if alone == PRESENT else alone.upper() + shown


def _row(one: LoopFigures, display: Display) -> Row:
    m, passes = one.margins, "yes" if one.passed else "no"
    modulus, delay = f"{m.modulus:.3f}" if m else "unstable", "-"
    command: tuple[str, ...] = ()
    if one.command_peak is not None:  # and for how long it is at its limit
        limited = f" ({100 * one.limited:.1g} %)" if one.limited else ""
        command = (f"{one.command_peak:.3g}{limited}",)
    if m:
        delay = "any" if m.delay_samples is None else f"{m.delay_samples:.2g}"
    if not one.stable:
        return (passes, modulus, delay, *["-"] * (6 + len(command)))
    cycle = "none"
    if one.limit_cycle:
        size, unit = in_thousandths(one.limit_cycle.amplitude, display)
        cycle = f"{size:.2g} {unit}, {one.limit_cycle.period:.2g} s"
    return (passes, modulus, delay, *error_cells(one), *command, cycle)


def error_cells(one: LoopFigures) -> Row:
    """What a loop that holds does of a step and a smooth reference, and the force for it."""
    return (
        percent(one.standstill_relative),
        percent(max(one.overshoot, 0.0)),
        settling_words(one),
        percent(one.smooth_relative),
        f"{one.force_peak:.3g}",
    )


def validation_lines(found: Validation, display: Display) -> list[str]:
    """What fails and what to know, in words."""
    alone = [name for name in found.figures if not name.endswith(COMPENSATED)]
    others = other_figures(found.why)
    lines = [others] if others else []
    lines += [line for name in alone for line in _missed(found, name)]
    lines.append(columns_line(found, display))
    return [*lines, *(f"note: {line}" for line in found.remarks)]


def columns_line(found: Validation, display: Display) -> str:
    """What the columns of the table mean, and the limits of command and force."""
    one = _any(found)
    limit = (
        "" if one.command_limit is None else f"; limit {one.command_limit:.4g} {one.command_unit}"
    )
    table = any(name.endswith(SCHEDULED) for name in found.figures)
    beside = "+comp: with the compensator" + ("; +table: with the gain schedule" if table else "")
    limit += "" if one.force_limit is None else f", {one.force_limit:.4g} {display.force}"
    return (
        f"steps of {display.length_text(one.step)}; at rest: the static error, of the worst of the"
        f" steps; over: overshoot, of the step; smooth: the tracking error; margin: modulus margin;"
        f" delay: delay margin in sampling periods; {beside}{limit}; {FIGURES_SAID}"
    )


def missed(found: Validation) -> str | None:
    """Why the tested controller does not pass, in one line; None where it does."""
    return None if found.passed else "; ".join(_missed(found, found.judged))


def _missed(found: Validation, name: str) -> list[str]:
    return [
        f"{called(name)} on the {place}: {limit}"
        for place, one in found.figures[name].items()
        for limit in one.missed
    ]


def validation_sentence(found: Validation) -> str:
    """Whether the tested controller passed and with which figures; what it misses."""
    said = f"{called(found.judged)} {'passes' if found.passed else 'fails'} in simulation"
    said = f"{of_the_model(found.lacks)}{said}"
    if not found.passed:
        return f"{said}: {missed(found)}."
    return f"{said}: {own_figures(found.why)}." if found.why else f"{said}."


def validation_parts(found: Validation, display: Display) -> list[Part | str]:
    """The figures of each loop; what controllers miss that are not tested, with --verbose."""
    others = other_figures(found.why)
    return [
        validation_table(found, display),
        *([more(others)] if others else []),
        *(more(listed(_missed(found, name))) for name in found.figures),
        columns_line(found, display),
        notes(found.remarks),
    ]


def _step_chart(
    found: Validation, traces: Mapping[tuple[str, str], Traces], place: str, display: Display
) -> Chart:
    """Position and command after the first step up and the first one down, loops overlaid."""
    (unit, factor), first = display.shown("position"), found.figures[found.judged][place]
    runs = _runs(traces, place, "step")
    some = next(iter(runs.values()))
    begins = [int(at) for at in np.flatnonzero(np.diff(some.r))[:2] + 1]
    # Until the slowest loop has long settled.
    times = [one[place].settling for one in found.figures.values() if place in one]
    most, h = begins[1] - begins[0], float(some.t[1] - some.t[0])
    samples = SETTLING_TIMES_SHOWN * float(np.median(times)) / h
    span = int(np.clip(samples, min(50, most), most))
    command = first.command_unit if first.command_peak is not None else display.force
    limit = first.command_limit
    panels = []
    for begin in begins:
        height = factor * float(some.r[begin] - some.r[begin - 1])
        title = f"step of {number(height)} {unit}"
        part = slice(begin, begin + span)
        lines = [Line("reference", *_since(some, some.r, part, factor), "other", "dotted")]
        lines += [_of(name, run, run.y, part, factor) for name, run in runs.items()]
        panels.append(
            Panel(SINCE, f"position [{unit}]", lines, title, y_range=_near(lines, height))
        )
    for begin in begins:
        part = slice(begin, begin + span)
        lines = [_of(name, run, run.u, part, 1.0) for name, run in runs.items()]
        marks = [] if limit is None else [Mark(-limit), Mark(limit)]
        panels.append(Panel(SINCE, f"command [{command}]", lines, marks=marks))
    what = "position and command after a step in the simulated loop, all controllers"
    return Chart(f"loop-{place}", what, panels, columns=2, caption=STEPS_CAPTION)


def _near(lines: Sequence[Line], height: float) -> tuple[float, float] | None:
    """Range around a step where a loop leaves it by far, as one that runs away."""
    reference, *loops = lines
    low, high = float(reference.y.min()), float(reference.y.max())
    low, high = min(low, high - abs(height)), max(high, low + abs(height))
    low, high = low - abs(height), high + abs(height)
    inside = all(bool(np.all((one.y > low) & (one.y < high))) for one in loops)
    return None if inside else (low, high)


def _error_chart(
    found: Validation, traces: Mapping[tuple[str, str], Traces], place: str, display: Display
) -> Chart:
    """Error along the smooth reference, and at rest where that of the tested loop is the largest,
    loops overlaid."""
    unit, factor = display.shown("position")
    tested = traces[found.judged, place].step
    part, before = worst_rest(tested)
    height = factor * float(tested.r[part.start] - tested.r[before])
    step = f"after the step of {number(height)} {unit}" if height else "before the first step"
    said = f"at rest {step}, where {called(found.judged)} is furthest off"
    shown_of: tuple[tuple[Literal["step", "smooth"], str, str], ...] = (
        ("smooth", "time [s]", "along the smooth reference"),
        ("step", "time, in the last half after the step [s]", said),
    )
    panels = []
    for kind, start, title in shown_of:
        runs = _runs(traces, place, kind)
        shown = part if kind == "step" else slice(len(next(iter(runs.values())).t))
        lines = [_of(name, run, run.r - run.y, shown, factor) for name, run in runs.items()]
        panels.append(Panel(start, f"error [{unit}]", lines, title))
    what = "error along the smooth reference and at rest in the simulated loop, all controllers"
    caption = (
        "What is left of the error where it should be none: the smaller, the better. At rest of the"
        " table is the largest of every step, of each loop by itself."
    )
    return Chart(f"error-{place}", what, panels, columns=2, shared_x=False, caption=caption)


def _runs(
    traces: Mapping[tuple[str, str], Traces], place: str, kind: Literal["step", "smooth"]
) -> dict[str, LoopRun]:
    return {name: getattr(run, kind) for (name, where), run in traces.items() if where == place}


def _of(name: str, run: LoopRun, values: Array, part: slice, factor: float) -> Line:
    """A line of a loop, called and coloured by its controller."""
    alone, _, beside = name.partition(" + ")
    shown = name if alone == PRESENT else name.replace(alone, alone.upper())
    styles: dict[str, LineStyle] = {"": "line", "compensator": "dashed", "schedule": "dotted"}
    return Line(shown, *_since(run, values, part, factor), LOOP_COLOURS[alone], styles[beside])


def _since(run: LoopRun, values: Array, part: slice, factor: float) -> tuple[Array, Array]:
    """Time from the beginning of a part of a run [s], and the values there."""
    t = run.t[part]
    return t - t[0], factor * np.asarray(values, dtype=np.float64)[part]


SIMULATED = (
    "Simulated: two logs of a pneumatic positioning rig, one for training and one held out. Its"
    " friction has an effect that was not given to any model; only the logs were used."
)
LETTERS = (
    "m: mass; F_c: Coulomb friction, F_v: viscous, F_s: breakaway, dv: stick band; p, n: direction"
)
TRUTH_HEAD = ("parameter", "estimate", "unit", "95 % interval", "truth")


def demo_screen(found: Demonstration, folder: Path) -> Screen:
    """The demo for a terminal; with --verbose also what `design` and `validate` say of it."""
    traced, display = found.traced, found.traced.model.display
    errors = errors_table(traced.trace, display)
    rows: Any = errors.whole
    parts: list[Part | str] = [
        SIMULATED,
        trace_sentence(traced),
        replace(errors, entries=(rows[0], rows[2])),
        tabled(TRUTH_HEAD, _beside_truth(found)),
        LETTERS,
        f"Largest error of mass and friction parameters: {number(100 * found.worst_error, 2)} %.",
        controller_sentence(found),
        controller_table(found),
        more(validation_sentence(found.validation)),
        more(validation_table(found.validation, display)),
        more(listed(validation_lines(found.validation, display))),
        more(listed(design_lines(found.design))),
        more(notes((*traced.remarks, *traced.trace.remarks), logs_of_trace(traced))),
        written(folder, "report.html", "design.html", "validation.html"),
        next_step("your own log: `workbench init LOG`, then `workbench identify LOG --card"
                  " card.toml`"),
    ]  # fmt: skip
    return screen(*parts)


def controller_sentence(found: Demonstration) -> str:
    """The controller that is recommended, and whether it keeps its limits in simulation."""
    if found.design.recommended == "none":
        return "No controller meets every goal; design.html says what each misses."
    named = called(found.validation.judged)
    verdict = "meets all limits in simulation" if found.validation.passed else "misses a limit"
    return f"Recommended: {named}, which {verdict}; errors in % of the step or the amplitude:"


def controller_table(found: Demonstration) -> Part:
    """The present controller and the recommended one, side by side."""
    force, judged = found.traced.model.display.force, found.validation.judged
    head = ("controller", "static error", "overshoot", "settling", "tracking error",
            f"peak force [{force}]", "modulus margin")  # fmt: skip
    figures = {key: places["model"] for key, places in found.validation.figures.items()}
    named = {PRESENT: "before: present"}
    if found.design.recommended != "none":
        named[judged] = f"after: {loop_name(judged)}"
    rows = [(said, *_figures(figures[key])) for key, said in named.items() if key in figures]
    return tabled(head, rows, right=())


def _figures(one: LoopFigures) -> Row:
    if not one.stable:
        return ("runs away", "-", "-", "-", "-", "-")
    margin = "-" if one.margins is None else f"{one.margins.modulus:.2f}"
    return (*error_cells(one), margin)


def _beside_truth(found: Demonstration) -> list[Row]:
    """Parameters of friction and of the effects found, and what they are in truth."""
    model, out = found.traced.model, list[Row]()
    for name, e in model.friction.items():
        true = found.truth["friction"][name]["value"]
        out.append((name, *_beside(e, f"{shown_unit(e.unit).factor * true:g}")))
    for one in found.traced.trace.effects:
        estimates = effect_estimates(one, model.rig)
        known = found.truth["effects"].get(one.effect.key, {})
        for p in one.effect.params:
            said = "absent"
            if p.name in known:
                said = f"{shown_unit(p.unit).factor * known[p.name]['value']:g}"
            out.append((f"{words(one.effect.key)} {p.name}", *_beside(estimates[p.name], said)))
    return out


def _beside(e: Estimate, true: str) -> Row:
    """Value, unit and interval of an estimate, and the truth."""
    value, unit, interval = estimate_cells(e, "")
    if None in (e.value, e.low, e.high):
        value, interval = "-", not_identified(interval.partition(";")[0].partition(":")[0])
    return (value, "" if unit == "1" else unit, interval, true)
