"""Samples that no body can have moved to: spikes, lasting jumps, and counters that wrap.

A position is distinguished from a sensor's fault by mechanics. Between two samples the step of a
body changes by at most acceleration times h squared, so a step that differs by more than that from
both its neighbours is none of the body's. An impact changes the step once and stays on one side;
noise and an encoder's counts do it all along the log, and so are part of its own level.

The factors were chosen on rough machines, the measured sets and the shipped recipes, and tested on
others: see benchmarks/sound_logs.py.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.arrays import Array
from identification.log import Log

Mask = NDArray[np.bool_]

LONGEST_SPIKE = 3
"""Samples in a row that a spike may last; what lasts longer is a jump."""

# Acceleration that a lasting jump needs at least, before it and after it: 10 g, or 1e4 rad/s^2.
# Quicker drives exist, but no log shows one go from rest to rest between two samples and nothing
# slower. What comes back at once, or leaps against its motion, needs a tenth of it to be a fault:
# smaller spikes are in the measured sets (a laser on a rod, 0.3 mm), and do no harm.
_FASTEST = {False: 100.0, True: 1e4}
_RETURNS = 0.1
# A jump stands out from the next largest change of step by this factor: in sound logs that need
# more than the acceleration above, as those in a wrong unit, changes of all sizes stand together.
_GAP = 5.0
_FASTER = 3.0  # times the largest step elsewhere
# Times a quantile of the second difference: 24 standard deviations of white noise. For spikes and
# wraps low ones, which 5 % of them do not change; for jumps what quick machines logged slowly need.
_SPIKES, _WRAPS, _JUMPS = (0.8, 8.0), (0.9, 6.0), (0.95, 5.0)
_COUNTS = 5.0  # times the smallest step: an encoder flickers by one count, seldom by two
_QUIET = 0.2  # of a spike: largest step and way around it, and difference of the levels beside it
_AROUND = 5  # samples to either side
_OTHERS = 2  # steps around a spike that may belong to another one
_MOST = 0.05  # share of samples at which jumps are looked for
_FORCE_RANGE = 3.0  # times the range of the rest, above which an isolated force is no force
_DRIVES = 10.0  # times the noise of a force, its range where it is no train of pulses
_FOLLOWS = 3.0  # times the log's median change of speed, above which a force drove the body


@dataclass(frozen=True)
class Jumps:
    """Steps that no body makes: sample before each, `at` (k,), its size (k,), and whether the
    position leaps over half its range against its own motion, as a counter that wraps does."""

    at: NDArray[np.intp]
    size: Array
    wraps: bool

    def undone(self, y: Array) -> Array:
        """The position without them, (n,)."""
        made = np.zeros(len(y))
        made[self.at + 1] = self.size
        return np.asarray(y - np.cumsum(made))


def spikes(log: Log, name: str, rotary: bool = False) -> Mask:
    """Where `y`, or a force or pressure, leaves the log for 1 to 3 samples and comes back, (n,)."""
    x = log[name]
    inside = np.zeros(len(x), dtype=bool)
    if len(x) < 2 * _AROUND + LONGEST_SPIKE + 2 or not np.all(np.isfinite(x)):
        return inside
    if name == "y":
        least = _least(x, _RETURNS * _FASTEST[rotary] * log.h**2, *_SPIKES)
    else:
        low, high = np.quantile(x, [0.005, 0.995])
        if name == "F" and high - low < _DRIVES * np.quantile(np.abs(np.diff(x, 2)), _SPIKES[0]):
            return inside
        least = max(_FORCE_RANGE * float(high - low), _least(x, 0.0, *_SPIKES))
    step = _steps(log["t"], x, log.h)
    for length in range(1, LONGEST_SPIKE + 1):
        for first in _returning(x, step, length, least):
            inside[first : first + length] = True
    if name != "y" and np.any(inside) and "y" in log and _followed(inside, log["y"]):
        return np.zeros_like(inside)
    return inside


def jumps(log: Log, rotary: bool = False) -> Jumps | None:
    """Steps of the position that no body makes, first those that wrap; None without any."""
    y = log["y"]
    step = _steps(log["t"], y, log.h)
    fastest = _FASTEST[rotary] * log.h**2
    at = _outlying(y, step, _least(y, _RETURNS * fastest, *_WRAPS))
    size = step[at]
    wraps = (np.abs(size) > 0.5 * np.ptp(y)) & (size * _motion(step, at) < 0.0)
    if np.any(wraps):
        return Jumps(at[wraps], size[wraps], True)
    at = _outlying(y, step, _least(y, fastest, *_JUMPS))
    return Jumps(at, step[at], False) if at.size else None


def _steps(t: Array, x: Array, h: float) -> Array:
    """Steps of x (n - 1,), over a gap of the clock as much as falls on one period of it."""
    return np.asarray(np.diff(x) * np.minimum(1.0, h / np.diff(t)))


def _least(x: Array, moved: float, level: float, above: float) -> float:
    """The change of step that the body (`moved`), noise and the encoder's counts allow."""
    step = np.abs(np.diff(x))
    count = float(np.min(step[step > 0.0], initial=np.inf)) if np.any(step > 0.0) else 0.0
    noise = float(np.quantile(np.abs(np.diff(x, 2)), level))
    return max(moved, above * noise, _COUNTS * count)


def _changes(step: Array) -> Array:
    """By how much each step differs from both its neighbours to the same side, else 0; (n - 1,)."""
    bend = np.diff(step)
    before, after = np.concatenate(([step[0] - step[1]], bend)), np.concatenate((-bend, bend[-1:]))
    del bend
    other = before * after <= 0.0
    change: Array = np.minimum(np.abs(before, out=before), np.abs(after, out=after), out=before)
    change[other] = 0.0
    return change


def _returning(x: Array, step: Array, length: int, least: float) -> NDArray[np.intp]:
    """First samples of excursions of this length that begin and end on one level, quiet around."""
    count = len(x) - length - 1
    before, after = x[:count], x[length + 1 :]
    side, height = np.zeros(count, dtype=np.int8), np.full(count, np.inf)
    for j in range(1, length + 1):  # one at a time: a long log's signals are large
        away = x[j : j + count] - before - (after - before) * j / (length + 1)
        side += np.sign(away).astype(np.int8)
        height = np.minimum(height, np.abs(away))
    # Where none is high enough, as in most logs, the motion around need not be known.
    high = (np.abs(side) == length) & (height > least)
    if not np.any(high):
        return np.flatnonzero(high)
    even = (length + 1) * _even(step)[:count]
    found = np.flatnonzero(high & (np.abs(after - before - even) < _QUIET * height)) + 1
    quiet = [_around(step, int(i), length) < _QUIET * height[i - 1] for i in found]
    return found[np.array(quiet, dtype=bool)] if found.size else found


def _even(step: Array) -> Array:
    """The median step around each, which is that of even motion, (n - 1,)."""
    from scipy.ndimage import median_filter

    return np.asarray(median_filter(step, 2 * _AROUND + 1, mode="nearest"))


def _around(step: Array, first: int, length: int) -> float:
    """Largest step near a spike, but for two steps of another one, and way, beyond even motion.

    Another spike comes back; a step that stays, as before an impact, does not. Infinite too near
    to an end of the log for a judgement.
    """
    before, after = step[max(first - 1 - _AROUND, 0) : first - 1], step[first + length :][:_AROUND]
    if len(before) < _AROUND or len(after) < _AROUND:
        return np.inf
    even = np.median(np.concatenate((before, after)))
    each = np.sort(np.abs(np.concatenate((before, after)) - even))[-1 - _OTHERS]
    ways = [abs(float(np.sum(side - np.median(side)))) for side in (before, after)]
    return max(float(each), *ways)


def _outlying(y: Array, step: Array, least: float) -> NDArray[np.intp]:
    """Steps that stand out of the log by the change of step and by their size, in order."""
    change = _changes(step)
    order = np.argsort(-change)[: max(6, int(_MOST * len(y))) + 1]
    sizes = change[order]
    floor = np.maximum(sizes[1:], least / _GAP)
    ratio = np.where(sizes[:-1] > least, sizes[:-1] / np.maximum(floor, 1e-300), 0.0)
    count = int(np.argmax(ratio)) + 1
    found = order[:count]
    if ratio[count - 1] < _GAP:
        return found[:0]
    rest = np.ones(len(step), dtype=bool)
    for shift in (-1, 0, 1):
        rest[np.clip(found + shift, 0, len(step) - 1)] = False
    fast = np.abs(step[found]) > _FASTER * np.max(np.abs(step[rest]), initial=0.0)
    return np.sort(found[fast])


def _motion(step: Array, at: NDArray[np.intp]) -> Array:
    """The way that the position goes around each of these steps (k,)."""
    return np.array(
        [step[max(i - _AROUND, 0) : i].sum() + step[i + 1 :][:_AROUND].sum() for i in at]
    )


def _followed(inside: Mask, y: Array) -> bool:
    """Whether the body's speed changed more at these samples than elsewhere: a force that drove it.

    The change is that of the way over `2 * _AROUND` samples before and after.
    """
    far = 2 * _AROUND
    change = np.abs(y[2 * far :] - 2.0 * y[far:-far] + y[: -2 * far])
    at = inside[far:-far]
    if not np.any(at) or np.all(at):
        return True
    return bool(np.median(change[at]) > _FOLLOWS * np.median(change[~at]))
