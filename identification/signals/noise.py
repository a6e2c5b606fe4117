"""White noise of a signal, separated from what it measures."""

import numpy as np

from identification.arrays import Array, BoolArray
from identification.log import Log
from identification.signals.differentiate import resolution

PATTERNS = 8  # of known rows, by which the error at lost ones is estimated
QUIET = 0.2  # share of a log in which a signal is taken to be free of fast content


def local_noise(x: Array) -> float:
    """White noise of a signal (one sigma) from the quiet part of it, at least that of its rounding;
    a fast input does not count.

    Third differences in short stretches: motion and input raise most of them, noise is in all.
    """
    return max(quiet_part(np.diff(np.asarray(x, dtype=np.float64), 3)), rounding(x))


def rounding(x: Array) -> float:
    """Deviation of a signal's rounding to its step, 0 where it has none: where it stands at one
    value, its differences do not show it. Source: Widrow, Kollar, Quantization Noise (2008)."""
    return resolution(x) / float(np.sqrt(12.0))


def rounding_of_force(log: Log) -> float:
    """Deviation [N] that the rounding of what the applied force is made of gives it: of its own
    column, or of both pressures."""
    names = [name for name in ("p_p", "p_n") if name in log]
    if len(names) < 2:
        return rounding(log["F"])
    off = [log[name] - np.mean(log[name]) for name in names]
    areas = np.linalg.lstsq(np.column_stack(off), log["F"] - np.mean(log["F"]), rcond=None)[0]
    return float(
        np.linalg.norm([a * rounding(log[name]) for a, name in zip(areas, names, strict=True)])
    )


def quiet_part(third: Array) -> float:
    """White noise (one sigma) of a signal from its third differences, by their quiet stretches."""
    d3 = third / np.sqrt(20.0)
    size = 25
    count = len(d3) // size
    if count < 4:
        return float(np.sqrt(np.mean(d3**2)))
    power = np.sort(np.mean(d3[: count * size].reshape(count, size) ** 2, axis=1))
    # The mean of the lowest fifth of chi-squares with about 9 independent values.
    return float(np.sqrt(np.mean(power[: max(1, int(QUIET * count))]) / 0.45))


def noise_of_lost_rows(x: Array, lost: BoolArray) -> float:
    """Deviation by which interpolation of lost rows adds to a signal, over all of its rows.

    x, lost: (n,). As the same pattern of rows, moved on, is missed where it is known. Ours.
    """
    square, count = 0.0, 0
    for shift in range(1, PATTERNS + 1):
        also = np.roll(lost, shift) & ~lost
        also[[0, -1]] = False  # beyond the ends nothing is known
        known = ~(lost | also)
        at = np.flatnonzero(also)
        missed = x[at] - np.interp(at, np.flatnonzero(known), x[known])
        square, count = square + float(np.sum(missed**2)), count + len(at)
    return float(np.sqrt(np.mean(lost) * square / count)) if count else 0.0
