"""A position that is renewed more slowly than the log is written: the samples that are new.

A bus or a slow sensor gives a value that the logger repeats until the next. Between two of them the
body looks at rest, and each new one is a jump. What distinguishes it from an encoder's counts in
slow
motion: new values come in step with the clock, whatever the speed, and they differ by many counts.
"""

from typing import NamedTuple

import numpy as np

from identification.arrays import Array, IntArray
from identification.log import Log
from identification.signals.differentiate import resolution

IN_STEP = 0.85  # of the times between new values, that are the usual one (or next to it)
FEWEST_NEW = 40  # new values, which give the step
MANY_COUNTS = 2.5  # counts between two new values: by so many, at their median
USUAL_FROM = 2  # samples
LONGEST_HOLD = 20  # samples for which a logger repeats a value; a command has longer steps
RENEWED_AT, RENEWED_EVERY = "the position is renewed at", "is renewed every"
ZOH_SIGNALS = {
    "u": "the command",
    "F": "the force",
    "p_p": "the pressure p_p",
    "p_n": "the pressure p_n",
}
COMMAND_COLUMN = "u"


class Renewed(NamedTuple):
    """The log with the samples alone at which its position is new, and what is said of it."""

    log: Log
    remarks: tuple[str, ...]


def renewed(log: Log) -> Renewed:
    """The log; of one whose position is constant over several samples, those at which it is new.

    Other signals are then means: a command, a zero-order hold itself, until the next new position;
    whatever else was measured, around it.
    """
    step = hold_length(log["y"]) if "y" in log else 1
    if step < USUAL_FROM:
        return Renewed(log, ())
    at = new_values(log["y"], step)
    signals = {
        key: x[at] if key in ("t", "y") or not np.all(np.isfinite(x)) else _mean(key, x, at)
        for key, x in log.signals.items()
    }
    rate = 1.0 / (step * log.h)
    said = (
        f"{log.name}: {RENEWED_AT} {rate:.3g} Hz (zero-order hold), the log is"
        f" written at {1.0 / log.h:.3g} Hz: only new positions were used"
    )
    return Renewed(Log(log.name, signals), (said,))


def zoh_remarks(log: Log) -> tuple[str, ...]:
    """What is said of commands, forces and pressures renewed more slowly than the position."""
    least = max(USUAL_FROM - 1, hold_length(log["y"]) if "y" in log else 1)
    steps = {name: hold_length(log[name]) for name in ZOH_SIGNALS if name in log}
    return tuple(
        f"{log.name}: {ZOH_SIGNALS[name]} {RENEWED_EVERY} {step} rows,"
        f" at {1.0 / (step * log.h):.3g} Hz (zero-order hold), the log is written at"
        f" {1.0 / log.h:.3g} Hz: a measured one is up to"
        f" {1e3 * step * log.h:.3g} ms old, which looks like a delay; log it in every row"
        for name, step in steps.items()
        if least < step <= LONGEST_HOLD
    )


def hold_length(y: Array) -> int:
    """Samples for which a position or another signal keeps a value, 1 where it changes in each."""
    if not np.all(np.isfinite(y)):
        return 1
    changes = np.flatnonzero(np.diff(y) != 0.0) + 1
    if len(changes) < FEWEST_NEW:
        return 1
    gaps = np.diff(changes)
    usual = int(np.argmax(np.bincount(gaps)))
    if usual < USUAL_FROM:
        return 1
    near = np.abs(gaps - usual) <= (1 if usual > USUAL_FROM else 0)
    whole = gaps % usual == 0  # a value that happens to be the one before
    size = np.abs(np.diff(y)[changes - 1])
    counts = float(np.median(size)) / max(resolution(y), 1e-300)
    in_step = float(np.mean(near | whole)) >= IN_STEP
    return usual if in_step and counts >= MANY_COUNTS else 1


def new_values(y: Array, step: int) -> IntArray:
    """Samples at which a signal is new; where it stays, as often as it is renewed."""
    changes = np.flatnonzero(np.diff(y) != 0.0) + 1
    ends = np.append(changes, len(y))
    parts = [
        np.arange(begin, end - step // 2, step) if end - begin > 1.5 * step else np.array([begin])
        for begin, end in zip(changes, ends[1:], strict=True)
    ]
    return np.concatenate(parts).astype(np.int64)


def _mean(key: str, x: Array, at: IntArray) -> Array:
    """Means of a signal from each new position to the next, or around each."""
    whole = np.concatenate([[0.0], np.cumsum(x - x[0])])
    length = np.append(np.diff(at), len(x) - at[-1])
    if key == COMMAND_COLUMN:
        return np.asarray(x[0] + (whole[at + length] - whole[at]) / length)
    half = np.maximum(length // 2, 1)
    low, high = np.maximum(at - half, 0), np.minimum(at + half + 1, len(x))
    return np.asarray(x[0] + (whole[high] - whole[low]) / (high - low))
