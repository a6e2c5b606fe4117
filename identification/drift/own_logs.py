"""What a model left on its own logs, and how much less sure that makes what a new log says.

A model that lacks something (a Stribeck dip, say) has no true parameters: every log gives it those
that make up for what it lacks along that log's motion. How far they lie apart is known from the
logs that the model comes from; each is estimated alone, in the same way as a new log.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.stats import chi2

from identification.arrays import Array
from identification.drift.log_estimate import LogEstimate, estimate_log
from identification.drift.reference_model import OwnLogs, ReferenceModel
from identification.errors import NotIdentifiable
from identification.log import Log
from identification.thresholds import ADEQUATE, ASTRAY, CHANCE_LEVEL, COMPLETE, HOPELESS

LOG_PARTS = 3  # stretches of a single log
LEAST_STRETCH = 3.0  # s, of a stretch that is informative by itself


def with_own_logs(
    model: ReferenceModel, logs: Sequence[Log], rng: np.random.Generator
) -> ReferenceModel:
    """The model with what its own logs say of it, each of them alone.

    logs: those that it was fitted on. A single one is cut into parts where more than noise is left
    of it; without that its own fit says how sure it is.
    """
    parts = len(logs) == 1
    if parts and model.chi_square <= COMPLETE:
        return model
    found = []
    for log in _stretches(logs[0]) if parts else logs:
        try:
            found.append(estimate_log(model, log, rng))
        except NotIdentifiable:
            continue  # a log from which nothing is identifiable alone
    return replace(model, own_logs=own_logs_of(model, found, parts)) if len(found) > 1 else model


def _stretches(log: Log) -> list[Log]:
    """A log in parts that are long enough to be fitted."""
    count = min(LOG_PARTS, int(log.duration / LEAST_STRETCH))
    edges = np.linspace(0, len(log), count + 1).astype(int)
    return [log.part(int(a), int(b)) for a, b in pairwise(edges)]


def own_logs_of(
    model: ReferenceModel, found: Sequence[LogEstimate], parts: bool = False
) -> OwnLogs:
    """How far the estimates of a model's own logs, two at least, lie from it."""
    changes, apart = [], []
    for one in found:
        silent = [name in one.not_identifiable for name in model.names]
        at = np.flatnonzero(np.logical_not(silent))
        both = (one.covariance + model.relative_covariance)[np.ix_(at, at)]
        square = float(one.change[at] @ np.linalg.solve(both, one.change[at]))
        apart.append(square / max(len(at), 1))
        changes.append(np.ma.array(one.change, mask=silent))
    scatter = np.ma.sqrt(np.ma.mean(np.ma.array(changes) ** 2, axis=0))
    left = tuple(one.chi_square for one in found)
    return OwnLogs(model.names, tuple(scatter.tolist()), tuple(apart), left, parts)


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
        return misfit > HOPELESS * self.left

    def of_log(self, own: Array, misfit: float) -> Array:
        """Covariance (d, d) of a log's errors, by that of its fit and the misfit this leaves.

        A fit that leaves more than those of the model's own logs is near to losing its way, or the
        log has something more in it: it says as much less of the parameters.
        """
        lost = max(1.0, misfit / (ASTRAY * self.left))
        return lost * _at_least(self.factor * own, self.scatter)

    def of_model(self, own: Array) -> Array:
        """Covariance (d, d) of the model's errors, by that of its fit."""
        return _at_least(self.factor * own, self.scatter / self.logs)


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
    factor = left_out * float(np.mean(found.apart))
    if model.chi_square <= ADEQUATE:
        factor = max(1.0, factor)
    else:
        freedom = (n - 1.0) * max(1, sum(x is not None for x in found.scatter))
        factor *= freedom / float(chi2.ppf(CHANCE_LEVEL, freedom))
    scatter = np.array([known.get(name) or 0.0 for name in model.names])
    return OwnMisfit(factor, left_out * scatter**2, n, max(*found.left, 1.0))
