"""The demo for a terminal: truth beside estimate, before beside after, and where to go next."""

from dataclasses import replace
from pathlib import Path
from typing import Any

from identification.model.estimates import Estimate
from workbench.cards.readable import number, shown, shown_unit
from workbench.output import next_step, written
from workbench.report.design_tables import design_lines
from workbench.report.model_tables import estimate_cells, not_identified
from workbench.report.trace import errors_table, logs_of_trace
from workbench.report.trace_words import trace_sentence, words
from workbench.report.validation import (
    error_cells,
    loop_name,
    validation_lines,
    validation_sentence,
    validation_table,
)
from workbench.report.view import notes
from workbench.screen import Part, Row, Screen, listed, more, screen, tabled
from workbench.steps.demo import Demonstration
from workbench.steps.loop_figures import PRESENT, LoopFigures
from workbench.steps.recommend import called
from workbench.steps.trace import effect_estimates

SIMULATED = (
    "Simulated: two logs of a pneumatic positioning rig, one for training and one held out. Its"
    " friction has an effect that was not given to any model; only the logs were used."
)
LETTERS = (
    "m: mass; F_c: Coulomb friction, F_v: viscous, F_s: breakaway, dv: stick band; p, n: direction"
)
TRUTH_HEAD = ("parameter", "estimate", "unit", "95 % interval", "truth")


def demo_view(found: Demonstration, folder: Path) -> Screen:
    """The demo for a terminal; with --verbose also what `design` and `validate` say of it."""
    traced, rotary = found.traced, found.traced.model.rotary
    errors = errors_table(traced.trace, rotary)
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
        more(validation_table(found.validation, rotary)),
        more(listed(validation_lines(found.validation, rotary))),
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
    units, judged = shown(found.traced.model.rotary), found.validation.judged
    head = ("controller", "static error", "overshoot", "settling", "tracking error",
            f"peak force [{units.force}]", "modulus margin")  # fmt: skip
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
