"""Medians of a signal along another one."""

import numpy as np

from identification.arrays import Array

GAP = 0.2  # of a signal's range, over which a running median is not drawn


def running_median(x: Array, values: Array, levels: int) -> tuple[Array, Array]:
    """Medians of `values` over equally filled stretches of `x`, at most `levels` of them.

    A NaN in the medians parts them where `x` has a wide gap, across which no line is to be drawn.
    """
    parts = np.array_split(np.argsort(x), min(levels, len(x)))
    at = np.array([np.median(x[p]) for p in parts])
    found = np.array([np.median(values[p]) for p in parts])
    gaps = 1 + np.flatnonzero(np.diff(at) > GAP * max(float(np.ptp(x)), 1e-300))
    return np.insert(at, gaps, (at[gaps - 1] + at[gaps]) / 2), np.insert(found, gaps, np.nan)
