"""`workbench simulate`: a recipe -> its log, the truth beside it."""

from pathlib import Path
from typing import Literal

import click

from workbench import options
from workbench.output import emit, results
from workbench.signature import argument, option


@options.command(epilog="Example: workbench simulate paper_table1 --seed 3 --format parquet")
def command(
    card_name: str = argument("CARD"),
    seed: int | None = option("Instead of the recipe's.", type=click.IntRange(min=0)),
    form: Literal["csv", "parquet"] = option("", "--format", default="csv"),
    effects: tuple[Path, ...] = options.EFFECTS_OPTION,
    out: Path | None = options.OUT_OPTION,
) -> None:
    """Make the log of a recipe, its truth beside it.

    CARD is a path or the name of a shipped card with a [recipe]. Writes <card>.csv or .parquet,
    which the same card reads, and truth.json with parameters and effects, which no command reads.
    """
    from workbench.interface.logs import simulate

    with results("simulate", out) as folder:
        found = simulate(card_name, seed=seed, effects=effects)
        name = f"{found.card.name}.{form}"
        if form == "csv":
            found.frame.to_csv(folder.path / name, index=False, float_format="%.12g")
        else:
            found.frame.to_parquet(folder.path / name, index=False)
        folder.write_json("truth.json", found.truth)
    log, end = found.log, folder.final
    known = {"log": end / name, "samples": len(log), "seed": found.truth["seed"], "h": log.h}
    said = f"{len(log)} samples every {log.h:.4g} s, seed {known['seed']}"
    emit({**known, "out": end}, lambda: f"{said}\nwritten: {known['log']}, {end / 'truth.json'}")
