"""The actuator equation from a log: F = k1 * (integral of u) - k2 y + constant, by least squares.

Integrating the command keeps the noise of F and y where it is; differentiating them would not.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.estimation.regression.equation_rows import integral
from identification.estimation.regression.weighted_rows import of_column
from identification.log import Log


@dataclass(frozen=True)
class ActuatorFit:
    """k1 [N/(V s)], k2 [N/m]; rms [N] and `relative` (of the force's own standard deviation): what
    the equation leaves."""

    k1: float
    k2: float
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
    force = np.concatenate([log["F"] for log in logs])
    of_log = np.repeat(np.eye(len(logs)), [len(log) for log in logs], axis=0)
    impulse = np.concatenate([integral(log["u"], log.h) for log in logs])
    columns = np.column_stack([impulse, -np.concatenate([log["y"] for log in logs]), of_log])
    size = of_column(columns)
    theta = np.linalg.lstsq(columns / size, force, rcond=None)[0] / size
    spread = float(np.std(force - columns @ theta))
    k1, k2 = (float(x) for x in theta[:2])
    return ActuatorFit(k1, k2, spread, spread / max(float(np.std(force)), 1e-300))
