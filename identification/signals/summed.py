"""The sum of what a log has the steps of."""

import numpy as np

from identification.arrays import Array, frozen


def summed(x: Array, step: Array | None = None) -> Array:
    """The sum of x (n,) up to each row, from 0 on: of steps, or of a speed by the rule of trapezia
    where `step` (n,) is the time since the row before. What is missing is taken from its
    neighbours; a time that goes back counts as none."""
    known, rows = np.isfinite(x), np.arange(len(x))
    whole = np.interp(rows, rows[known], x[known]) if np.any(known) else x
    if step is not None:
        forward = np.where(np.isfinite(step), np.maximum(step, 0.0), 0.0)
        whole = forward * 0.5 * (whole + np.concatenate([whole[:1], whole[:-1]]))
    return frozen(np.cumsum(whole) - whole[0])
