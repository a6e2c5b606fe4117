"""A command between the samples of a log that is slower than the drive's loop.

What such a log has is the command of one period of the loop; until its next sample the machine was
given the mean of several. Where the command changes smoothly that mean is the logged one and a
share of the step to the next, (R - 1) / (2 R) for R periods a sample, less a part of how the
command bends. The share is a coefficient in the equation of motion of a motor, whose force the
command is, and in that of an actuator. What the
loop adds from period to period (its encoder's counts) no log shows: it is noise of a motor's force.
A share that no loop makes shifts the instants alone, and hides nothing.
"""

from dataclasses import replace

import numpy as np

from identification.arrays import Array
from identification.estimation.regression.equation_rows import MotionLog
from identification.estimation.regression.weighted_rows import (
    Rows,
    robust,
    solve_rows,
    spread_of_left_out,
    without_each_block,
)
from identification.log import Log
from identification.model.size import NOT_SHOWN, Size
from identification.signals.weak_form import WeakWindows
from identification.thresholds import BEYOND_CHANCE, FAR_LESS, MATERIAL

LARGEST_SHARE = 0.5  # of a loop that is far faster than its log
UNSEEN = Size(0.0, LARGEST_SHARE / 3.0**0.5)  # any share up to that one, where no rows show it
FAR_FASTER = 50.0  # periods a sample, as which any more count


def share_between(rows: Rows, rate: Array, by_motor: bool, slowest: float = 0.0) -> Size:
    """Share of the step to the next sample, by which what the machine was given is another command
    than the logged, with its deviation.

    rows: of the equation of motion of a motor, else of the actuator's, over all logs; rate: what a
    whole step to the next sample would add to them (r,); slowest [m/s]: of those that count. The
    value is 0 where none shows beside what the rows leave: where an effect is missing it may be
    confounded with the command's rate, and that is no share; the deviation then holds what was
    found. Ours: `README.md`, (13).
    """
    keep = np.asarray(rows.speed >= slowest)
    with_rate = replace(rows, X=np.column_stack([rows.X, rate])).at(keep)
    if len(with_rate.b) < 4 * with_rate.X.shape[1] or not np.ptp(with_rate.block):
        return UNSEEN
    with_rate = robust(with_rate)
    found, without = solve_rows(with_rate), solve_rows(replace(with_rate, X=rows.X[keep])).cost
    if without <= 0.0:
        return NOT_SHOWN

    def share_of(theta: Array) -> float:
        # A motor's force stands on the left; an actuator's command is in the first column.
        return float(-theta[-1] if by_motor else theta[-1] / (theta[0] or np.inf))

    apart = [share_of(theta) for theta in without_each_block(with_rate)]
    sd = float(spread_of_left_out(np.array(apart)))
    best = share_of(found.theta)
    share = significant_share(best, sd, 1.0 - found.cost / without)
    # Significantly below 0, which no share is, it says how far off the equation is.
    off = best if best < -BEYOND_CHANCE * sd else max(best, 0.0)
    return Size(share, min(sd if share else float(np.hypot(sd, off)), UNSEEN.sd))


def could_show(found: Size) -> bool:
    """Whether rows that leave a share so unsure could show the largest one."""
    return found.sd * BEYOND_CHANCE <= LARGEST_SHARE


def is_faster_loop(share: float) -> bool:
    """Whether a share is that of a loop with further commands between the samples; far less of a
    step is by how much a drive, or the steps of a simulation, move the instants at which a command
    acts: then the log has all of it."""
    return share > FAR_LESS * LARGEST_SHARE


def rate_column(one: MotionLog, windows: WeakWindows | None = None) -> Array:
    """What a whole step to the next sample would add to the rows of a log, (r,); windows: of a
    motor's, by default those of sliding one way."""
    if one.zoh:
        return np.asarray((windows or one.sliding).zoh @ _steps(one.log.commanded))
    assert one.whole is not None
    return np.asarray(one.whole.first @ (one.log.h * one.log["u"]))


def significant_share(share: float, sd: float, gain: float) -> float:
    """The share (with its deviation), 0 where it is none; gain: part of the square it explains.

    A drive's own lag adds to it: what is beyond the largest share is not missed where this explains
    as much but for an immaterial part of the square.
    """
    if min(share, LARGEST_SHARE) < BEYOND_CHANCE * sd or gain < MATERIAL:
        return 0.0
    beyond = max(BEYOND_CHANCE * sd, share * MATERIAL**0.5)
    return min(share, LARGEST_SHARE) if share <= LARGEST_SHARE + beyond else 0.0


def between_samples(log: Log, share: float, zoh: bool) -> Log:
    """The log with the mean command until the next sample in place of the logged one.

    zoh: a motor's, so that its force is that mean too, beside what acts at a place, which is of
    each sample. Ours: `README.md`, (13).
    """
    if share == 0.0:
        return log
    kernel = _mean_until_next(share)

    keys = [key for key in (("u", "F") if zoh else ("u",)) if key in log]
    means = dict[str, Array]()
    for key in keys:
        x = np.asarray(log[key], dtype=np.float64)
        of_place = np.zeros(len(x))
        if log.of_place is not None:
            # In the unit of a motor's command, which is its force over k_a.
            of_place = log.of_place * float(x @ x) / max(float(x @ log["F"]), 1e-300)
        commanded = np.pad(x - of_place, (1, 2), "edge")
        means[key] = np.convolve(commanded, kernel, "valid") + of_place
    return log.with_signals(**means)


def _mean_until_next(share: float) -> Array:
    """Weights of the sample after the next, the next, the sample itself and the one before, whose
    sum is the mean command until the next sample.

    Of a parabola: the mean of s (s - 1) / 2 over the R periods is -share (1 - share) / 3.
    """
    bend = share * (1.0 - share) / 6.0 if is_faster_loop(share) else 0.0
    return np.array([-bend, share + bend, 1.0 - share + bend, -bend])


def period_of(share: float, h: float) -> float | None:
    """Time [s] after which the loop gives its next command, in logs with samples every h [s].

    None where nothing shows that this is sooner than the next sample. R periods a sample make a
    share of (R - 1) / (2 R).
    """
    return h * (1.0 - 2.0 * share) if is_faster_loop(share) else None


def with_period(log: Log, period: float | None, zoh: bool) -> Log:
    """Another log of such a machine, whatever its clock, with the mean command until its next
    sample; zoh: as in `between_samples`."""
    share = 0.0 if period is None else 0.5 * (1.0 - period / log.h)
    return between_samples(log, max(share, 0.0), zoh)


def unseen(log: Log, share: float) -> float:
    """Noise of a motor's force [N] that its loop adds between the samples of a log of means.

    A white part of every period's force is in the mean of R of them, of which the log has had one;
    what a stop or start adds counts with it, since no parabola through the samples knows it. Ours.
    """
    if not is_faster_loop(share):
        return 0.0
    kernel = _mean_until_next(share)
    means = np.convolve(np.convolve([1.0, -1.0], [1.0, -2.0, 1.0]), kernel)
    white = float(np.mean(np.diff(log.commanded, 3) ** 2)) / float(means @ means)
    R = min(1.0 / max(1.0 - 2.0 * share, 1e-9), FAR_FASTER)
    of_samples = kernel - np.array([0.0, 0.0, 1.0 / R, 0.0])
    return float(np.sqrt(white * ((R - 1.0) / R**2 + of_samples @ of_samples)))


def _steps(x: Array) -> Array:
    """Step from each sample to the next, (n,)."""
    return np.append(np.diff(np.asarray(x, dtype=np.float64)), 0.0)
