"""What a model left on its own logs, and how much less sure that makes what a new log says.

A model that lacks something (a Stribeck dip, say) has no true parameters: every log gives it those
that make up for what it lacks along that log's motion. How far they lie apart is known from the
logs that the model comes from; each is estimated alone, in the same way as a new log.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from identification.arrays import Array
from identification.drift.log_estimate import LogEstimate, estimate_log, relative_change
from identification.drift.reference_model import OwnLogs, ReferenceModel
from identification.errors import NotIdentifiable
from identification.log import Log
from identification.thresholds import COMPLETE

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
    tried = _stretches(logs[0]) if parts else list(logs)
    found = []
    for log in tried:
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
    scale = np.outer(model.scales, model.scales)
    changes, apart = [], []
    for one in found:
        change, own, told = relative_change(model, one)
        at = np.flatnonzero(told)
        both = (own + model.covariance / scale)[np.ix_(at, at)]
        square = float(change[at] @ np.linalg.solve(both, change[at])) if len(at) else 0.0
        apart.append(square / max(len(at), 1))
        changes.append(np.where(told, change, np.nan))
    return OwnLogs(
        names=model.names,
        scatter=_root_mean_square(changes),
        apart=tuple(apart),
        left=tuple(one.chi_square for one in found),
        parts=parts,
    )


def _root_mean_square(rows: Sequence[Array]) -> tuple[float | None, ...]:
    """Over the rows (d,) that are known, None where none is."""
    known = np.isfinite(rows)
    square = np.sum(np.where(known, np.square(rows), 0.0), axis=0)
    count = np.sum(known, axis=0)
    return tuple(float(np.sqrt(s / n)) if n else None for s, n in zip(square, count, strict=True))
