"""A position that jumps or wraps, put back where the body is, and cut there.

What is left of a jump's size after it is taken out would still be an error of all that follows; so
the log is cut there too, where that leaves pieces long enough to identify something.
"""

import numpy as np
from numpy.typing import NDArray

from identification.arrays import Array
from identification.log import Log
from identification.signals.bad_samples import BadSamples
from identification.signals.check import JUMPS_ALIKE
from identification.signals.jumps import LONGEST_SPIKE, jumps
from identification.signals.steps import LINE_SIDES, jump_size, small_jumps

JUMP_ROUNDS = 8  # in which jumps of another size are looked for
SHORTEST_PART = 1.0  # s, on either side of a jump, of a log that is cut there
CUT_BESIDE = 3  # samples to either side of a jump that are left out
OF_TURN = 0.02  # of a turn or of a counter's range, that the wraps of one are off
OF_RANGE = 0.9  # of the position's range, that a counter leaps as it wraps
ROUNDED_OFF = 1e-10  # of a range, that is no count
WHOLE_COUNT, MOST_WHOLE = (
    0.01,
    0.99,
)  # of a count, that the steps of a counter are off; share that are
FEWEST_WRAPS = 2


def without_jumps(log: Log, rotary: bool) -> tuple[Log, tuple[BadSamples, ...]]:
    """The log with a position that does not jump, and the jumps; those of no clear size are left
    for `check` to refuse. rotary: positions are angles [rad]."""
    found, at = list[BadSamples](), list[int]()
    for _ in range(JUMP_ROUNDS):
        large = jumps(log, rotary)
        new = small_jumps(log["t"], log["y"]) if large is None else large.at
        new = np.array(
            [k for k in new if LINE_SIDES[-1] <= k < len(log) - LINE_SIDES[-1]], dtype=np.intp
        )
        if (
            not len(new)
            or set(new.tolist()) & set(at)
            or (large is not None and large.wraps and len(large.at) >= FEWEST_WRAPS)
        ):
            break
        before = log["y"]
        log = log.with_signals(y=_continued(before, new))
        at += new.tolist()
        found += [_jump(log, int(k), abs(jump_size(before, int(k)))) for k in new]
    return _cut(log, sorted(at)), tuple(found)


def _continued(y: Array, at: NDArray[np.intp]) -> Array:
    """The position (n,) that goes on after each sample `at` as it was going."""
    out = np.array(y)
    for k in at.tolist():
        out[k + 1 :] -= jump_size(out, k)
    return out


def _jump(log: Log, k: int, size: float) -> BadSamples:
    t = float(log["t"][k + 1])
    return BadSamples(log.name, "y", "jump", t, t, 1, size, "offset removed")


def unwrapped(log: Log, rotary: bool) -> tuple[Log, list[BadSamples]]:
    """The log with a counter that wraps unwrapped, where all its leaps are of one size.

    rotary: positions are angles [rad].
    """
    found = jumps(log, rotary)
    y = log["y"]
    if found is None or len(found.at) < FEWEST_WRAPS:
        return log, []
    # A counter that wraps never leaves its range, whatever way it goes over the end. What comes
    # back at once each time is a spike.
    back = (np.diff(found.at) <= LONGEST_SPIKE) & (found.size[1:] * found.size[:-1] < 0.0)
    if np.min(np.abs(found.size)) < OF_RANGE * np.ptp(y) or 2 * np.sum(back) == len(found.at):
        return log, []
    apart = np.diff(np.concatenate([[-np.inf], found.at, [np.inf]])) > 2 * LINE_SIDES[-1]
    alone = found.at[apart[1:] & apart[:-1]]
    alone = alone[(alone >= LINE_SIDES[-1]) & (alone < len(y) - LINE_SIDES[-1])]
    # Where a counter goes to and fro over its end, its steps on the way even out.
    sizes = np.abs([jump_size(y, int(k)) for k in alone] if len(alone) else found.size)
    if np.ptp(np.abs(found.size)) > JUMPS_ALIKE * np.max(np.abs(found.size)):
        return log, []
    period = _period(float(np.median(sizes)), y, rotary)
    turns = np.round(np.diff(y) / period)
    t = log["t"][1:][turns != 0.0]
    one = BadSamples(
        log.name, "y", "wrap", float(t[0]), float(t[-1]), len(t), period, "offset removed"
    )
    return log.with_signals(y=y - period * np.concatenate([[0.0], np.cumsum(turns)])), [one]


def _period(size: float, y: Array, rotary: bool) -> float:
    """Range of a counter that leaps by about this size: a turn, or a power of two of its counts."""
    if rotary and abs(size / (2.0 * np.pi) - 1.0) < OF_TURN:
        return 2.0 * float(np.pi)
    count = _count(y)
    if count > 0.0:
        power = count * 2.0 ** round(np.log2(size / count))
        return power if abs(size / power - 1.0) < OF_TURN else count * round(size / count)
    return size


def _count(y: Array) -> float:
    """What a counter counts in, but for rounding; 0 of a position that is not counted."""
    levels = np.diff(np.unique(y))
    levels = levels[levels > ROUNDED_OFF * np.ptp(y)]
    count = float(np.min(levels, initial=np.inf))
    steps = np.diff(y) / count
    whole = np.abs(steps - np.round(steps)) < WHOLE_COUNT
    return count if float(np.mean(whole)) > MOST_WHOLE else 0.0


def _cut(log: Log, at: list[int]) -> Log:
    """The log without the samples around these jumps, where pieces on both sides are long."""
    away = np.zeros(len(log), dtype=bool)
    least, last = round(SHORTEST_PART / log.h), 0
    ends = [*at[1:], len(log)] if at else []
    for k, after in zip(at, ends, strict=True):
        if k - last >= least and after - k >= least:
            away[k + 1 - CUT_BESIDE : k + 1 + CUT_BESIDE] = True
            last = k
    return Log(log.name, {key: x[~away] for key, x in log.signals.items()}) if at else log
