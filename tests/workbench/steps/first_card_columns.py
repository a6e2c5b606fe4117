"""A first card of a file written column by column."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from design.first_card.proposal import Proposal
from identification.arrays import Array
from workbench.steps.first_card.proposal import proposed

T: Array = np.asarray(2e-3 * np.arange(5000), dtype=np.float64)
Cells = Sequence[float] | Sequence[str] | Array


def propose(folder: Path, headers: str, *columns: Cells) -> Proposal:
    cells = [[one if isinstance(one, str) else f"{one:.9g}" for one in own] for own in columns]
    path = folder / "run.csv"
    path.write_text("\n".join([headers, *map(",".join, zip(*cells, strict=True))]), "utf-8")
    return proposed(path)


def roles(found: Proposal) -> dict[str, str | int]:
    return {one.name: one.column for one in found.signals}
