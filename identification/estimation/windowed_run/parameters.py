"""A plant's parameters by name: their values, units and bounds, and what kind of plant it is."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.arrays import Array
from identification.effects._base import Param
from identification.model.estimates import Drive
from identification.model.karnopp import NAMES, NEGATIVE, Karnopp
from identification.model.plant import Actuator, Motor, Plant
from identification.simulation.karnopp_step import kernel_parameters

AT_ZERO = 1.1e-9  # size up to which a plant, which needs one, keeps a parameter that comes out 0
NARROW = 0.3  # of its value, that the mass keeps at least in a search
SHAPE_REACH, PERIOD_REACH = 2.0, 1.2  # how far a search moves what an effect is not linear in


def names_of(plant: Plant, drive: Drive) -> list[str]:
    """Names of the parameters that are refined, effects' as key.name."""
    out = list(NAMES)
    if drive == "command" and isinstance(plant.actuator, Actuator):
        out += ["k1", "k2"]
    for acting in plant.effects:
        out += [f"{acting.key}.{p.name}" for p in acting.effect.params]
    return out


def values_of(plant: Plant, names: Sequence[str]) -> Array:
    """Their values."""
    every = dict(zip(NAMES, plant.friction.array.tolist(), strict=True))
    if isinstance(plant.actuator, Actuator):
        every |= {"k1": plant.actuator.k1, "k2": plant.actuator.k2}
    for acting in plant.effects:
        every |= {f"{acting.key}.{k}": v for k, v in acting.values.items()}
    return np.array([every[name] for name in names])


def units_in(plant: Plant, names: Sequence[str], x: Array) -> Array:
    """Sizes (k,) in whose parts the values x (k,) are changed; of a value of 0 the typical one."""
    typical = {f"{a.key}.{p.name}": p.typical for a in plant.effects for p in a.effect.params}
    of_none = np.array([abs(typical.get(name, 1.0)) or 1.0 for name in names])
    unit = np.where(x != 0.0, np.abs(x), of_none)
    unit[[name.endswith("asymmetry") for name in names]] = 1.0
    return np.asarray(unit)


def wide(p: Param) -> float:
    """Factor within which a search keeps what an effect is not linear in.

    The equations give a period closely, and one far beyond the travel is another effect.
    """
    return PERIOD_REACH if p.role == "period" else SHAPE_REACH


def plant_with(plant: Plant, names: Sequence[str], x: Array) -> Plant:
    """The plant with these values, put at their bounds where they lie outside."""
    every = dict(zip(names, x.tolist(), strict=True))
    nine = [every.get(name, getattr(plant.friction, name)) for name in NAMES]
    for i, name in enumerate(NAMES):
        size = abs(getattr(plant.friction, name))
        # A mass next to nothing would take a run next to for ever.
        least = max(1e-9, NARROW * size) if name == "m" else 1e-9
        nine[i] = min(nine[i], -least) if name in NEGATIVE else max(nine[i], least)
    actuator: Actuator | Motor | None = plant.actuator
    if isinstance(actuator, Actuator) and "k1" in every:
        actuator = Actuator(max(every["k1"], 1e-9), max(every["k2"], 0.0))
    effects = []
    for acting in plant.effects:
        own = {}
        for p in acting.effect.params:
            here = acting.values[p.name]
            low, high = p.low, p.high
            if not p.linear and here > 0 and p.name != "asymmetry":  # which may have either sign
                low, high = max(low, here / wide(p)), min(high, here * wide(p))
            own[p.name] = float(np.clip(every.get(f"{acting.key}.{p.name}", here), low, high))
        effects.append(acting.effect.acting(own))
    return Plant(Karnopp(*nine), actuator, tuple(effects))


def that_sticks(plant: Plant) -> Plant:
    """The plant with stick limits that a body can have: none lets go below the friction with which
    it then slides (Karnopp 1985)."""
    p = plant.friction
    if p.F_sp >= p.F_cp and -p.F_sn >= p.F_cn:
        return plant
    return replace(plant, friction=replace(p, F_sp=max(p.F_sp, p.F_cp), F_sn=min(p.F_sn, -p.F_cn)))


def kernel_rows(plant: Plant, names: Sequence[str], drive: Drive, x: Array) -> Array:
    """Kernel parameters (k, 11) of plants without effects with the values x (k, d), each the row of
    `plant_with` where x lies inside the bounds that this has."""
    begun, k1, k2 = plant_with(plant, names, values_of(plant, names)), 0.0, 0.0
    if drive == "command" and isinstance(begun.actuator, Actuator):
        k1, k2 = begun.actuator.k1, begun.actuator.k2
    rows = np.repeat(kernel_parameters(begun.friction.array, k1, k2)[np.newaxis], len(x), axis=0)
    rows[:, [(*NAMES, "k1", "k2").index(name) for name in names]] = x
    return rows


def even(plant: Plant) -> dict[str, float]:
    """A prior that holds every shape that is at its default (an asymmetry of 0), nothing else."""
    return {
        f"{a.key}.{p.name}": 0.0
        for a in plant.effects
        for p, value in zip(a.effect.params, a.p, strict=True)
        if p.at_default(value)
    }


def plant_is_motor(plant: Plant) -> bool:
    """Whether a motor drives it, whose position nothing brings back."""
    return isinstance(plant.actuator, Motor)


def on_bristle(plant: Plant) -> bool:
    """Whether a bristle stands for sticking: its sub-steps make runs long, and err."""
    return any(acting.effect.place.elastic for acting in plant.effects)


def is_unanchored(plant: Plant, drive: Drive) -> bool:
    """Whether a force drives it and nothing brings its position back to the log's."""
    return drive == "force" or plant_is_motor(plant)
