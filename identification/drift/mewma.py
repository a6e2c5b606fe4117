"""Slow drift: a multivariate EWMA of the changes over a machine's logs, as a value to be stored.

The mean of the last logs is known better than one log, so a small lasting change shows in it.
What does not average out is kept apart: the error of the active model itself, and a margin
below which a change does not matter. Source: Lowry, Woodall, Champ and Rigdon, Technometrics 34
(1992).
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from identification.arrays import Array, BoolArray
from identification.drift.practical_margin import Change
from identification.errors import BadModel

CAUTION = 2.0  # deviations by which a learnt variance is taken larger
PRIOR_LOGS = 10.0  # logs that the stated variation counts as beside those seen
LEAST_VARIATION = 0.002  # relative sd below which a machine is not believed to repeat itself
Rows = tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class DriftState:
    """What the logs since the active model have shown; all relative to the model's values.

    model: key of the active model; names (d,): its parameters; mean (d,): weighted mean change
    so far, `weight` (d,) of the whole weight 1 reached; covariance (d, d): of the mean, the
    model's own error left out; last, last_variance (d,): of the last log, None before there is
    one; squares, pairs (d,): half square differences of successive logs beyond
    their own variance, summed, and their number; logs: number of logs taken in.
    """

    model: str
    names: tuple[str, ...]
    mean: tuple[float, ...]
    weight: tuple[float, ...]
    covariance: Rows
    last: tuple[float | None, ...]
    last_variance: tuple[float, ...]
    squares: tuple[float, ...]
    pairs: tuple[int, ...]
    logs: int = 0
    schema: Literal["drift_state/1"] = "drift_state/1"

    def __post_init__(self) -> None:
        d = len(self.names)
        rows = [
            self.mean, self.weight, self.covariance, self.last, self.last_variance, self.squares,
            self.pairs, *self.covariance,
        ]  # fmt: skip
        if any(len(row) != d for row in rows):
            raise BadModel(f"drift state of {d} parameters with entries of other lengths")


def fresh_state(model: str, names: tuple[str, ...]) -> DriftState:
    """The state of a machine whose active model has seen no new log."""
    d = len(names)
    zeros = (0.0,) * d
    return DriftState(model, names, zeros, zeros, (zeros,) * d, (None,) * d, zeros, zeros, (0,) * d)


def variation(state: DriftState, stated: float) -> Array:
    """Variance (d,) of the machine's parameters from log to log, relative.

    The stated standard deviation counts as PRIOR_LOGS differences of successive logs, beside those
    that were seen. Differences of neighbours hold little of a slow drift: von Neumann and others,
    Ann. Math. Statist. 12 (1941) 153.
    """
    squares, pairs = np.array(state.squares), np.array(state.pairs, dtype=np.float64)
    weight = PRIOR_LOGS + pairs
    found = (PRIOR_LOGS * stated**2 + squares) / weight
    # What is learnt from a few logs errs, and too small a variance is what alarms for nothing.
    found *= 1.0 + CAUTION * np.sqrt(3.0 * pairs) / weight
    return np.asarray(np.maximum(found, LEAST_VARIATION**2))


def taken_in(
    state: DriftState, change: Array, covariance: Array, judged: BoolArray, smoothing: float,
    varied: Array,
) -> DriftState:  # fmt: skip
    """The state after a log.

    change (d,), covariance (d, d): the log's change and its own error, without the model's; judged
    (d,): which of them count; varied (d,): variance from log to log.
    """
    gain = np.where(judged, smoothing, 0.0)
    keep = 1.0 - gain
    noise = np.where(np.outer(judged, judged), covariance + np.diag(varied), 0.0)
    spread = np.outer(keep, keep) * np.array(state.covariance) + np.outer(gain, gain) * noise
    mean = keep * np.array(state.mean) + gain * np.where(judged, change, 0.0)
    weight = keep * np.array(state.weight) + gain
    own = np.diag(covariance)
    last, last_variance = list(state.last), list(state.last_variance)
    squares, pairs = list(state.squares), list(state.pairs)
    for i in np.flatnonzero(judged):
        before = last[i]
        if before is not None:
            half = 0.5 * (float(change[i]) - before) ** 2
            squares[i] += max(half - 0.5 * (float(own[i]) + last_variance[i]), 0.0)
            pairs[i] += 1
        last[i], last_variance[i] = float(change[i]), float(own[i])
    return DriftState(
        state.model, state.names, tuple(mean.tolist()), tuple(weight.tolist()),
        tuple(map(tuple, spread.tolist())), tuple(last), tuple(last_variance), tuple(squares),
        tuple(pairs), state.logs + 1,
    )  # fmt: skip


def mean_change(state: DriftState, model: Array, margin: float) -> Change:
    """The mean change, as far as logs have tested it; model (d, d): covariance of the active
    model's own error, which does not average out.

    While few logs have been seen only a part of the weight is reached: change and error are those
    of the part.
    """
    at = np.flatnonzero(state.weight)
    w, grid = np.array(state.weight)[at], np.ix_(at, at)
    covariance = np.array(state.covariance)[grid] / np.outer(w, w) + model[grid]
    names = tuple(state.names[i] for i in at)
    return Change(names, np.array(state.mean)[at] / w, covariance, margin)
