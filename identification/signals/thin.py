"""Logs brought to a fit's needs: a slower clock by means, of very long ones the liveliest part.

A fit gains nothing from a rate at which the body hardly moves between two samples, nor from the
tenth quarter of an hour. Logs of usual size and rate are passed on as they are, bit for bit.
"""

from typing import NamedTuple

import numpy as np
from scipy.interpolate import make_interp_spline

from identification.arrays import Array
from identification.log import Log
from identification.remarks import MinorRemark
from identification.signals.differentiate import resolution

LONGEST_UNTHINNED = 200_000
"""Samples up to which a log is taken as it is."""

LONGEST_THINNED = 100_000
"""Samples that are kept of a longer one, at most: a search over them takes about a minute."""

SLOWEST_CLOCK = 1e-3
"""Sampling period [s] up to which a longer log is averaged; switches of mode need that much."""

FAST_CLOCK = 0.75e-3
"""Sampling period [s] below which a log may have more samples than its motion needs."""

SLOW_ENOUGH = 1e-3
"""Sampling period [s] to which such a log is brought at most."""

LEAST_TAKEN = 400
"""Samples that are left of it at least."""

MORE_THAN_NOISE = 1.1
"""Square in units of the noise's, from which more than noise lies between the samples taken."""

ON_HOLD = "u"


class Thinned(NamedTuple):
    """A log of at most `LONGEST_UNTHINNED` samples, and what was left out of it."""

    log: Log
    remarks: tuple[str, ...]


def thinned(log: Log) -> Thinned:
    """The log; a longer one than `LONGEST_UNTHINNED` at a slower clock, cut to its liveliest part.

    What a sample then is: `_slower`.
    """
    if len(log) <= LONGEST_UNTHINNED:
        return Thinned(log, ())
    remarks, step = list[str](), _step(log)
    if step > 1:
        remarks.append(
            MinorRemark(
                f"{log.name}: {len(log)} samples every {log.h:.4g} s, taken every"
                f" {step * log.h:.4g} s"
            )
        )
        log = _slower(log, step)
    if len(log) > LONGEST_THINNED:
        start = _liveliest(log["y"])
        # Copies: a view would hold the whole log in memory.
        part = Log(
            log.name, {k: v[start : start + LONGEST_THINNED].copy() for k, v in log.signals.items()}
        )
        t = part["t"]
        remarks.append(
            f"{log.name}: of its {log.duration:.5g} s the {part.duration:.4g} s from"
            f" t = {t[0]:.6g} s were used, where the body moves most; cut the log to choose"
            " another part"
        )
        log = part
    return Thinned(log, tuple(remarks))


def _step(log: Log) -> int:
    """Samples in a mean: enough for `LONGEST_THINNED` means, none slower than `SLOWEST_CLOCK`."""
    return min(int(1.01 * SLOWEST_CLOCK / log.h), -(-len(log) // LONGEST_THINNED))


def _liveliest(y: Array) -> int:
    """First of the `LONGEST_THINNED` samples in which the position goes the longest way.

    The way is taken over means, so that noise hardly counts.
    """
    block = 100
    count = len(y) // block
    means = y[: count * block].reshape(count, block).mean(axis=1)
    way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(means)))])
    span = LONGEST_THINNED // block
    return int(np.argmax(way[span - 1 :] - way[: count - span + 1])) * block


def at_needed_rate(log: Log) -> Log:
    """The log of a measured force at the slowest clock that leaves nothing but noise out.

    Logs of a usual rate are passed on as they are.
    """
    if log.h >= FAST_CLOCK:
        return log
    for step in range(int(1.001 * SLOW_ENOUGH / log.h), 1, -1):
        if len(log) < LEAST_TAKEN * step:
            continue
        slower = _slower(log, step)
        if all(_shows(log, slower, key) for key in ("y", "F")):
            return slower
    return log


def _slower(log: Log, step: int) -> Log:
    """Every `step`-th instant of the log, its values means over the new period around it.

    The mean of a body's places is not its place where it is thrown, which a fit to the noise would
    take for an effect: means are freed of what the curvature adds. The command, which is held
    between samples, is the mean until the next instant, a switch what it is at the instant.
    """
    half, odd = step // 2, step % 2
    weights = np.ones(2 * half + 1) / step
    if not odd:  # the ends are shared with the neighbours
        weights[[0, -1]] *= 0.5
    at = np.arange(half, min(len(log) - half, len(log) - step + 1), step)
    bend = float(weights @ np.arange(-half, half + 1) ** 2.0) / (2.0 * step**2)
    signals = {}
    for key, x in log.signals.items():
        if key == "t" or np.all((x == x.min()) | (x == x.max())):
            signals[key] = x[at]
        elif key == ON_HOLD:
            whole = np.concatenate([[0.0], np.cumsum(x - x[0])])
            signals[key] = x[0] + (whole[at + step] - whole[at]) / step
        else:
            mean = np.convolve(x, weights, "valid")[at - half]
            second = np.zeros(len(mean))
            second[1:-1] = np.diff(mean, 2)
            signals[key] = mean - bend * second
    return Log(log.name, signals)


def _shows(log: Log, slower: Log, key: str) -> bool:
    """Whether a signal of the slower log shows what the log has of it, but for noise.

    In third differences is hardly more than noise, of a jittering clock too, which comes and goes
    with speed.
    """
    inner = (log["t"] >= slower["t"][0]) & (log["t"] <= slower["t"][-1])
    x, t = log[key][inner], log["t"][inner]
    rest = x - make_interp_spline(slower["t"], slower[key], 3)(t)
    noise = max(float(np.mean(np.diff(x, 3) ** 2)) / 20.0, resolution(x) ** 2 / 12.0)
    return float(np.mean(rest**2)) <= MORE_THAN_NOISE * noise
