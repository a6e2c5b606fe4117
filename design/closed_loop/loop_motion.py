"""What the motion of a loop comes to: errors, overshoot, settling, forces, along steps and a smooth
reference. Nothing here knows what moved, or by which controller."""

from dataclasses import dataclass
from itertools import pairwise

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


JUDGED_SHARE = 0.5  # part of a dwell that is tested
SETTLING_BAND = 0.05  # of a step, in which a settled position stays
ESCAPED = 10.0  # times the step


@dataclass(frozen=True, kw_only=True)
class LoopMotion:
    """Of a run along steps of height `step` [m] and a smooth reference; relative errors are to the
    step and to the reference's amplitude.

    standstill: largest error [m] in the last half of a dwell, infinite where the loop runs away
    (not `stable`). overshoot: relative to the step. settling: longest time [s] until a step stays
    within 5 %. step_rms, smooth_rms: errors [m]. force_peak [N], command_peak: the largest of both
    runs, this None where the machine takes a force; limited: share of their samples with the
    command at its limit.
    """

    stable: bool
    step: float
    standstill: float
    standstill_relative: float
    overshoot: float
    settling: float
    step_rms: float
    smooth_rms: float
    smooth_relative: float
    force_peak: float
    command_peak: float | None
    limited: float
    limit_cycle: LimitCycle | None


def dwells(steps: LoopRun) -> list[tuple[int, int]]:
    """First sample of each rest of a reference, the first before its first step, and one past its
    last."""
    changes = (np.flatnonzero(np.diff(steps.r)) + 1).tolist()
    return list(pairwise([0, *changes, len(steps.r)]))


def worst_rest(steps: LoopRun) -> tuple[slice, int]:
    """The tested part of the dwell in which a loop is furthest off, and the sample before the
    dwell."""
    off = np.abs(steps.y - steps.r)
    tested = [
        (slice(high - round(JUDGED_SHARE * (high - low)), high), max(low - 1, 0))
        for low, high in dwells(steps)
    ]
    return max(tested, key=lambda one: float(np.max(off[one[0]])))


def loop_motion(
    steps: LoopRun, smooth: LoopRun, noise: float, command_limit: float | None
) -> LoopMotion:
    """The motion of a loop; noise: of the position sensor [m]; command_limit: None for none."""
    step, amplitude = float(np.max(steps.r)), float(np.max(np.abs(smooth.r)))
    stable = _stays(steps, step) and _stays(smooth, amplitude)
    off, h, runs = steps.y - steps.r, float(steps.t[1] - steps.t[0]), (steps, smooth)
    worst, _ = worst_rest(steps)
    # The height of every step, the error after it, and the samples at which that is large.
    after = [
        (float(steps.r[low] - steps.r[low - 1]), off[low:high]) for low, high in dwells(steps)[1:]
    ]
    late = [np.flatnonzero(np.abs(error) > SETTLING_BAND * abs(height)) for height, error in after]
    u = np.concatenate([np.abs(run.u) for run in runs])
    standstill = float(np.max(np.abs(off[worst]))) if stable else np.inf
    smooth_rms = float(np.sqrt(np.mean((smooth.r - smooth.y) ** 2)))
    return LoopMotion(
        stable=stable,
        step=step,
        standstill=standstill,
        standstill_relative=standstill / step,
        overshoot=max(float(np.max(error / height)) for height, error in after),
        settling=h * max(float(one[-1] + 1) if one.size else 0.0 for one in late),
        step_rms=float(np.sqrt(np.mean(off**2))),
        smooth_rms=smooth_rms,
        smooth_relative=smooth_rms / amplitude,
        force_peak=max(float(np.max(np.abs(each.F))) for each in runs),
        command_peak=max(float(np.max(np.abs(each.u))) for each in runs),
        limited=0.0 if command_limit is None else float(np.mean(u >= command_limit)),
        limit_cycle=limit_cycle(steps, noise) if stable else None,
    )


def _stays(trace: LoopRun, size: float) -> bool:
    """Whether a loop stays near a reference of this size [m]; not where it is lost to NaN."""
    return bool(np.all(np.abs(trace.y) < ESCAPED * size))
