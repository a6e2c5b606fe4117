"""The chain from a recipe with an undeclared effect to a validated design, beside the truth."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.errors import BadCard
from identification.karnopp import NAMES
from identification.library import built_in
from workbench.card import Card
from workbench.design_values import Design
from workbench.design_views import design_lines
from workbench.identifying import Progress
from workbench.output import dumps
from workbench.recipe import Recipe
from workbench.recording import as_columns, record, truth
from workbench.sources import read_sources
from workbench.trace_views import effect_rows, error_rows, errors_head, sentence
from workbench.tracing import Traced, trace_sources
from workbench.tuning import design
from workbench.validating import Traces, Validation, validate
from workbench.validation_views import HEAD, validation_lines, validation_rows, verdict
from workbench.views import Row, in_digits, table, written

if TYPE_CHECKING:
    from rich.console import Group


HELD_OUT = 100  # added to a recipe's seed for the run that no fit sees


@dataclass(frozen=True)
class Demonstration:
    """What the chain found, and the recipe's truth."""

    traced: Traced
    design: Design
    validation: Validation
    traces: Mapping[tuple[str, str], Traces]
    truth: Mapping[str, Any]

    @property
    def worst_error(self) -> float:
        """Largest relative error of an identified parameter of the nine."""
        known = self.traced.model.friction
        errors: list[float] = [
            abs(value / self.truth["friction"][name]["value"] - 1.0)
            for name in NAMES
            if (value := known[name].value) is not None
        ]
        return max(errors)


def demonstrate(card: Card, folder: Path, seed: int, on_progress: Progress) -> Demonstration:
    """Simulate two runs of the card's recipe into `folder`, read them back, trace what the plain
    model lacks, then design on the model found, and validate."""
    path, other = simulated_log(card, folder), simulated_log(card, folder, held_out=True)
    known = truth(card.name, recipe_of(card), motion=card.rig().motion)
    (folder / "truth.json").write_text(dumps(known) + "\n", encoding="utf-8")
    train, test = (read_sources([str(one.absolute())], str(card.path)) for one in (path, other))
    traced = trace_sources(train, test, built_in(), seed, on_progress)
    on_progress("designing", 0.0)
    found = design(traced.model)
    on_progress("designing", 0.5)
    validation, traces = validate(traced.model, found, np.random.default_rng(seed))
    return Demonstration(traced, found, validation, traces, known)


def recipe_of(card: Card) -> Recipe:
    """The card's recipe; raises BadCard where it has none."""
    if card.recipe is None:
        raise BadCard(f"{card.path}: has no [recipe]; name a card with one")
    return card.recipe


def simulated_log(card: Card, folder: Path, *, held_out: bool = False) -> Path:
    """The log of the card's recipe as <card>.parquet, written into `folder`.

    held_out: another run of the machine, of its own seed (other random steps, other noise), as
    <card>_held_out.parquet.
    """
    import pandas as pd

    recipe = recipe_of(card)
    seed = recipe.seed + HELD_OUT if held_out else recipe.seed
    log = record(card.name, recipe, seed, card.rig())
    path = folder / f"{card.name}{'_held_out' if held_out else ''}.parquet"
    pd.DataFrame(as_columns(log, card)).to_parquet(path, index=False)
    return path


def demo_view(found: Demonstration, folder: Path) -> "Group":
    """The demo for a terminal: truth beside estimate, then design and verdict."""
    from rich.console import Group

    rotary = found.traced.model.rotary
    return Group(
        "Two logs of the paper's rig (table 2) with an effect that no model here declares were"
        " simulated; only the logs were used below.",
        sentence(found.traced),
        table(errors_head(True), error_rows(found.traced.trace, rotary)),
        table(("effect", "estimate", "unit", "95 % interval", "truth"), _effects(found)),
        table(("parameter", "estimate", "unit", "95 % interval", "truth"), _rows(found)),
        f"worst error of an identified parameter: {100 * found.worst_error:.3g} %",
        *design_lines(found.design, rotary),
        "",
        verdict(found.validation),
        table(HEAD, validation_rows(found.validation, rotary)),
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
    rows = iter(effect_rows(traced.trace, traced.model.rig.motion))
    out: list[Row] = []
    for e in traced.trace.effects:
        for p in e.effect.params:
            true = found.truth["effects"].get(e.effect.key, {}).get(p.name)
            out.append((*next(rows)[:4], f"{true['value']:g}" if true else "absent"))
    return out
