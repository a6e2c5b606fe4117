"""The actuator equation from a log: F = k1 * (integral of u) - k2 y + constant, by least squares.

Integrating the command keeps the noise of F and y where it is; differentiating them would not.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.arrays import Array
from identification.estimation.plain_search.fitted_runs import impulse_of
from identification.log import Log


@dataclass(frozen=True)
class ActuatorFit:
    """k1 [N/(V s)], k2 [N/m] with standard deviations, each log's constant [N] (logs,).

    rms [N] and `relative` (of the force's own standard deviation): what the equation leaves.
    """

    k1: float
    k2: float
    sd: tuple[float, float]
    constants: Array
    rms: float
    relative: float

    @property
    def plausible(self) -> bool:
        """Whether a linear actuator (k1 > 0, k2 >= 0) explains most of the force."""
        return self.k1 > 0 and self.k2 >= 0 and self.relative < 0.3


def fit_actuator(logs: Sequence[Log]) -> ActuatorFit:
    """k1 and k2 common to all logs; each needs u [V], y [m] and F [N] on an even clock.

    Source: the paper's linear actuator dF/dt = k1 u - k2 v, integrated; least squares.
    """
    total = sum(len(log) for log in logs)
    columns = np.zeros((total, 2 + len(logs)))
    force = np.concatenate([log["F"] for log in logs])
    low = 0
    for index, log in enumerate(logs):
        rows = slice(low, low + len(log))
        columns[rows, 0] = impulse_of(log)
        columns[rows, 1] = -log["y"]
        columns[rows, 2 + index] = 1.0
        low += len(log)
    size = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    theta, _, _, _ = np.linalg.lstsq(columns / size, force, rcond=None)
    residual = force - columns @ (theta / size)
    spread = float(np.std(residual))
    inverse = np.linalg.pinv((columns / size).T @ (columns / size))
    sd = spread * np.sqrt(np.diag(inverse)) / size
    theta = theta / size
    return ActuatorFit(
        k1=float(theta[0]),
        k2=float(theta[1]),
        sd=(float(sd[0]), float(sd[1])),
        constants=theta[2:],
        rms=spread,
        relative=spread / max(float(np.std(force)), 1e-300),
    )
