"""Values that stand still while the machine does not: a sensor, counter or logger that hangs."""

import numpy as np
from numpy.typing import NDArray

from identification.arrays import Array
from identification.signals.differentiate import resolution
from identification.signals.steps import block_noise
from identification.thresholds import MANY_OF_A_KIND

REPEATS_ELSEWHERE = 1e-3  # share of repeats outside such stretches, below which they are a fault
MOST_FROZEN = 0.05  # share of a log that may be frozen; more is the sensor's own way
LIKE_NOISE = 0.5  # share of samples at which the second difference of noise changes its sign
COUNTS_MISSED = 5  # that a counter has to catch up with
WAYS_ALIKE = (
    0.3  # relative difference of the way caught up and the way that the speeds around it give
)
LONGEST_OFF = 50  # samples for which a logger may drop out
DROP_LEAPS = 5.0  # times the median step, that a value that drops out leaps
STEADY_SPEED = 1.5  # ratio of the speeds before and after
SLOW_BLOCK = 24  # samples that give a signal's noise at their speed
CLOCK_SHARE = 0.1  # of a sample, by which a clock may jitter
ROUNDING_SHOWS = (
    1.4  # counts of noise, more than rounding makes: third differences of 4 at most are 1.33
)
INFORMATIVE_PART = 0.05  # of these blocks, that have to show the noise
SPEED_AROUND = 8  # samples to either side, whose speed is looked at


def noise_shows(x: Array, still: NDArray[np.bool_]) -> bool:
    """Whether a body at rest would not be shown by one value: a sensor's noise exceeds its count.

    still (n,): samples that repeat one value for long, which have no information on the noise. Nor
    does quick motion, where a jittering clock makes noise that is none at rest.
    """
    moves = np.asarray(x, dtype=np.float64)[~still]
    noise = block_noise(moves, SLOW_BLOCK)
    if not len(noise):
        return False
    ends = moves[: (len(noise) + 1) * SLOW_BLOCK : SLOW_BLOCK]
    step = np.abs(np.diff(ends, append=moves[-1])[: len(noise)]) / SLOW_BLOCK
    shown = noise > np.maximum(ROUNDING_SHOWS * resolution(x), CLOCK_SHARE * step)
    return float(np.mean(shown)) > INFORMATIVE_PART


def frozen(x: Array, *, at_limits: bool = False) -> NDArray[np.bool_]:
    """Where a signal repeats one value for long though it never does elsewhere, (n,).

    at_limits: its largest and smallest value may be repeated (a command's limits). A counter that
    repeats values at rest is frozen where it catches up afterwards with a motion that went on.
    """
    out = np.zeros(len(x), dtype=bool)
    same = np.concatenate([[False], np.diff(x) == 0.0, [False]])
    edges = np.flatnonzero(np.diff(same.astype(np.int8)))
    low, high = edges[0::2], edges[1::2] + 1  # samples low to high - 1 are equal
    long = high - low >= MANY_OF_A_KIND
    if not np.any(long):
        return out
    noisy = _repeats_nothing_else(x, within(low[long], high[long], len(x)))
    for a, b in zip(low[long].tolist(), high[long].tolist(), strict=True):
        if at_limits and x[a] in (x.min(), x.max()):
            continue
        off = at_limits and x[a] == 0.0  # a command may be switched off, but not for a moment
        if (noisy and (not off or _dropped(x, a, b))) or _caught_up(x, a, b):
            out[a:b] = True
    return out if out.mean() <= MOST_FROZEN else np.zeros_like(out)


def clipped(x: Array) -> NDArray[np.bool_]:
    """Where a sensor stands at an end of its range, (n,): it repeats its largest or its smallest
    value, and no other, though its noise shows."""
    end = (x == x.min()) | (x == x.max())
    few = np.count_nonzero(end[1:] & (np.diff(x) == 0.0)) < MANY_OF_A_KIND
    return np.zeros_like(end) if few or not _repeats_nothing_else(x, end) else end


def _repeats_nothing_else(x: Array, still: NDArray[np.bool_]) -> bool:
    """Whether a signal's noise shows, and it repeats next to no value but in these samples."""
    repeats = int(np.count_nonzero((np.diff(x) == 0.0) & ~(still[1:] & still[:-1])))
    bend = np.diff(x, 2)
    bend = bend[bend != 0.0]
    return (
        repeats <= REPEATS_ELSEWHERE * len(x)
        and len(bend) > len(x) // 2
        and float(np.mean(bend[1:] * bend[:-1] < 0.0)) > LIKE_NOISE
        and noise_shows(x, still)
    )


def within(low: NDArray[np.intp], high: NDArray[np.intp], n: int) -> NDArray[np.bool_]:
    """Samples (n,) of these stretches, `low` to `high` - 1 each."""
    at = np.zeros(n + 1, dtype=np.int64)
    np.add.at(at, low, 1)
    np.add.at(at, high, -1)
    return np.asarray(np.cumsum(at)[:n] > 0)


def _dropped(x: Array, low: int, high: int) -> bool:
    """Whether a command leaps to the value of samples low to high - 1, and soon back again."""
    if low == 0 or high >= len(x) or high - low > LONGEST_OFF:
        return False
    usual = DROP_LEAPS * float(np.median(np.abs(np.diff(x))))
    return bool(abs(x[low] - x[low - 1]) > usual and abs(x[high] - x[high - 1]) > usual)


def _caught_up(x: Array, low: int, high: int) -> bool:
    """Whether a counter that stood at samples low to high - 1 leaps by the way it has missed."""
    if low < SPEED_AROUND or high + SPEED_AROUND >= len(x):
        return False
    before = float(x[low] - x[low - SPEED_AROUND]) / SPEED_AROUND
    after = float(x[high + SPEED_AROUND] - x[high]) / SPEED_AROUND
    leap = float(x[high] - x[high - 1])
    missed = 0.5 * (before + after) * (high - low)
    steps = np.diff(
        np.concatenate([x[low - SPEED_AROUND : low + 1], x[high : high + SPEED_AROUND + 1]])
    )
    steps = np.abs(np.delete(steps, SPEED_AROUND))
    count = float(np.min(steps[steps > 0.0], initial=np.inf))
    return (
        bool(np.all(steps > 0.0))
        and before * after > 0.0
        and max(before / after, after / before) < STEADY_SPEED
        and abs(leap) > COUNTS_MISSED * count
        and abs(leap) > 4.0 * max(abs(before), abs(after))
        and abs(leap - missed) < WAYS_ALIKE * abs(missed)
    )
