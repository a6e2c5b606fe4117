"""A model's machine as it is thought to be, and as it may be: plants drawn by what is not sure."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from identification.estimation.windowed_run.parameters import plant_with
from identification.model.plant import Plant
from workbench.documents.model import Model, used
from workbench.steps.closed_loop import in_the_loop
from workbench.steps.drift import model_in_force

UNTOLD = 0.3  # log of a value that no log tells, one sigma


def in_loop(model: Model) -> Plant:
    """The plant as its simulated loop has it."""
    return replace(model.simulated, effects=in_the_loop(model))


def drawn_plants(model: Model, rng: np.random.Generator, count: int) -> tuple[Plant, ...]:
    """Plants drawn from the errors of the model's parameters; those that no log tells within a
    third of what is assumed."""
    known = model_in_force(model, "")
    plant = in_loop(model)
    told = rng.multivariate_normal(
        known.values, known.covariance, count, check_valid="ignore", method="svd"
    )
    assumed = _assumed(model, known.untold)
    free = np.exp(UNTOLD * rng.standard_normal((count, len(assumed))))
    names = (*known.names, *assumed)
    sets = np.hstack([told, free * np.array(list(assumed.values()))])
    kept = [i for i, name in enumerate(names) if _is_of(plant, name)]
    return tuple(plant_with(plant, [names[i] for i in kept], row[kept]) for row in sets)


def _is_of(plant: Plant, name: str) -> bool:
    """Whether a parameter is of a plant: of its friction, actuator or of an effect that it has."""
    return "." not in name or name.split(".")[0] in {one.key for one in plant.effects}


def _assumed(model: Model, untold: Mapping[str, str]) -> dict[str, float]:
    """Values that simulations use of the friction and actuator parameters that no log tells."""
    every = {**model.friction, **(model.actuator or {})}
    return {
        name: used(one)
        for name, one in every.items()
        if name in untold and name != "k_a" and used(one) != 0.0
    }
