"""Whether the motion is prescribed by a rig, whatever the model lacks, and at how many speeds."""

from collections.abc import Sequence

import numpy as np

from identification.arrays import Array
from identification.estimation.regression.equation_rows import NOTHING_KNOWN, MotionLog, mechanical
from identification.estimation.regression.weighted_rows import least_squares

# Of the force's quick changes, that inertia explains of a body that is free
SHOWN_BY_INERTIA = 0.15
# Of them, that inertia and damping explain of one that follows the force (prescribed: 0.3)
SHOWN_BY_FORCE = 0.6
NEXT = 2.0  # times their length, that neighbouring windows begin apart at most
CHANCE_FACTOR = 25.0  # times what chance explains of noise
LEAST_PAIRS = 30  # pairs of neighbouring windows, without which nothing shows that a rig moves it
SPEED_RANGE = (
    0.05,
    0.95,
)  # quantiles of speed, of which the higher must be so many times the lower


def inertia_has_no_part(logs: Sequence[MotionLog]) -> bool:
    """Whether inertia has no part in how the force changes from one window to the next.

    Most of what a model lacks changes slowly (with place, pressure, time), and constant friction
    not at all in one direction: what is left in the differences of neighbouring windows of sliding
    is the inertia of a body that is free, or else a rig moves it. A lag of viscous friction may
    cancel the inertia; the force's changes then still explain those of the speed. Ours.
    """
    columns, forces, noise = [], [], 0.0
    for one in logs:
        rows = mechanical(one, NOTHING_KNOWN)
        start = one.sliding.start
        after = np.searchsorted(start, start + one.sliding.length)
        pairs = np.flatnonzero(after < len(start))
        pairs = pairs[start[after[pairs]] <= start[pairs] + NEXT * one.sliding.length]
        pairs = pairs[one.up[pairs] == one.up[after[pairs]]]
        columns.append(rows.X[after[pairs]][:, [0, 3, 4]] - rows.X[pairs][:, [0, 3, 4]])
        forces.append(rows.b[after[pairs]] - rows.b[pairs])
        noise += float(np.sum(rows.sd[after[pairs]] ** 2 + rows.sd[pairs] ** 2))
    X, b = np.concatenate(columns), np.concatenate(forces)
    if len(b) < LEAST_PAIRS:
        return False
    theta = least_squares(X, b)
    others = b - X[:, 1:] @ theta[1:]
    left = float(np.sum((others - X[:, 0] * theta[0]) ** 2))

    def explained(square: float, part: float) -> bool:
        """Whether more than chance, and this part of what is no noise, is explained of a square."""
        gained = square - left
        return gained > CHANCE_FACTOR * noise / len(b) and gained > part * (square - noise)

    inertia = theta[0] > 0.0 and explained(float(np.sum(others**2)), SHOWN_BY_INERTIA)
    return not (inertia or explained(float(np.sum(b**2)), SHOWN_BY_FORCE))


def speed_ratio(speed: Array) -> float:
    """How many times the slow speeds (r,) of a direction the quick ones are."""
    slow, fast = np.quantile(speed, SPEED_RANGE)
    return float(fast / slow)
