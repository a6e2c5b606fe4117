"""Does a loop come to rest under a constant reference, or go on moving?"""

from dataclasses import dataclass

import numpy as np

from design.loop import LoopRun
from identification.arrays import Array

CYCLES = 3  # reversals in the judged part that make a limit cycle


@dataclass(frozen=True)
class LimitCycle:
    """A motion that goes on under a constant reference; peak to peak [m], period [s]."""

    amplitude: float
    period: float


def limit_cycle(trace: LoopRun, noise: float) -> LimitCycle | None:
    """A motion under the last constant reference that does not end; None where it does.

    It must reverse `CYCLES` times, by more than five times the position's noise, and the last
    half of the dwell must not be calmer than the half before by more than half.
    """
    change = np.flatnonzero(np.diff(trace.r)) + 1
    start = int(change[-1]) if change.size else 0
    y = trace.y[start:]
    early, late = y[len(y) // 3 : 2 * len(y) // 3], y[2 * len(y) // 3 :]
    size, before = float(np.ptp(late)), float(np.ptp(early))
    if size <= max(5.0 * noise, 1e-9) or size < 0.5 * before:
        return None
    turns = _reversals(y[len(y) // 3 :], 0.3 * size)
    if len(turns) < CYCLES:
        return None
    h = float(trace.t[1] - trace.t[0])
    return LimitCycle(size, 2.0 * h * float(np.mean(np.diff(turns))))


def _reversals(y: Array, least: float) -> list[int]:
    """Samples at which the motion has turned round by at least `least`."""
    turns: list[int] = []
    low = high = float(y[0])
    way = 0
    for k, value in enumerate(y.tolist()):
        low, high = min(low, value), max(high, value)
        if way >= 0 and high - value > least:
            way, low = -1, value
            turns.append(k)
        elif way <= 0 and value - low > least:
            way, high = 1, value
            turns.append(k)
    return turns
