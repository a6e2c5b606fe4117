"""The demo for a terminal: truth beside estimate, then design and verdict."""

from pathlib import Path
from typing import TYPE_CHECKING

from workbench.output import Row, table, written
from workbench.report.design_tables import design_lines
from workbench.report.model_tables import in_digits
from workbench.report.trace_tables import effect_rows, error_rows, errors_head, trace_sentence
from workbench.report.validation_tables import (
    validation_lines,
    validation_table,
    validation_verdict,
)
from workbench.steps.demo import Demonstration

if TYPE_CHECKING:
    from rich.console import Group


def demo_view(found: Demonstration, folder: Path) -> "Group":
    """The demo for a terminal: truth beside estimate, then design and verdict."""
    from rich.console import Group

    rotary = found.traced.model.rotary
    return Group(
        "Two logs of the paper's rig (table 2) with an effect that no model here declares were"
        " simulated; only the logs were used below.",
        trace_sentence(found.traced),
        table(errors_head(True), error_rows(found.traced.trace, rotary)),
        table(("effect", "estimate", "unit", "95 % interval", "truth"), _effects(found)),
        table(("parameter", "estimate", "unit", "95 % interval", "truth"), _rows(found)),
        f"worst error of an identified parameter: {100 * found.worst_error:.3g} %",
        *design_lines(found.design, rotary),
        "",
        validation_verdict(found.validation),
        validation_table(found.validation, rotary),
        *validation_lines(found.validation, rotary),
        written(folder, "report.html", "design.html", "validation.html"),
    )


def _rows(found: Demonstration) -> list[Row]:
    rows: list[Row] = []
    for name, e in found.traced.model.friction.items():
        true = f"{found.truth['friction'][name]['value']:g}"
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
            out.append((*next(rows)[:4], f"{true['value']:g}" if true else "absent"))
    return out
