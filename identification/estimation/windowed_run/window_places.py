"""Where the windows of a log begin: at rest, or in calm and fast motion."""

import numpy as np

from identification.arrays import Array, BoolArray, IntArray
from identification.estimation.regression.equation_rows import MotionLog
from identification.estimation.regression.standstill import rest_stretches
from identification.signals.sampling import samples

REST_REACH = 0.45  # of a window, within which a rest is searched
FAST_SHARE = 0.5  # of the usual speed, at which a window begins where there is no rest near
LATER = 2.0  # windows by which a start is put off until there is a rest
LEAST_REST = 24  # samples of 2 ms (as the next two: `sampling.samples`)
CREEPS_FROM = 3.0  # deviations of the velocity from which a body creeps
WIDEST_CREEP = 50  # samples on either side by which a creep is seen


def window_places(one: MotionLog, seconds: float) -> tuple[IntArray, BoolArray]:
    """Samples (k,) at which windows of about so many seconds begin, and whether at rest.

    Source: restarts as in multiple shooting, Bock (1983); where they lie is ours.
    """
    n, rests = len(one.log), _rests(one)
    step = max(2, round(min(seconds / one.log.h, 2.0 * n)))
    speed = np.abs(one.signals["v"]) * (one.signals["d"] != 0)
    fast = FAST_SHARE * float(np.median(speed[speed > 0.0])) if np.any(speed) else 0.0
    at = [0]
    while at[-1] + step < n - step // 2:
        wanted = at[-1] + step
        found = _rest_near(wanted, step, rests)
        at.append(_calm(one, wanted, step, speed, fast) if found is None else found)
    index = np.array(at, dtype=np.int64)
    return index, np.isin(index, rests)


def _rest_near(wanted: int, step: int, rests: IntArray) -> int | None:
    """The rest nearest to `wanted`, or else the next one after it, if it is not far."""
    near = rests[np.abs(rests - wanted) <= int(REST_REACH * step)]
    if len(near):
        return int(near[np.argmin(np.abs(near - wanted))])
    later = rests[(rests > wanted) & (rests <= wanted + LATER * step)]
    return int(later[0]) if len(later) else None


def _calm(one: MotionLog, wanted: int, step: int, speed: Array, enough: float) -> int:
    """Sample near `wanted` in calm motion that is fast enough [m/s], if there is any.

    Near the band a state within its noise may stop or not: what is well known is fast.
    """
    reach, last = max(1, int(REST_REACH * step)), len(one.log) - 1
    span = np.arange(wanted - reach, min(wanted + reach, last))
    if np.max(speed[span]) < enough:
        span = np.arange(wanted - reach, min(wanted + round(LATER * step), last))
    fast = speed[span] >= min(enough, FAST_SHARE * float(np.max(speed[span])))
    return int(span[np.argmin(np.where(fast, np.abs(one.signals["a"][span]), np.inf))])


def _rests(one: MotionLog) -> IntArray:
    """Samples in the middle of every clear rest, and the first where a log begins with one."""
    found = []
    for low, high in rest_stretches(one, samples(LEAST_REST, one.log.h)):
        v, sd = _creep(one, low, high)
        if abs(v) < CREEPS_FROM * sd:
            found += [0, (low + high) // 2] if low == 0 else [(low + high) // 2]
    return np.array(found, dtype=np.int64)


def _creep(one: MotionLog, low: int, high: int) -> tuple[float, float]:
    """Mean velocity and its deviation [m/s] in the middle of samples low to high."""
    middle = (low + high) // 2
    half = min((high - low) // 2, samples(WIDEST_CREEP, one.log.h))
    x = one.log.h * (np.arange(-half, half) + 0.5)
    square = float(x @ x)
    y = np.asarray(one.log["y"])[middle - half : middle + half]
    return float(x @ y) / square, one.noise.y / float(np.sqrt(square))
