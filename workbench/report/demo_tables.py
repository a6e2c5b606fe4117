"""The demo for a terminal: truth beside estimate, then design and verdict."""

from pathlib import Path
from typing import TYPE_CHECKING

from workbench.cards.readable import as_shown, in_digits, number, shown_unit
from workbench.output import Row, next_step, table, written
from workbench.report.design_tables import design_lines
from workbench.report.trace_tables import effect_rows, error_rows, errors_head
from workbench.report.trace_words import trace_sentence
from workbench.report.validation_tables import (
    validation_lines,
    validation_sentence,
    validation_table,
)
from workbench.steps.demo import Demonstration

if TYPE_CHECKING:
    from rich.console import Group


def demo_view(found: Demonstration, folder: Path) -> "Group":
    """The demo for a terminal: truth beside estimate, then design and verdict."""
    from rich.console import Group

    rotary = found.traced.model.rotary
    traced = found.traced
    return Group(
        "Two logs of the paper's rig (table 2) were simulated, with an effect that no model here"
        " declares; only the logs were used. What came out:",
        trace_sentence(traced),
        f"Against the truth, the worst parameter is {number(100 * found.worst_error, 2)} % off.",
        validation_sentence(found.validation),
        next_step(f"open {folder / 'report.html'}; then the same with your own log:"),
        "      workbench init LOG, workbench identify LOG --card card.toml",
        table(errors_head(True), error_rows(traced.trace, rotary)),
        table(("effect", "estimate", "unit", "95 % interval", "truth"), _effects(found)),
        table(("parameter", "estimate", "unit", "95 % interval", "truth"), _rows(found)),
        validation_table(found.validation, rotary),
        *validation_lines(found.validation, rotary),
        "",
        *design_lines(found.design, rotary),
        written(folder, "report.html", "design.html", "validation.html"),
    )


def _rows(found: Demonstration) -> list[Row]:
    rows: list[Row] = []
    for name, e in found.traced.model.friction.items():
        true = _true(found.truth["friction"][name]["value"], e.unit)
        e = as_shown(e)
        if e.value is None or e.low is None or e.high is None:
            rows.append((name, "-", e.unit, f"not identified: {e.reason}", true))
            continue
        value, low, high = in_digits((e.value, e.low, e.high), e.value, e.sd)
        rows.append((name, value, e.unit, f"{low} to {high}", true))
    return rows


def _effects(found: Demonstration) -> list[Row]:
    """Parameters of the effects found, and what they are in truth."""
    traced = found.traced
    rows = iter(effect_rows(traced.trace, traced.model.rig))
    out: list[Row] = []
    for e in traced.trace.effects:
        for p in e.effect.params:
            true = found.truth["effects"].get(e.effect.key, {}).get(p.name)
            said = _true(true["value"], p.unit) if true else "absent"
            out.append((*next(rows)[:4], said))
    return out


def _true(value: float, unit: str) -> str:
    """A true value in the unit in which its estimate is shown."""
    return f"{shown_unit(unit).factor * value:g}"
