"""Small jumps and spikes, distinguished from a body's motion by their shape rather than by their
size.

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
from identification.thresholds import FAULT_FROM

LINE_SIDES = (2, 4, 8)  # samples to either side, through which the lines are laid
JUMP_NEAR = 16  # samples around a jump that belong to it
BEND_SHARE = 1.5  # times the change of the step, that a jump is larger than
CLEAR_OF_LINES = 5.0  # times what the lines leave of their samples, that a jump is
SUDDEN_SHARE = 1.5  # times the largest change of step elsewhere, that a jump is
WHOLE_PERIODS = 1.5  # median periods between two samples, beyond which the clock has a gap
JUMP_STANDS_OUT = 2.5  # times the largest elsewhere, that a jump is
MOST_JUMPS = 12  # of one size
PARABOLA_SIDE = 5  # samples to either side of a spike that the parabola goes through
LONGEST_SMALL = 3  # samples of a spike
COMES_AND_GOES = 0.5  # of its height, by which a signal bends just before a spike and just after it
USUAL_SHARE = 0.6  # of the neighbours, that lie as near to the parabola as counts for its own error
NOISE_BLOCK = 96  # samples, of which the median gives the noise around one
LOUDER = 1.5  # times the noise of the calmest, that it is to count: fewer samples give it
MEDIAN_OF_NOISE = 0.6745  # median size of white noise of unit deviation
CALM_PART = 0.2  # of a log in which its noise is taken to be alone


def white_noise(x: Array) -> float:
    """White noise of a signal (one sigma) from its calmest stretches; at least half its step.

    x: (n,), without gaps.
    """
    third = np.diff(x, 3) / np.sqrt(20.0)
    size = 25
    count = len(third) // size
    power = np.sort(np.mean(third[: count * size].reshape(count, size) ** 2, axis=1))
    calm = power[: max(1, int(CALM_PART * count))]
    return max(float(np.sqrt(np.mean(calm) / 0.45)), 0.5 * resolution(x), 1e-12 * float(np.ptp(x)))


def block_noise(x: Array, size: int) -> Array:
    """White noise (one sigma) of each block of so many samples, (k,): the last few are left over.

    By the median, which a kink or a spike does not move.
    """
    third = np.abs(np.diff(x, 3)) / np.sqrt(20.0)
    count = len(third) // size
    blocks = third[: count * size].reshape(count, size)
    return np.asarray(np.median(blocks, axis=1) / MEDIAN_OF_NOISE)


def local_noise(x: Array) -> Array:
    """White noise of a signal around each sample (one sigma), (n,): `white_noise`, or clearly more.

    A clock that jitters makes a position the noisier the faster the body is. x: (n,), without gaps.
    """
    least, blocks = white_noise(x), block_noise(x, NOISE_BLOCK)
    if not len(blocks):
        return np.full(len(x), least)
    noise = maximum_filter1d(blocks, 3)
    at = np.minimum(np.arange(len(x)) // NOISE_BLOCK, len(blocks) - 1)
    return np.where(noise[at] > LOUDER * least, noise[at], least)


@lru_cache
def line_weights(side: int) -> tuple[Array, Array]:
    """Weights (2 side,) of the jump between lines through `side` samples each, and of the change of
    their slope."""
    x = np.arange(side) + 0.5
    ahead = np.linalg.pinv(np.column_stack([np.ones(side), x]))
    height = np.concatenate([-ahead[0][::-1], ahead[0]])
    slope = np.concatenate([ahead[1][::-1], ahead[1]])
    return height, slope


def steps_between(x: Array) -> Array:
    """How much each sample steps beyond the motion around it, (n - 1,); 0 where that is a kink.

    The least of the heights between the lines of each number of samples, where all agree in sign.
    """
    n, widest = len(x), LINE_SIDES[-1]
    least = np.full(n - 1, 0.0 if n < 2 * widest else np.inf)
    way = np.zeros(n - 1)
    bend = np.zeros(n - 1)
    for side in LINE_SIDES:
        height, slope = line_weights(side)
        here = slice(side - 1, n - side)
        found = np.correlate(x, height, mode="valid")
        least[here] = np.minimum(least[here], np.abs(found))
        way[here] += np.sign(found)
        bend[here] = np.maximum(bend[here], np.abs(np.correlate(x, slope, mode="valid")))
    agreed = (np.abs(way) == len(LINE_SIDES)) & (least > BEND_SHARE * bend)
    agreed[: widest - 1] = agreed[n - widest :] = False
    size = np.where(agreed & (least > CLEAR_OF_LINES * _roughness(x, widest)), least, 0.0)
    return np.asarray(np.sign(way) * size)


def _roughness(x: Array, side: int) -> Array:
    """What the lines through so many samples leave, root mean square of the worse side, (n - 1,).

    A body that is moved for a few samples only is far off these lines.
    """
    n = len(x)
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

    t [s], (n,): beside a gap of the clock none is looked for. A sample that repeats the one before
    was read twice, so all that stays behind is the clock.
    """
    if len(y) < 4 * JUMP_NEAR:
        return np.zeros(0, dtype=np.intp)
    gap = _periods_beside_gaps(t)
    found = outstanding(np.where(gap, 0.0, steps_between(y)), FAULT_FROM * white_noise(y))
    # What changes the speed elsewhere within a sample may do so here, from rest to rest.
    change = np.where(gap[1:] | gap[:-1], 0.0, np.abs(np.diff(y, 2)))
    for k in found.tolist():
        change[max(k - JUMP_NEAR, 0) : k + JUMP_NEAR] = 0.0
    size = np.abs([jump_size(y, int(k)) for k in found])
    sudden = size > SUDDEN_SHARE * float(np.max(change))
    return np.asarray(found[sudden & (y[found + 1] != y[found])])


def beside_gaps(t: Array) -> NDArray[np.bool_]:
    """Samples (n,) near a gap of the clock, over which any motion is a step."""
    gap = _periods_beside_gaps(t)
    return np.asarray(np.append(gap, False) | np.append(False, gap))


def _periods_beside_gaps(t: Array) -> NDArray[np.bool_]:
    """Periods of a clock (n - 1,), one of which near by is a gap."""
    period = np.diff(t)
    near = maximum_filter1d(period, 2 * LINE_SIDES[-1] + 1)
    return np.asarray(near > WHOLE_PERIODS * float(np.median(period)))


def outstanding(steps: Array, least: float) -> NDArray[np.intp]:
    """Places (k,) of the largest of these steps (n,), which stand out of all others, in order.

    least: size that one has at least; none where too many stand out.
    """
    size = np.abs(steps)
    peak = np.flatnonzero((size > 0.0) & (size == maximum_filter1d(size, 2 * JUMP_NEAR + 1)))
    order = peak[np.argsort(-size[peak], kind="stable")][: MOST_JUMPS + 1]
    if not len(order) or size[order[0]] < least:
        return order[:0]
    after = np.append(size[order[1:]], 0.0)
    ratio = size[order] / np.maximum(after, least / JUMP_STANDS_OUT)
    count = int(np.argmax(np.where(size[order] >= least, ratio, 0.0))) + 1
    if ratio[count - 1] < JUMP_STANDS_OUT or count > MOST_JUMPS:
        return order[:0]
    return np.sort(order[:count])


def jump_size(y: Array, at: int, side: int = LINE_SIDES[-1]) -> float:
    """By how much the position jumps after sample `at`, from lines through `side` samples each."""
    height, _ = line_weights(side)
    return float(height @ y[at - side + 1 : at + side + 1])


@lru_cache
def _parabola(length: int) -> tuple[Array, Array]:
    """What a parabola through the samples beside a gap leaves of them (2b, 2b), and gives inside
    it (length, 2b)."""
    half = 0.5 * (length + 1)
    before = -half - np.arange(PARABOLA_SIDE)[::-1]
    x = np.concatenate([before, -before[::-1]])
    inside = np.arange(length) - 0.5 * (length - 1)
    basis = np.vander(x, 3)
    solve = np.linalg.pinv(basis)
    return np.eye(2 * PARABOLA_SIDE) - basis @ solve, np.vander(inside, 3) @ solve


def deviations(x: Array, length: int) -> tuple[Array, Array]:
    """How far so many samples from each on lie off the parabola through their neighbours, and how
    far the neighbours themselves usually do, each (n,). 0 unless all are off to one side, and what
    is off comes and goes at once: a body that sets off, or a force that lets go, does not."""
    height, own = np.zeros(len(x)), np.full(len(x), np.inf)
    if len(x) < 2 * PARABOLA_SIDE + length:
        return height, own
    leaves, gives = _parabola(length)
    view = np.lib.stride_tricks.sliding_window_view(x, 2 * PARABOLA_SIDE + length)
    beside = np.concatenate([view[:, :PARABOLA_SIDE], view[:, PARABOLA_SIDE + length :]], axis=1)
    off = view[:, PARABOLA_SIDE : PARABOLA_SIDE + length] - beside @ gives.T
    one_side = np.abs(np.sum(np.sign(off), axis=1)) == length
    left = np.partition(np.abs(beside @ leaves.T), int(USUAL_SHARE * 2 * PARABOLA_SIDE), axis=1)
    here = slice(PARABOLA_SIDE, PARABOLA_SIDE + len(view))
    size, bend = np.min(np.abs(off), axis=1), np.sign(off[:, 0])[:, np.newaxis] * np.diff(view, 2)
    first, last = PARABOLA_SIDE - 1, PARABOLA_SIDE + length - 2  # columns of its own bends
    comes_and_goes = np.minimum(bend[:, first - 1], bend[:, last + 1]) > COMES_AND_GOES * size
    turns = np.maximum(bend[:, first], bend[:, last]) < 0.0  # as no acceleration of a body does
    height[here] = np.where(one_side & comes_and_goes & turns, size, 0.0)
    own[here] = left[:, int(USUAL_SHARE * 2 * PARABOLA_SIDE)]
    return height, own


def small_spikes(x: Array) -> NDArray[np.bool_]:
    """Where 1 to 3 samples lie off the parabola through their neighbours, all to one side, (n,)."""
    out = np.zeros(len(x), dtype=bool)
    if len(x) < 4 * PARABOLA_SIDE + LONGEST_SMALL:
        return out
    noise = local_noise(x)
    for length in range(1, LONGEST_SMALL + 1) if np.all(noise > 0.0) else ():
        height, own = deviations(x, length)
        for first in np.flatnonzero(height > FAULT_FROM * np.maximum(noise, own)):
            out[first : first + length] = True
    return out
