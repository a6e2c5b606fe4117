"""Very long logs brought to what a fit can use: a slower clock by means, then the liveliest part.

A fit gains nothing from a rate at which the body hardly moves between two samples, nor from the
tenth quarter of an hour. Logs of usual size are passed on as they are, bit for bit.
"""

from typing import NamedTuple

import numpy as np

from identification.arrays import Array
from identification.log import Log

LONGEST_UNTHINNED = 200_000
"""Samples up to which a log is taken as it is."""

LONGEST_THINNED = 100_000
"""Samples that are kept of a longer one, at most: a search over them takes about a minute."""

SLOWEST_CLOCK = 1e-3
"""Sampling period [s] up to which a longer log is averaged; switches of mode need that much."""


class Thinned(NamedTuple):
    """A log of at most `LONGEST_UNTHINNED` samples, and what was left out of it."""

    log: Log
    remarks: tuple[str, ...]


def thinned(log: Log) -> Thinned:
    """The log; a longer one than `LONGEST_UNTHINNED` at a slower clock, cut to its liveliest part.

    A sample is then the mean over the middle third of its new period: over the whole of it the mean
    is not the place of a body that is thrown, which a fit to the noise would take for an effect.
    The command is held between samples, so it is the mean until the next instant.
    """
    if len(log) <= LONGEST_UNTHINNED:
        return Thinned(log, ())
    remarks, step = [], _step(log)
    if step > 1:
        remarks.append(
            f"{log.name}: {len(log)} samples every {log.h:.4g} s, taken every {step * log.h:.4g} s"
        )
        log = _averaged(log, step)
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


def _averaged(log: Log, step: int) -> Log:
    """Every `step`-th instant of the log, its values means around it."""
    middle, half = step // 2, max(0, step // 3 - 1) // 2
    count = (len(log) - middle) // step

    def means(values: Array, first: int, width: int) -> Array:
        blocks: Array = values[first : first + count * step].reshape(count, step)
        return np.asarray(blocks[:, :width].mean(axis=1), dtype=np.float64)

    signals = {}
    for name, values in log.signals.items():
        if name == "u":
            signals[name] = means(values, middle, step)
        elif name == "t" or np.all((values == values.min()) | (values == values.max())):
            signals[name] = means(values, middle, 1)
        else:
            signals[name] = means(values, middle - half, 2 * half + 1)
    return Log(log.name, signals)


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
