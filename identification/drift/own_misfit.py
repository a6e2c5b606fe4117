"""How sure a log is of a machine's parameters, estimated by the logs that the model comes from."""

from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from identification.arrays import Array
from identification.drift.reference_model import ReferenceModel
from identification.thresholds import ADEQUATE, ASTRAY, CHANCE_LEVEL, LOST_FIT


@dataclass(frozen=True, eq=False)
class OwnMisfit:
    """What a model's own logs say of the covariances of a log's and of the model's fit.

    factor: on both; scatter (d,): variance of each parameter that its own logs show, relative;
    logs: number of them; left: misfit that fits of one of them leave, at most, infinite where that
    is not known.
    """

    factor: float
    scatter: Array
    logs: int
    left: float

    def has_lost_its_way(self, misfit: float) -> bool:
        """Whether a log's fit leaves so much beside those of the model's own logs that it says
        nothing of the parameters."""
        return misfit > LOST_FIT * self.left

    def of_log(self, own: Array, misfit: float) -> Array:
        """Covariance (d, d) of a log's errors, by that of its fit and the misfit this leaves.

        A fit that leaves more than those of the model's own logs is near to losing its way, or the
        log has something more in it: it says as much less of the parameters.
        """
        lost = max(1.0, misfit / (ASTRAY * self.left))
        return lost * _at_least(self.factor * own, self.scatter)

    def of_model(self, in_force: Array) -> Array:
        """Covariance (d, d) of the model's errors, by that of its fit."""
        return _at_least(self.factor * in_force, self.scatter / self.logs)


def _at_least(covariance: Array, variance: Array) -> Array:
    """The covariance (d, d) with variances of at least these (d,)."""
    return np.asarray(covariance + np.diag(np.maximum(variance - np.diag(covariance), 0.0)))


def own_misfit(model: ReferenceModel) -> OwnMisfit:
    """Of the model's own logs; nothing where it left noise alone, or they are not known.

    These logs were among those that the model was fitted on: a new one lies farther from it, as
    one that is left out does. Their distance is that of a few, and could be small by chance: so it
    is taken as large as it may well be. A fit that leaves noise alone is never surer than it says.
    """
    found, d = model.own_logs, len(model.names)
    if found is None:
        return OwnMisfit(1.0, np.zeros(d), 1, float("inf"))
    n, known = len(found.left), dict(zip(found.names, found.scatter, strict=True))
    left_out = (n + 1.0) / (n - 1.0)
    freedom = (n - 1.0) * max(1, sum(x is not None for x in found.scatter))
    caution = freedom / float(chi2.ppf(CHANCE_LEVEL, freedom))
    apart = float(np.mean(found.apart))
    factor = left_out * apart * caution
    if model.chi_square <= ADEQUATE:
        factor = max(1.0, left_out * apart)
    scatter = np.array([known.get(name) or 0.0 for name in model.names])
    return OwnMisfit(factor, left_out * scatter**2, n, max(*found.left, 1.0))
