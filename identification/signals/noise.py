"""White noise of a signal, separated from what it measures."""

import numpy as np

from identification.arrays import Array, BoolArray

PATTERNS = 8  # of known rows, by which the error at lost ones is estimated
QUIET = 0.2  # share of a log in which a signal is taken to be free of fast content


def local_noise(x: Array) -> float:
    """White noise of a signal (one sigma) from the quiet part of it; a fast input does not count.

    Third differences in short stretches: motion and input raise most of them, noise is in all.
    """
    return quiet_part(np.diff(np.asarray(x, dtype=np.float64), 3))


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
