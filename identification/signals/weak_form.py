"""Equations of motion in weak form: weighted means over short windows, no differentiated noise.

Multiplied by a test function phi that vanishes with its derivatives at the ends of its window,
and integrated by parts, m y'' becomes m int phi'' y, F_v y' becomes -F_v int phi' y: the sensors'
noise enters linearly and its variance in every row is known. Test functions are (1 - x^2)^5; the
plain sum over samples integrates them almost exactly. Source: modulating functions, Shinbrot
1957; weak-form regression, Messenger and Bortz, SIAM MMS 19 (2021) 1474.
"""

import itertools
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.polynomial import polynomial as poly
from scipy import sparse

from identification.arrays import Array, IntArray

POWER = 5
HOP = 0.25  # of a window, between the starts of two


@dataclass(frozen=True, eq=False)
class WeakWindows:
    """Rows over one log as operators (rows, n): weighted mean of a signal, of its first and second
    derivative, of a signal constant over each period and of one that is straight in between;
    `start` (rows,) and `length` in samples."""

    mean: sparse.csr_array
    first: sparse.csr_array
    second: sparse.csr_array
    zoh: sparse.csr_array
    kinked: sparse.csr_array
    start: IntArray
    length: int

    @property
    def middle(self) -> IntArray:
        """Sample in the middle of each window."""
        return self.start + self.length // 2

    def every(self, k: int) -> "WeakWindows":
        """Each k-th window."""
        return self.at(np.arange(0, len(self.start), k))

    def at(self, index: IntArray) -> "WeakWindows":
        """The windows of these numbers (k,)."""
        return WeakWindows(
            self.mean[index], self.first[index], self.second[index], self.zoh[index],
            self.kinked[index], self.start[index], self.length,
        )  # fmt: skip


@lru_cache
def weights(length: int, h: float) -> tuple[Array, Array, Array, Array, Array]:
    """Weights (length + 1,) of mean, first and second derivative, of a zero-order-hold and a kinked
    signal."""
    bump = poly.polypow([1.0, 0.0, -1.0], POWER)
    x = np.linspace(-1.0, 1.0, length + 1)
    scale = 0.5 * length * h  # x = t/scale
    area = float(poly.polyval(1.0, poly.polyint(bump)) - poly.polyval(-1.0, poly.polyint(bump)))
    mean = poly.polyval(x, bump) * (h / scale) / area
    first = -poly.polyval(x, poly.polyder(bump)) * (h / scale**2) / area
    second = poly.polyval(x, poly.polyder(bump, 2)) * (h / scale**3) / area
    # The sums hold exactly for parabolas: a leak of y itself would pass for a spring.
    t = x * scale
    mean = mean / np.sum(mean)
    first = first + mean * t * ((1.0 - np.sum(first * t)) / np.sum(mean * t * t))
    even = np.array(
        [[np.sum(mean), np.sum(mean * t**2)], [np.sum(mean * t**2), np.sum(mean * t**4)]]
    )
    short = np.array([-np.sum(second), 2.0 - np.sum(second * t**2)])
    a, b = np.linalg.solve(even, short)
    second = second + mean * (a + b * t**2)
    whole = poly.polyval(x, poly.polyint(bump)) / area
    # Between samples a kinked signal is a straight line: the mean of phi times each hat function.
    twice = poly.polyval(x, poly.polyint(bump, 2)) / area / (x[1] - x[0])
    kinked = np.zeros(length + 1)
    kinked[1:-1] = twice[2:] - 2.0 * twice[1:-1] + twice[:-2]
    kinked[0] = twice[1] - twice[0] - whole[0]
    kinked[-1] = whole[-1] - (twice[-1] - twice[-2])
    return mean, first, second, np.append(np.diff(whole), 0.0), kinked


def windows(starts: IntArray, length: int, n: int, h: float) -> WeakWindows:
    """Operators of windows of `length` samples that begin at `starts`, on a log of n samples."""
    r = len(starts)
    column = (starts[:, np.newaxis] + np.arange(length + 1)).ravel()
    row = np.arange(0, (r + 1) * (length + 1), length + 1)
    made = (
        sparse.csr_array((np.tile(w, r), column, row), shape=(r, n)) for w in weights(length, h)
    )
    mean, first, second, zoh, kinked = made
    return WeakWindows(mean, first, second, zoh, kinked, starts, length)


def all_windows(n: int, length: int, h: float) -> WeakWindows:
    """Windows over the whole log, overlapping."""
    step = max(1, round(HOP * length))
    return windows(np.arange(0, n - length, step, dtype=np.int64), length, n, h)


def sliding_windows(direction: Array, length: int, h: float) -> WeakWindows:
    """Windows inside stretches in which `direction` (n,), +1, -1 or 0, is the same and not 0."""
    step = max(1, round(HOP * length))
    cuts = np.flatnonzero(np.diff(direction)) + 1
    borders = np.concatenate([[0], cuts, [len(direction)]])
    starts = [
        np.arange(low, high - length, step)
        for low, high in itertools.pairwise(borders)
        if direction[low] != 0 and high - low > length
    ]
    joined = np.concatenate(starts) if starts else np.zeros(0)
    return windows(joined.astype(np.int64), length, len(direction), h)


def noise_gain(w: Array) -> float:
    """Variance of a weighted sum of white noise of unit variance."""
    return float(np.sum(w**2))
