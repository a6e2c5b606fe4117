"""The machines that there may be: drawn from a model's errors, and from how it has drifted."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from design.drawn_loops import DrawnPlants
from design.linear import ForceGains, commanded_plant, linear_plant
from identification.arrays import Array
from identification.errors import BadSpecification
from identification.estimation.windowed_run.parameters import plant_with, values_of
from identification.model.estimates import Estimate
from identification.model.karnopp import NAMES
from identification.model.plant import Actuator, Motor, Plant
from workbench.documents.drive import ForceLoop
from workbench.documents.model import Model
from workbench.steps.drawn import drawn_plants


@dataclass(frozen=True, eq=False)
class DrawnMachines:
    """A model, the plants drawn around it, and by what they were widened: relative deviations."""

    model: Model
    plants: tuple[Plant, ...]
    drift: Mapping[str, float]

    def linear(self, h: float, force: ForceLoop | None, probability: float) -> DrawnPlants:
        """The linear plants as a law that asks for force sees them every h [s]; see `each_linear`.

        Raises BadSpecification where the force loop is stable on none.
        """
        each = self.each_linear(h, force)
        drawn = [one for one in each if one is not None]
        return DrawnPlants.of(drawn, probability, len(each) - len(drawn))

    def each_linear(
        self, h: float, force: ForceLoop | None
    ) -> tuple[tuple[Array, Array] | None, ...]:
        """(A, B) of every plant, None where the force loop is not stable on it.

        Their input is the reference of the force loop, the command of an actuator without one, or
        else the force that the model's motor would give: another k_a is another gain.
        """
        return tuple(self._linear(plant, h, force) for plant in self.plants)

    def _linear(
        self, plant: Plant, h: float, force: ForceLoop | None
    ) -> tuple[Array, Array] | None:
        m, f = plant.friction.m, 0.5 * (plant.friction.F_vp + plant.friction.F_vn)
        own, drive = self.model.simulated.actuator, plant.actuator
        try:
            if isinstance(drive, Actuator) and force is not None:
                gains, ratio = ForceGains(force.k_i, force.T_i), max(1, round(h / force.h))
                return linear_plant(m, f, h, drive, gains, ratio)
            if isinstance(drive, Actuator):
                return commanded_plant(m, f, h, drive)
            a, b = linear_plant(m, f, h)
        except BadSpecification:
            return None
        gain = drive.k_a / own.k_a if isinstance(drive, Motor) and isinstance(own, Motor) else 1.0
        return a, gain * b


def drawn_machines(
    model: Model, rng: np.random.Generator, count: int, drift: Mapping[str, float] | None = None
) -> DrawnMachines:
    """So many machines, drawn from the errors of the model's parameters, and by `drift_found`."""
    drift = dict(drift or {})
    errors, drift_rng = rng.spawn(2)
    plants = drawn_plants(model, errors, count)
    if drift:
        names = tuple(drift)
        spread = np.array(list(drift.values()))
        factors = np.exp(spread * drift_rng.standard_normal((count, len(names))))
        plants = tuple(
            plant_with(plant, names, values_of(plant, names) * row)
            for plant, row in zip(plants, factors, strict=True)
        )
    return DrawnMachines(model, plants, drift)


def drift_found(models: Sequence[Mapping[str, Estimate]]) -> dict[str, float]:
    """By how much each of the nine has changed from one active model to the next: the relative
    deviation of a step, what the models themselves are unsure of taken off; only those that have.

    models: their friction, in the order in which they were active.
    """
    out = {}
    for name in NAMES:
        steps = [
            step
            for before, after in pairwise(models)
            if (step := _squared_step(before.get(name), after.get(name))) is not None
        ]
        if steps and (mean := float(np.mean(steps))) > 0.0:
            out[name] = math.sqrt(mean)
    return out


def _squared_step(old: Estimate | None, new: Estimate | None) -> float | None:
    """The squared logarithm of new over old, less its expectation where nothing has changed; None
    where a model does not know the parameter."""
    if old is None or new is None or not old.value or not new.value or old.unit != new.unit:
        return None
    if old.value * new.value < 0.0:
        return None
    unsure = sum(((one.sd or 0.0) / (one.value or 1.0)) ** 2 for one in (old, new))
    return math.log(new.value / old.value) ** 2 - unsure


def some_of(machines: DrawnMachines, count: int) -> DrawnMachines:
    """The first `count` of the machines."""
    return replace(machines, plants=machines.plants[:count])
