"""Drift: the parameters that changed between two logs, the fewest that bring the error down."""

from collections.abc import Sequence

import numpy as np

from identification.arrays import BoolArray
from identification.before_after import seen_by
from identification.choice import Step
from identification.evidence import ACTUATOR, FIVE, MECHANICAL, Moving, Rows, stacked
from identification.left_over import FEWEST_ROWS
from identification.log import Rig
from identification.outcome import Outcome
from identification.plant import units_of
from identification.structure import OVERLAP, Model
from identification.trace_result import Change

DRIFT_GAIN = 30.0  # chi-square that a parameter freed has to gain
DRIFT_SHARE = 0.1  # of the test logs' square error that it has to take away
DRIFT_LEAST = 0.01  # of its value, that it changes at least


def drift(
    after: Model, steps: Sequence[Step], seen: Sequence[Moving], rig: Rig
) -> tuple[Change, ...]:
    """Parameters that differ between training and test logs, fewest that bring the error down."""
    stage = seen_by(after.stage, steps, seen)
    units = units_of(rig.motion)
    out: list[Change] = []
    for equation, names in ((MECHANICAL, FIVE), (ACTUATOR, ("k1", "k2"))):
        if equation in after.outcomes:
            mine = after.outcomes[equation]
            rows = stacked(stage.parts[equation])
            keep = rows.speed >= mine.slowest
            if np.count_nonzero(keep) >= FEWEST_ROWS:
                out += [
                    Change(name, units[name], *change)
                    for name, *change in changes(mine, rows, keep, names)
                ]
    return tuple(out)


def changes(
    mine: Outcome, rows: Rows, keep: BoolArray, names: Sequence[str]
) -> list[tuple[str, float, float, float]]:
    """Name, value before and after, and deviation of the parameters that have changed.

    One is freed at a time, the one that lowers the error most, as long as it lowers it by a
    material share and surely: parameters that a short log cannot tell apart do not all change.
    """
    theta = mine.fit.theta.copy()
    A, b = (rows.X / rows.sd[:, np.newaxis])[keep], (rows.b / rows.sd)[keep]
    r = b - A @ theta
    # What is left of the test logs with every parameter free is noise to a drift too.
    every = b - A @ np.linalg.lstsq(A, b, rcond=1e-10)[0]
    own = float(np.mean(mine.fit.residual[mine.rows.speed >= mine.slowest] ** 2))
    noise = max(own, float(np.mean(every**2)), 1.0)
    free: list[int] = []
    best = theta
    while len(free) < len(names):
        now = float(np.sum((b - A @ best) ** 2))
        options = []
        for i in range(len(names)):
            if i not in free:
                at = [*free, i]
                step = np.linalg.lstsq(A[:, at], r, rcond=1e-8)[0]
                options.append((float(np.sum((r - A[:, at] @ step) ** 2)), i, step))
        left, i, step = min(options, key=lambda x: x[0])
        sure = (now - left) / (noise * OVERLAP)
        if sure < DRIFT_GAIN or now - left < DRIFT_SHARE * now:
            break
        free.append(i)
        best = theta.copy()
        best[free] += step
    if not free:
        return []
    inverse = np.linalg.pinv(A[:, free].T @ A[:, free])
    sd = np.sqrt(np.diag(inverse) * noise * OVERLAP)
    return [
        (names[i], float(theta[i]), float(best[i]), float(s))
        for i, s in zip(free, sd, strict=True)
        if abs(best[i] - theta[i]) > DRIFT_LEAST * abs(theta[i])
    ]
