"""Mass and sliding friction from the weak form of the force equation, on stretches that slide.

Multiplied by a test function and integrated by parts, m y'' + F_c + F_v y' = F is linear in the
five with no noise differentiated; long windows hold most, short ones are found in logs with many
stops. The window is chosen by the deviation that it gives.
"""

from dataclasses import dataclass

import numpy as np

from identification.arrays import Array
from identification.estimation.regression.three_step import FASTEST_QUANTILE, FirstEstimate
from identification.log import Log
from identification.signals.weak_form import HOP, sliding_windows

LENGTHS = (10, 20, 40, 80, 160)  # samples of a window
LEAST_WINDOWS = 8  # windows that a direction needs
ROBUST_ROUNDS = 10
OUTLIER_FROM = 2.0  # robust deviations from which a window counts less


@dataclass(frozen=True)
class Sliding:
    """m, F_cp, F_cn, F_vp, F_vn (5,) with standard deviations, infinite where nothing slides."""

    five: Array
    sd: Array


def fit_sliding(log: Log, first: FirstEstimate, share: float, *, held: bool) -> Sliding | None:
    """The five from samples faster than `share` of the largest speed; None where none slide.

    held: the force is a zero-order hold of a command. The band's edge is not known here: a body
    within it does not follow the equation, so windows that do not fit count less. Sources: weak
    form, Messenger, Bortz (2021); Cauchy's weights, Holland, Welsch (1977).
    """
    v = first.motion.v
    threshold = share * float(np.quantile(np.abs(v), FASTEST_QUANTILE))
    direction = np.where(v > threshold, 1.0, np.where(v < -threshold, -1.0, 0.0))
    found = [_fit(log, direction, length, held) for length in LENGTHS if length < len(log) // 4]
    sound = [one for one in found if one is not None]
    return min(sound, key=_doubt) if sound else None


def _doubt(one: Sliding) -> float:
    """Mean relative deviation, a parameter not identified counting as much as itself."""
    return float(np.mean(np.minimum(one.sd / np.maximum(np.abs(one.five), 1e-300), 1.0)))


def _fit(log: Log, direction: Array, length: int, held: bool) -> Sliding | None:
    """Robust least squares over windows of `length` samples."""
    w = sliding_windows(direction, length, log.h)
    sign = direction[w.middle]
    up, down = sign > 0, sign < 0
    enough = [np.count_nonzero(side) >= LEAST_WINDOWS for side in (up, down)]
    if not any(enough):
        return None
    v = w.first @ log["y"]
    columns = np.column_stack([w.second @ log["y"], up, -1.0 * down, v * up, v * down])
    force = (w.held if held else w.mean) @ log["F"]
    used = np.array([True, enough[0], enough[1], enough[0], enough[1]])
    rows = (up & enough[0]) | (down & enough[1])
    columns, force = columns[rows][:, used], force[rows]
    size = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    weight = np.ones(len(force))
    for _ in range(ROBUST_ROUNDS):
        theta = np.linalg.lstsq(columns / size * weight[:, None], force * weight)[0] / size
        residual = force - columns @ theta
        scale = 1.4826 * float(np.median(np.abs(residual)))
        weight = 1.0 / np.sqrt(1.0 + (residual / max(OUTLIER_FROM * scale, 1e-300)) ** 2)
    scaled = columns / size * weight[:, None]
    inverse = np.linalg.pinv(scaled.T @ scaled)
    # Overlapping windows are not independent.
    deviation = scale / np.sqrt(HOP) * np.sqrt(np.diag(inverse)) / size
    five, sd = np.zeros(5), np.full(5, np.inf)
    five[used], sd[used] = theta, deviation
    return Sliding(five, sd)
