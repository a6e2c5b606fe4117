"""`workbench simulate`: a recipe -> its log, the truth beside it."""

from pathlib import Path
from typing import Literal

import click

from workbench import options
from workbench.ending import StatusCommand
from workbench.output import JSON_OPTION, OUT_OPTION, emit, progress, results
from workbench.signature import argument, by_signature, option


@click.command(
    cls=StatusCommand, epilog="Example: workbench simulate paper_table1 --seed 3 --format parquet"
)
@by_signature
def command(
    card_name: str = argument("CARD"),
    seed: int | None = option("Instead of the recipe's.", type=click.IntRange(min=0)),
    form: Literal["csv", "parquet"] = option("", "--format", default="csv"),
    effects: tuple[Path, ...] = options.EFFECTS_OPTION,
    as_json: bool = JSON_OPTION,
    out: Path | None = OUT_OPTION,
) -> None:
    """Make the log of a recipe, its truth beside it.

    CARD is a path or the name of a shipped card with a [recipe]. Writes <card>.csv or .parquet,
    which the same card reads, and truth.json with parameters and effects, which no command reads.
    """
    import pandas as pd

    from identification.errors import BadCard
    from workbench.cards.card import load_card
    from workbench.cards.own_effects import library
    from workbench.logs.sources import card_path
    from workbench.steps.present import present_of_card
    from workbench.steps.simulate import as_columns, record, truth

    card = load_card(card_path(card_name), library(effects))
    card.refuse_velocity()
    if card.recipe is None:
        raise BadCard(f"{card.path}: has no [recipe]; name a card with one, as paper_table1")
    with results("simulate", out) as folder:
        with progress("simulating", as_json=as_json):
            log = record(card.name, card.recipe, seed, card.rig(), card.controller)
        name = f"{card.name}.{form}"
        frame = pd.DataFrame(as_columns(log, card))
        if form == "csv":
            frame.to_csv(folder.path / name, index=False, float_format="%.12g")
        else:
            frame.to_parquet(folder.path / name, index=False)
        now = present_of_card(card, card.rig(), card.recipe.h)
        known = truth(card.name, card.recipe, seed, rig=card.rig(), controller=now)
        folder.write_json("truth.json", known)
    result = {"log": folder.final / name, "samples": len(log), "seed": known["seed"], "h": log.h}
    emit({**result, "out": folder.final}, as_json, lambda: _said(result, folder.final))


def _said(result: dict[str, object], folder: Path) -> str:
    return (
        f"{result['samples']} samples every {result['h']:.4g} s, seed {result['seed']}\n"
        f"written: {result['log']}, {folder / 'truth.json'}"
    )
