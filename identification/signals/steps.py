"""Small jumps and spikes, told from a body's motion by their shape rather than by their size.

A position that jumps goes on with the speed that it had: lines through the samples before and
after meet the place of the jump at different heights, however many samples they are laid through.
Where a body is stopped or hit its speed changes instead, and the lines meet within half a sample.
A spike leaves a parabola through its neighbours, which a body's kink follows to a few parts.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d

from identification.arrays import Array
from identification.signals.differentiate import resolution
from identification.thresholds import JUMP_FROM, SPIKE_FROM

SIDES = (2, 4, 8)  # samples to either side, through which the lines are laid
NEAR = 16  # samples around a jump that belong to it
BEND = 1.5  # times the change of the step, that a jump is larger than
CLEAR = 5.0  # times what the lines leave of their samples, that a jump is
SUDDEN = 1.5  # times the largest change of step elsewhere, that a jump is
WHOLE_PERIODS = 1.5  # median periods between two samples, beyond which the clock has a gap
STANDS_OUT = 2.5  # times the largest elsewhere, that a jump is
MOST_JUMPS = 12  # of one size
BESIDE = 5  # samples to either side of a spike that the parabola goes through
LONGEST = 3  # samples of a spike
USUAL = 0.6  # of the neighbours, that lie as near to the parabola as counts for its own error
QUIET = 0.2  # of a log in which its noise is taken to be alone


def white_noise(x: Array) -> float:
    """White noise of a signal (one sigma) from its calmest stretches; at least half its step.

    x: (n,), without gaps.
    """
    third = np.diff(x, 3) / np.sqrt(20.0)
    size = 25
    count = len(third) // size
    power = np.sort(np.mean(third[: count * size].reshape(count, size) ** 2, axis=1))
    calm = power[: max(1, int(QUIET * count))]
    return max(float(np.sqrt(np.mean(calm) / 0.45)), 0.5 * resolution(x), 1e-12 * float(np.ptp(x)))


@lru_cache
def _line_weights(side: int) -> tuple[Array, Array]:
    """Weights (2 side,) of the jump in the middle and of the change of slope there."""
    x = np.arange(side) + 0.5
    ahead = np.linalg.pinv(np.column_stack([np.ones(side), x]))
    height = np.concatenate([-ahead[0][::-1], ahead[0]])
    slope = np.concatenate([ahead[1][::-1], ahead[1]])
    return height, slope


def steps_between(x: Array) -> Array:
    """How much each sample steps beyond the motion around it, (n - 1,); 0 where that is a kink.

    The least of the heights between the lines of each number of samples, where all agree in sign.
    """
    n, widest = len(x), SIDES[-1]
    least = np.full(n - 1, 0.0 if n < 2 * widest else np.inf)
    way = np.zeros(n - 1)
    bend = np.zeros(n - 1)
    for side in SIDES:
        height, slope = _line_weights(side)
        here = slice(side - 1, n - side)
        found = np.correlate(x, height, mode="valid")
        least[here] = np.minimum(least[here], np.abs(found))
        way[here] += np.sign(found)
        bend[here] = np.maximum(bend[here], np.abs(np.correlate(x, slope, mode="valid")))
    agreed = (np.abs(way) == len(SIDES)) & (least > BEND * bend)
    agreed[: widest - 1] = agreed[n - widest :] = False
    size = np.where(agreed, least, 0.0)
    return np.asarray(np.sign(way) * np.where(size > CLEAR * _roughness(x), size, 0.0))


def _roughness(x: Array) -> Array:
    """What the lines through the widest sides leave, root mean square of the worse side, (n - 1,).

    A body that is moved for a few samples only is far off these lines.
    """
    side, n = SIDES[-1], len(x)
    out = np.full(n - 1, np.inf)
    if n < 2 * side:
        return out
    basis = np.vander(np.arange(side), 2)
    leaves = np.eye(side) - basis @ np.linalg.pinv(basis)
    view = np.lib.stride_tricks.sliding_window_view(x, side)
    rough = np.sqrt(np.mean((view @ leaves.T) ** 2, axis=1))
    out[side - 1 : n - side] = np.maximum(rough[: n - 2 * side + 1], rough[side:])
    return out


def small_jumps(t: Array, y: Array) -> NDArray[np.intp]:
    """Samples (k,) after which the position y (n,) goes on from another place, in order.

    t [s], (n,): beside a gap of the clock none is looked for.
    """
    if len(y) < 4 * NEAR:
        return np.zeros(0, dtype=np.intp)
    period = np.diff(t)
    gap = maximum_filter1d(period, 2 * SIDES[-1] + 1) > WHOLE_PERIODS * float(np.median(period))
    size = np.where(gap, 0.0, np.abs(steps_between(y)))
    peak = np.flatnonzero((size > 0.0) & (size == maximum_filter1d(size, 2 * NEAR + 1)))
    order = peak[np.argsort(-size[peak], kind="stable")][: MOST_JUMPS + 1]
    least = JUMP_FROM * white_noise(y)
    if not len(order) or size[order[0]] < least:
        return order[:0]
    after = np.append(size[order[1:]], 0.0)
    ratio = size[order] / np.maximum(after, least / STANDS_OUT)
    count = int(np.argmax(np.where(size[order] >= least, ratio, 0.0))) + 1
    if ratio[count - 1] < STANDS_OUT or count > MOST_JUMPS:
        return order[:0]
    # What changes the speed elsewhere within a sample may do so here, from rest to rest.
    change = np.where(gap[1:] | gap[:-1], 0.0, np.abs(np.diff(y, 2)))
    for k in order[:count].tolist():
        change[max(k - NEAR, 0) : k + NEAR] = 0.0
    found = order[:count]
    return np.sort(found[size[found] > SUDDEN * float(np.max(change))])


def jump_size(y: Array, at: int) -> float:
    """By how much the position jumps after sample `at`, from lines through 8 samples a side."""
    side = SIDES[-1]
    height, _ = _line_weights(side)
    return float(height @ y[at - side + 1 : at + side + 1])


@lru_cache
def _parabola(length: int) -> tuple[Array, Array]:
    """What a parabola through the samples beside a gap leaves of them (2b, 2b), and gives inside
    it (length, 2b)."""
    half = 0.5 * (length + 1)
    before = -half - np.arange(BESIDE)[::-1]
    x = np.concatenate([before, -before[::-1]])
    inside = np.arange(length) - 0.5 * (length - 1)
    basis = np.vander(x, 3)
    solve = np.linalg.pinv(basis)
    return np.eye(2 * BESIDE) - basis @ solve, np.vander(inside, 3) @ solve


def small_spikes(x: Array) -> NDArray[np.bool_]:
    """Where 1 to 3 samples lie off the parabola through their neighbours, all to one side, (n,)."""
    out = np.zeros(len(x), dtype=bool)
    if len(x) < 4 * BESIDE + LONGEST:
        return out
    noise = white_noise(x)
    if noise == 0.0:
        return out
    for length in range(1, LONGEST + 1):
        leaves, gives = _parabola(length)
        view = np.lib.stride_tricks.sliding_window_view(x, 2 * BESIDE + length)
        beside = np.concatenate([view[:, :BESIDE], view[:, BESIDE + length :]], axis=1)
        off = view[:, BESIDE : BESIDE + length] - beside @ gives.T
        height = np.min(np.abs(off), axis=1)
        one_side = np.abs(np.sum(np.sign(off), axis=1)) == length
        may = np.flatnonzero(one_side & (height > SPIKE_FROM * noise))
        if not len(may):
            continue
        left = np.sort(np.abs(beside[may] @ leaves.T), axis=1)
        own = left[:, int(USUAL * 2 * BESIDE)]
        for first in may[height[may] > SPIKE_FROM * np.maximum(noise, own)]:
            out[first + BESIDE : first + BESIDE + length] = True
    return out
