"""The chain from a recipe with an undeclared effect to a validated design, beside the truth."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from design.closed_loop.loop_figures import Traces
from design.controllers.design import design
from design.controllers.validate import Validation, validate
from design.identified.trace_logs import Traced, trace_logs
from design.machine.design import Design
from design.simulated.recipe import Recipe
from design.simulated.record import record, truth
from identification.effects._library import built_in
from identification.errors import BadCard
from identification.model.karnopp import NAMES
from identification.progress import Progress
from workbench.cards.card import Card
from workbench.logs.sources import read_sources
from workbench.output import dumps
from workbench.steps.simulate import as_columns

HELD_OUT_SEED = 100  # added to a recipe's seed for the run that no fit sees


@dataclass(frozen=True)
class Demonstration:
    """What the chain found, and the recipe's truth."""

    traced: Traced
    design: Design
    validation: Validation
    traces: Mapping[tuple[str, str], Traces]
    truth: Mapping[str, Any]

    @property
    def named_rightly(self) -> bool:
        """Whether the effects found are those of the truth, and no other."""
        return {one.effect.key for one in self.traced.trace.effects} == set(self.truth["effects"])

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
    known = truth(card.name, recipe_of(card), rig=card.rig())
    (folder / "truth.json").write_text(dumps(known) + "\n", encoding="utf-8")
    train, test = (read_sources([str(one.absolute())], str(card.path)) for one in (path, other))
    traced = trace_logs(train.logs, test.logs, built_in(), seed, on_progress)
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
    seed = recipe.seed + HELD_OUT_SEED if held_out else recipe.seed
    log = record(card.name, recipe, seed, card.rig(), card.controller)
    path = folder / f"{card.name}{'_held_out' if held_out else ''}.parquet"
    pd.DataFrame(as_columns(log, card)).to_parquet(path, index=False)
    return path
