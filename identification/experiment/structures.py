"""Effects that a machine may have, as directions beside its parameters in the same information.

An effect changes a run by so much; what of that no parameter, and no other effect, makes up for is
what discriminates it. Atkinson, Fedorov, Biometrika 62 (1975) 57: T-optimality is the largest such
rest."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.arrays import Array
from identification.effects._base import Acting, Effect, Param
from identification.estimation.windowed_run.parameters import plant_with
from identification.estimation.windowed_run.run_errors import soft
from identification.experiment.information import (
    NOT_FOLLOWED,
    Errors,
    Information,
    lasting_jacobian,
    unknowns,
)
from identification.model.estimates import Drive
from identification.model.plant import Plant

NO_EFFECT = "no effect"
SOUGHT_SIZE = 0.15  # of the Coulomb level, force of an effect that is looked for
END_PLACES = {"y_p": 0.6, "y_n": -0.6}  # of half the stroke, places at which its ends begin
FAR_CHANGE = 10.0  # in units of the noise, from which what an effect changes counts less
DIRECTION_RIDGE = 1e-9  # of the information's scale, below which a direction is rounding


def sought(effect: Effect, plant: Plant, stroke: tuple[float, float]) -> Acting:
    """The effect at a size that matters on this plant, at a place within the stroke [m]."""
    coulomb = 0.5 * (plant.friction.F_cp + plant.friction.F_cn)
    home, reach = 0.5 * (stroke[0] + stroke[1]), 0.5 * (stroke[1] - stroke[0])
    largest = max((abs(p.typical) for p in effect.params if _is_force(p)), default=1.0)
    values = {}
    for p in effect.params:
        value = p.typical if p.default is None or p.linear else p.default
        if _is_force(p):
            value *= SOUGHT_SIZE * coulomb / largest
        elif p.role == "place":
            value = home + 0.4 * reach
        elif p.role == "width":
            value = 0.15 * reach
        elif p.role == "period":
            value = min(p.typical, 0.5 * reach)
        elif p.name in END_PLACES:
            value = home + END_PLACES[p.name] * reach
        values[p.name] = float(np.clip(value, p.low, p.high))
    return effect.acting(values)


def _is_force(p: Param) -> bool:
    """Whether a parameter is the size of a force."""
    return p.linear and p.unit in ("N", "N m")


def structures(
    plant: Plant, rivals: Sequence[Acting], errors_of: Errors, drive: Drive,
    *, lost: float = NOT_FOLLOWED,
) -> Information:  # fmt: skip
    """What runs identify of the plant's parameters and, behind them, of each rival at its size.

    plant: without the rivals; lost: as of `information`. names: the plant's parameters, then the
    rivals' keys; one that changes nothing has zeros.
    """
    names, x, unit = unknowns(plant, drive)
    J, loose = lasting_jacobian(lambda at: errors_of(plant_with(plant, names, at * unit)), x, lost)
    here = errors_of(plant)
    columns = [J]
    for one in rivals:
        changed = errors_of(replace(plant, effects=(*plant.effects, one))) - here
        changed = np.where(np.isfinite(changed), changed, 0.0)
        columns.append(soft(changed, FAR_CHANGE)[:, np.newaxis])
    both = np.hstack(columns)
    keys = tuple(one.key for one in rivals)
    return Information(
        (*names, *keys), np.concatenate([unit, np.ones(len(keys))]), both.T @ both, loose
    )


def discriminated(matrix: Array, one: int, others: Sequence[int]) -> float:
    """Square of what effect `one` changes and the directions `others` do not make up for."""
    at = np.array(others, dtype=np.int64)
    M, b = matrix[np.ix_(at, at)], matrix[at, one]
    size = np.sqrt(np.maximum(np.diag(M), 0.0))
    scale = np.where(size > 0.0, size, 1.0)
    solved = np.linalg.solve(
        M / np.outer(scale, scale) + DIRECTION_RIDGE * np.eye(len(at)), b / scale
    )
    return max(float(matrix[one, one] - (b / scale) @ solved), 0.0)
