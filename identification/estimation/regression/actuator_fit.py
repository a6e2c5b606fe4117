"""The actuator equation from a log: F = k1 * (integral of u) - k2 y + constant, by least squares.

Integrating the command keeps the noise of F and y where it is; differentiating them would not.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.estimation.regression.equation_rows import integral
from identification.estimation.regression.weighted_rows import least_squares
from identification.log import Log
from identification.model.plant import Actuator
from identification.thresholds import FAR_LESS


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
        return self.k1 > 0 and self.k2 >= 0 and self.relative < FAR_LESS

    @property
    def nearest(self) -> Actuator:
        """An actuator, which needs them of their signs."""
        return Actuator(max(self.k1, 1e-9), max(self.k2, 0.0))


def fit_actuator(logs: Sequence[Log]) -> ActuatorFit:
    """k1 and k2 common to all logs; each needs u [V], y [m] and F [N] on an even clock.

    Source: the paper's linear actuator dF/dt = k1 u - k2 v, integrated; least squares.
    """
    columns = np.vstack([np.column_stack([integral(log["u"], log.h), -log["y"]]) for log in logs])
    lengths = [len(log) for log in logs]
    constants = np.repeat(np.eye(len(logs)), lengths, axis=0)  # one a log
    X, force = np.hstack([columns, constants]), np.concatenate([log["F"] for log in logs])
    theta = least_squares(X, force)
    left = float(np.std(force - X @ theta))
    share = left / max(float(np.std(force)), 1e-300)
    return ActuatorFit(float(theta[0]), float(theta[1]), left, share)
