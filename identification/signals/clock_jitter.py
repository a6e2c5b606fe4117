"""How far a logger's clock jitters: the position's noise then grows with speed.

A sample that was taken by tau beside its time shows a body at speed v by v tau beside its place.
Fifth differences leave hardly anything of the motion, but all of the noise; its square over that of
the speed is a line: the sensor's at rest, and tau's as its slope.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from identification.arrays import Array
from identification.signals.differentiate import resolution
from identification.thresholds import HALF

DIFFERENCES, OF_WHITE = (
    5,
    252.0,
)  # of the differences, and the square that they make of white noise of 1
STRETCH, GROUPS = 25, 8  # samples whose noise is one value, and groups of these by speed
QUICK_GROUP = 2  # groups from the fastest, whose speed decides whether the jitter matters
WEIGHINGS = 4  # in which the weights of the line converge
LEAST_OF_SQUARE = 0.05  # of a group's square, as which the line counts there at least
OF_HALF_A_COUNT = 64.0 / 21.0  # of white noise, what counting leaves at half a count a sample
BY_CLOCK = 0.95  # share of the samples off their place, which the clock is to explain


class PositionNoise(NamedTuple):
    """One sigma of a position at rest [m], and of the instants of its samples [s]."""

    at_rest: float
    jitter: float


def position_noise(y: Array, v: Array) -> PositionNoise | None:
    """Noise of a position y (n,) [m] at speeds v (n,) [m/s]; None where no jitter shows."""
    y = np.asarray(y, dtype=np.float64)
    fifth = np.diff(y, DIFFERENCES)
    count = len(fifth) // STRETCH
    if count < 4 * GROUPS:
        return None
    whole = slice(DIFFERENCES // 2, DIFFERENCES // 2 + count * STRETCH)
    power = np.mean(fifth[: count * STRETCH].reshape(count, STRETCH) ** 2, axis=1) / OF_WHITE
    speed = np.mean(np.asarray(v)[whole].reshape(count, STRETCH) ** 2, axis=1)
    groups = np.array_split(np.argsort(speed), GROUPS)
    x = np.array([np.mean(speed[one]) for one in groups])
    # An encoder's counts are as coarse in slow motion, where they seldom change; slower than one a
    # sample they are no white noise.
    of_count = resolution(y)
    each = np.diff(y[: count * STRETCH + 1 : STRETCH]) / STRETCH
    slow = np.array([np.mean(each[one] ** 2) < of_count**2 for one in groups])
    least = np.where(slow, OF_HALF_A_COUNT, 1.0) * of_count**2 / 12.0
    z = np.maximum([np.median(power[one]) for one in groups], least)
    if not np.all(z > 0.0):
        return None
    X, line = np.column_stack([np.ones(GROUPS), x / max(float(x[-1]), 1e-300)]), z
    for _ in range(WEIGHINGS):
        weight = 1.0 / np.maximum(line, LEAST_OF_SQUARE * z)
        rest, slope = np.linalg.lstsq(X * weight[:, np.newaxis], z * weight, rcond=None)[0]
        line = X @ np.array([rest, slope])
    rest = max(float(rest), LEAST_OF_SQUARE * float(z[0]))
    jitter = float(np.sqrt(max(slope, 0.0) / max(float(x[-1]), 1e-300)))
    found = PositionNoise(float(np.sqrt(rest)), jitter)
    return found if jitters(jitter * float(np.sqrt(x[-QUICK_GROUP])) / found.at_rest) else None


def beside_their_time(t: Array, y: Array, off: NDArray[np.bool_]) -> str | None:
    """What is said of samples of a position off their place, where these are as small as the way of
    the body in half a period: the clock jitters, the sensor is sound. None where they are not.

    t [s], y and off: (n,). A sensor's spikes come in slow motion and at rest too.
    """
    place = np.interp(t, t[~off], y[~off])
    way = np.gradient(place)[off]  # of a sample
    beside = np.abs(y - place)[off] / np.maximum(np.abs(way), 1e-300)
    if np.mean(beside < HALF) < BY_CLOCK:
        return None
    late = 1e3 * float(np.median(beside)) * float(np.median(np.diff(t)))
    return (
        f"{off.mean():.1%} of the samples of 'y' are beside their place by what the body moves in"
        f" some {late:.2g} ms: a clock that jitters; kept, as noise"
    )


def jitters(ratio: float) -> bool:
    """Whether a clock's noise in fast motion, over that of the sensor, is to be reckoned with."""
    return ratio > HALF
