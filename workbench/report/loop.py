"""Sections of a validation: verdict, steps and smooth reference in the simulated loop."""

from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np

from design.loop import LoopRun
from identification.arrays import Array
from workbench.cards.readable import number, units_of
from workbench.report.chart import Chart, Colour, Line, LineStyle, Mark, Panel, chart_html
from workbench.report.validation_tables import validation_lines, validation_table
from workbench.report.view import Section, table_section
from workbench.steps.loop_figures import COMPENSATED, PRESENT, SCHEDULED, Traces
from workbench.steps.validate import Validation

LOOP_COLOURS: dict[str, Colour] = {
    "rst": "reference", "pid": "model", "p-pi": "measured", PRESENT: "before",
}  # fmt: skip
ERRORS_SHOWN: tuple[tuple[Literal["step", "smooth"], str], ...] = (
    ("smooth", "along the smooth reference"),
    ("step", "at rest, last step"),
)
SETTLING_TIMES_SHOWN = 4.0  # settling times shown after a step
SINCE = "time since the step [s]"


def judged(found: Validation, rotary: bool) -> Section:
    """Every controller on every plant, and what it misses."""
    return table_section(
        "Verdict", validation_table(found, rotary), validation_lines(found, rotary)
    )


def loop(
    found: Validation, traces: Mapping[tuple[str, str], Traces], place: str, rotary: bool
) -> list[Section]:
    """The loop on one plant, all controllers over each other: after steps, then where they rest."""
    on = "the identified plant" if place == "model" else "the other plant"
    steps = (
        "The loop with the identified Karnopp friction and the logs' noise, all controllers from"
        " the moment of the step; dashed: with the compensator, dotted: with the gain schedule,"
        " broken grey lines: the command's limits."
    )
    quiet = "What is left of the error where it should be none: the smaller, the better."
    return [
        Section(f"Steps on {on}", chart_html(step_chart(found, traces, place, rotary), steps)),
        Section(
            f"Error on {on}", chart_html(error_chart(traces, place, rotary), quiet)
        ),
    ]  # fmt: skip


def step_chart(
    found: Validation, traces: Mapping[tuple[str, str], Traces], place: str, rotary: bool
) -> Chart:
    """Position and command after the first step up and the first one down, loops overlaid."""
    (unit, factor), first = units_of(rotary).position, found.figures[found.judged][place]
    runs = _runs(traces, place, "step")
    some = next(iter(runs.values()))
    begins = [int(at) for at in np.flatnonzero(np.diff(some.r))[:2] + 1]
    span = _span(found, place, begins[1] - begins[0], some)
    command = first.command_unit if first.command_peak is not None else units_of(rotary).force.name
    limit = first.command_limit
    panels = []
    for begin in begins:
        height = factor * float(some.r[begin] - some.r[begin - 1])
        title = f"step of {number(height)} {unit}"
        lines = [_cut(some, some.r, begin, span, factor, "reference", "other", "dotted")]
        lines += [_of(name, run, run.y, begin, span, factor) for name, run in runs.items()]
        panels.append(
            Panel(SINCE, f"position [{unit}]", lines, title, y_range=_near(lines, height))
        )
    for begin in begins:
        lines = [_of(name, run, run.u, begin, span, 1.0) for name, run in runs.items()]
        marks = [] if limit is None else [Mark(-limit), Mark(limit)]
        panels.append(Panel(SINCE, f"command [{command}]", lines, marks=marks))
    what = "position and command after a step in the simulated loop, all controllers"
    return Chart(f"loop-{place}", what, panels, columns=2)


def _near(lines: Sequence[Line], height: float) -> tuple[float, float] | None:
    """Range around a step where a loop leaves it by far, as one that runs away."""
    reference, *loops = lines
    low, high = float(reference.y.min()), float(reference.y.max())
    low, high = min(low, high - abs(height)), max(high, low + abs(height))
    low, high = low - abs(height), high + abs(height)
    inside = all(bool(np.all((one.y > low) & (one.y < high))) for one in loops)
    return None if inside else (low, high)


def error_chart(traces: Mapping[tuple[str, str], Traces], place: str, rotary: bool) -> Chart:
    """Error along the smooth reference and in the last dwell, loops overlaid."""
    unit, factor = units_of(rotary).position
    panels = []
    for kind, title in ERRORS_SHOWN:
        runs = _runs(traces, place, kind)
        some = next(iter(runs.values()))
        begin = 0 if kind == "smooth" else _rest(some)
        span = len(some.t) - begin
        lines = [_of(name, run, run.r - run.y, begin, span, factor) for name, run in runs.items()]
        start = "time [s]" if kind == "smooth" else "time, after half of the dwell [s]"
        panels.append(Panel(start, f"error [{unit}]", lines, title))
    what = "error along the smooth reference and at rest in the simulated loop, all controllers"
    return Chart(f"error-{place}", what, panels, columns=2, shared_x=False)


def _runs(
    traces: Mapping[tuple[str, str], Traces], place: str, kind: Literal["step", "smooth"]
) -> dict[str, LoopRun]:
    return {name: getattr(run, kind) for (name, where), run in traces.items() if where == place}


def _span(found: Validation, place: str, most: int, run: LoopRun) -> int:
    """Samples after a step in which the loops differ: until the slowest has long settled."""
    times = [one[place].settling for one in found.figures.values() if place in one]
    h = float(run.t[1] - run.t[0])
    return int(np.clip(SETTLING_TIMES_SHOWN * float(np.median(times)) / h, min(50, most), most))


def _rest(run: LoopRun) -> int:
    """First sample of the last half of the last dwell."""
    last = int(np.flatnonzero(np.diff(run.r))[-1]) + 1
    return (last + len(run.r)) // 2


def _of(name: str, run: LoopRun, values: Array, begin: int, span: int, factor: float) -> Line:
    """A line of a loop, called and coloured by its controller."""
    alone = name.removesuffix(COMPENSATED).removesuffix(SCHEDULED)
    shown = name if alone == PRESENT else name.replace(alone, alone.upper())
    beside: LineStyle = "dotted" if name.endswith(SCHEDULED) else "dashed"
    style: LineStyle = "line" if alone == name else beside
    return _cut(run, values, begin, span, factor, shown, LOOP_COLOURS[alone], style)


def _cut(
    run: LoopRun,
    values: Array,
    begin: int,
    span: int,
    factor: float,
    name: str,
    colour: Colour,
    style: LineStyle,
) -> Line:
    part = slice(begin, begin + span)
    t = run.t[part]
    return Line(name, t - t[0], factor * np.asarray(values, dtype=np.float64)[part], colour, style)
