"""What a fit leaves that is small, but drifts: the mark of a bad sample that no one sees.

A command that was logged wrong for one sample may move a motor by less than the sensor's noise, but
for seconds. Sums over stretches show it where no single sample does. Such a part may be all of one
place and has moved the parameters by what their own deviations times its size allow.
"""

from collections.abc import Sequence

import numpy as np

from identification.arrays import Array
from identification.thresholds import BEYOND_CHANCE

SUMMED = (50, 125, 250, 500)  # samples in a sum
LEAST_SUMS = 6  # sums of a stretch
INTERVAL_HALF = 1.96  # deviations in half of an interval


def drift_size(residuals: Sequence[Array]) -> float:
    """Size of the slow part of residuals (n,), in deviations of white noise; 0 where there is none.

    The largest over a few lengths of stretch: root of what the squares of their sums have beyond
    those of noise. Ours.
    """
    largest, size = BEYOND_CHANCE, 0.0
    for length in SUMMED:
        sums = [_sums(r, length) for r in residuals if len(r) >= LEAST_SUMS * length]
        if not sums:
            continue
        square = np.concatenate(sums) ** 2
        sure = float(np.mean(square) - 1.0) / float(np.sqrt(2.0 / len(square)))
        if sure > largest:
            largest, size = sure, float(np.sqrt(np.sum(square - 1.0)))
    return size


def _sums(r: Array, length: int) -> Array:
    """Sums of residuals over stretches of so many samples, of unit variance for white noise."""
    count = len(r) // length
    spread = max(float(np.std(r)), 1e-300)
    whole = r[: count * length].reshape(count, length).sum(axis=1)
    return np.asarray(whole / (spread * np.sqrt(length)))


def widening(size: float) -> float:
    """By how much deviations are wider for a part of this size, which may have moved parameters.

    Ours: `README.md`, (7).
    """
    return float(np.hypot(1.0, size / INTERVAL_HALF))
