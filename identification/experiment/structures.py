"""Effects that a machine may have, as directions beside its parameters in the same information.

An effect changes a run by so much; what of that no parameter, and no other effect, makes up for is
what discriminates it. Atkinson, Fedorov, Biometrika 62 (1975) 57: T-optimality is the largest such
rest."""

from collections.abc import Sequence

import numpy as np

from identification.arrays import Array
from identification.effects._base import Acting, Effect, Param
from identification.model.plant import Plant

NO_EFFECT = "no effect"
SOUGHT_SIZE = 0.15  # of the Coulomb level, force of an effect that is looked for
END_PLACES = {"y_p": 0.6, "y_n": -0.6}  # of half the stroke, places at which its ends begin
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
