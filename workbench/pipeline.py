"""The chain, each link callable alone: runs -> model -> design -> validation."""

from dataclasses import dataclass

import numpy as np

from identification.result import KarnoppFit
from workbench.identifying import Options, Progress, Source, identify
from workbench.model import Model
from workbench.sources import Sources

__all__ = ["Identified", "Options", "identify_sources"]


@dataclass(frozen=True)
class Identified:
    """A model, the fit it comes from, and the runs it was fitted on."""

    model: Model
    fit: KarnoppFit
    sources: tuple[Source, ...]
    remarks: tuple[str, ...]


def identify_sources(
    sources: Sources,
    options: Options | None = None,
    seed: int = 0,
    *,
    posterior: bool = False,
    on_progress: Progress | None = None,
) -> Identified:
    """The model of the machine that the sources are of.

    Raises NotIdentifiable where the logs tell nothing, BadLog where a signal is missing.
    """
    model, fit = identify(
        sources.runs,
        np.random.default_rng(seed),
        card=sources.card.name,
        rig=sources.rig,
        options=options,
        on_progress=on_progress,
    )
    return Identified(model, fit, sources.runs, sources.remarks)
