"""The plants that a machine may be, drawn by what its model is not sure of."""

from dataclasses import replace

import numpy as np

from design.closed_loop.driven_loop import in_the_loop
from design.machine.active_model import active_model
from design.machine.model import Model, used
from identification.estimation.windowed_run.parameters import plant_with
from identification.model.plant import Plant

NO_BAND_SHARE = 1e-3  # of the logs' speed: a band that none has
USUAL_BAND_SHARE = 0.03  # the same of a usual one
UNIDENTIFIED_SPREAD = 0.3  # log of a value that no log identifies, one sigma


def in_loop(model: Model) -> Plant:
    """The plant as its simulated loop has it; a band that is next to none is taken for one that no
    log identifies, whatever its interval."""
    plant = replace(model.simulated, effects=in_the_loop(model))
    lost = lost_bands(model)
    return plant_with(plant, tuple(lost), np.array(list(lost.values()))) if lost else plant


def lost_bands(model: Model) -> dict[str, float]:
    """Bands narrower than a thousandth of the logs' speed, with what is assumed in their place."""
    speed, nine = model.speed or 0.0, model.karnopp
    return {
        name: sign * USUAL_BAND_SHARE * speed
        for name, band, sign in (("dv_p", nine.dv_p, 1.0), ("dv_n", nine.dv_n, -1.0))
        if abs(band) < NO_BAND_SHARE * speed
    }


def drawn_plants(model: Model, rng: np.random.Generator, count: int) -> tuple[Plant, ...]:
    """Plants drawn from the errors of the model's parameters; those that no log identifies within a
    third of what is assumed."""
    known = active_model(model, "")
    plant = in_loop(model)
    drawn = rng.multivariate_normal(
        known.values, known.covariance, count, check_valid="ignore", method="svd"
    )
    every = {**model.friction, **(model.actuator or {})}
    assumed = {
        name: used(one)
        for name, one in every.items()
        if name in known.not_identifiable and name != "k_a" and used(one) != 0.0
    } | lost_bands(model)
    free = np.exp(UNIDENTIFIED_SPREAD * rng.standard_normal((count, len(assumed))))
    names = (*known.names, *assumed)
    sets = np.hstack([drawn, free * np.array(list(assumed.values()))])
    last = {name: i for i, name in enumerate(names)}  # what is assumed replaces what was lost
    effects = {one.key for one in plant.effects}
    indices = [i for n, i in last.items() if "." not in n or n.split(".")[0] in effects]
    return tuple(plant_with(plant, [names[i] for i in indices], row[indices]) for row in sets)
