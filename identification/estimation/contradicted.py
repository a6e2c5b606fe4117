"""Bad samples that no signal shows by itself: those that a run which follows the log contradicts.

A position that has jumped by a few deviations of its noise looks like any other, but from there on
the run is off by as much. A command or a force that was logged wrong for a sample drives the run
away, and without it the run stays. So where a plant follows a log but for a few places, these are
looked at, corrected and told, and the plant is fitted anew.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter1d, median_filter

from identification.arrays import Array, BoolArray, IntArray
from identification.estimation.recorded_logs import RecordedLogs
from identification.estimation.regression.equation_rows import MotionLog
from identification.estimation.windowed_run.refinement import loss
from identification.estimation.windowed_run.windows import (
    Freed,
    Starts,
    freed,
    starts,
    window_errors,
    window_run,
)
from identification.log import Log
from identification.model.estimates import Drive
from identification.model.plant import Motor, Plant
from identification.signals.bad_samples import BadSamples, Kind
from identification.signals.steps import (
    LONGEST,
    deviations,
    jump_size,
    outstanding,
    slope_weights,
    steps_between,
)
from identification.thresholds import (
    NEARLY_FOLLOWED,
    NO_RUN,
    REPLACED_GAINS,
    RUN_JUMP_FROM,
    RUN_SPIKE_FROM,
)

SIDES = (12, 24)  # samples to either side of a jump, over which a run's errors are compared
CLEAR = 2.5  # times what lines through them leave of the errors, that a jump is
BESIDE = 11  # samples whose median a single one is compared to
MOST_SPIKES = 0.05  # share of a signal, beyond which these are no single samples
MOST_TRIED = 16  # samples of a drive that are tried without
SEEN = 2.0  # deviations of the drive's own roughness, from which one is tried
SHIFTS, FAR = 3, 20.0  # steps to the likeliest value in place of a bad one, and their longest
SHORTEST_PIECE, LEAST_PIECE = 1.0, 250  # s, and samples, of a piece of a log that is cut
BENT, KICK = (30, 90), 4.0  # samples a side, deviations by which lines through errors bend
MOST_KICKS, KICK_GAINS = 6, 2.0  # tried; times the gain of a sample that stands out by itself
LEAST_SPREAD = 1e-3  # of a run's errors in noise units: a simulated log may have none


@dataclass(frozen=True, eq=False)
class Corrected:
    """Logs without what the run contradicts, and what that was.

    owner: for each log the number of the one that it is a piece of.
    """

    recorded: RecordedLogs
    bad: tuple[BadSamples, ...]
    owner: tuple[int, ...]


def corrected(plant: Plant, recorded: RecordedLogs, misfit: float) -> Corrected:
    """The logs with their contradicted samples put right, as the run of this plant has them.

    Where the command was logged wrong, the log is cut: what the machine was given is not known.
    misfit: what the plant leaves; of a run that is not followed at all nothing is looked for.
    """
    if misfit > NO_RUN:
        return Corrected(recorded, (), tuple(range(len(recorded.logs))))
    logs, bad, owner = list[Log](), list[BadSamples](), list[int]()
    for i, one in enumerate(recorded.logs):
        log, found = _of_log(plant, one, recorded.drive, misfit)
        pieces = _pieces(log, one, found)
        logs += pieces
        owner += [i] * len(pieces)
        bad += found
    if not bad:
        return Corrected(recorded, (), tuple(range(len(recorded.logs))))
    return Corrected(recorded.of(logs), tuple(bad), tuple(owner))


def _pieces(log: Log, one: MotionLog, found: Sequence[BadSamples]) -> list[Log]:
    """The log cut at the samples of its command that were wrong, where both pieces move."""
    t, moves = log["t"], one.signals["d"] != 0
    least = max(LEAST_PIECE, round(SHORTEST_PIECE / log.h))
    out, low = list[Log](), 0
    for bad in found:
        if bad.signal != "u":
            continue
        before, after = np.searchsorted(t, [bad.first - 1.5 * log.h, bad.last + 1.5 * log.h])
        if min(before - low, len(t) - after) < least:
            continue
        if np.any(moves[low:before]) and np.any(moves[after:]):
            out.append(log.part(low, int(before)))
            low = int(after)
    return [*out, log.part(low, len(t))] if out else [log]


def _of_log(
    plant: Plant, one: MotionLog, drive: Drive, misfit: float
) -> tuple[Log, list[BadSamples]]:
    begun = starts(one, drive)
    weighted = freed(plant, one, drive, begun)
    states = freed(plant, one, drive, begun, even=True)
    if weighted is None or states is None:
        return one.log, []
    gains = REPLACED_GAINS * max(1.0, misfit) ** 2
    log, found = _without_drive_spikes(plant, one, drive, weighted, gains)
    run = window_run(plant, one, drive, begun, log=_driving(one, log, drive))
    if run is None or misfit > NEARLY_FOLLOWED:
        return log, found
    r = states(window_errors(run, one, drive))
    y, off = _without_spikes(r[0])
    found += _told(log, "y", "spike", off, np.abs(r[0] - y) * one.noise_y)
    seen = log["y"] + (r[0] - y) * one.noise_y
    jumped = _jumps(y, begun)
    for k in jumped.tolist():
        size = -jump_size(y, k, _side(k, begun, len(y))) * one.noise_y
        seen = np.concatenate([seen[: k + 1], seen[k + 1 :] - size])
        t = float(log["t"][k + 1])
        found.append(BadSamples(log.name, "y", "jump", t, t, 1, abs(size), "offset removed"))
    log = log.with_signals(y=seen)
    if len(r) > 1:
        F, off = _without_spikes(r[1])
        found += _told(log, "F", "spike", off, np.abs(r[1] - F) * one.noise_F)
        log = log.with_signals(F=log["F"] + (r[1] - F) * one.noise_F)
    return log, found


def _spread(r: Array) -> float:
    """Standard deviation of errors (n,), whatever single ones and slow parts are."""
    return max(float(np.median(np.abs(np.diff(r)))) / 0.954, LEAST_SPREAD)


def _without_spikes(r: Array) -> tuple[Array, BoolArray]:
    """Errors (n,) of a run with the single ones put on the level around them, and where."""
    level = np.asarray(median_filter(r, BESIDE, mode="nearest"))
    off = np.abs(r - level) > RUN_SPIKE_FROM * _spread(r)
    edges = np.flatnonzero(np.diff(np.concatenate(([0], off.astype(np.int8), [0]))))
    for a, b in zip(edges[0::2].tolist(), edges[1::2].tolist(), strict=True):
        off[a:b] = b - a <= LONGEST
    if off.mean() > MOST_SPIKES:
        return r, np.zeros_like(off)
    return np.where(off, level, r), off


def _jumps(r: Array, begun: Starts) -> IntArray:
    """Samples after which a run's errors (n,) stay off, none beside the start of a window."""
    if len(r) < 4 * SIDES[-1]:
        return np.zeros(0, dtype=np.int64)
    steps = steps_between(r, SIDES, CLEAR)
    for k in begun.at.tolist():
        steps[max(k - SIDES[0], 0) : k + SIDES[0]] = 0.0
    least = RUN_JUMP_FROM * _spread(r)
    return np.asarray(outstanding(steps, least), dtype=np.int64)


def _side(k: int, begun: Starts, n: int) -> int:
    """Samples to either side of a jump after sample k that are of its window."""
    borders = np.append(begun.at, n)
    nearest = int(np.min(np.abs(borders - k)))
    return int(np.clip(nearest - 1, SIDES[0] // 2, 2 * SIDES[-1]))


def _told(log: Log, name: str, kind: Kind, off: BoolArray, size: Array) -> list[BadSamples]:
    """The samples that are off as one finding."""
    if not np.any(off):
        return []
    t, largest = log["t"][off], float(np.max(size[off]))
    count = int(np.count_nonzero(off))
    first, last = float(t[0]), float(t[-1])
    return [BadSamples(log.name, name, kind, first, last, count, largest, "interpolated")]


def _driving(one: MotionLog, log: Log, drive: Drive) -> Log:
    """The log that drives a run, with what lies between samples of a measured force."""
    if drive != "force":
        return log
    return one.again(log).driving if log is not one.log else one.driving


def _without_drive_spikes(
    plant: Plant, one: MotionLog, drive: Drive, states: Freed, gains: float
) -> tuple[Log, list[BadSamples]]:
    """The log without those samples of what drives it, without which the run follows better.

    gains: cost that each of them gains at least.
    """
    name = "F" if drive == "force" else "u"
    x = np.asarray(one.log[name])
    bad, height = np.zeros(len(x), dtype=bool), np.zeros(len(x))

    def cost(tried: Log) -> float:
        """What a run driven by this log leaves."""
        run = window_run(plant, one, drive, states.begun, log=_driving(one, tried, drive))
        return np.inf if run is None else loss(states(window_errors(run, one, drive)))

    def replaced(values: Array) -> Log:
        tried = one.log.with_signals(**{name: values})
        if isinstance(plant.actuator, Motor):
            return tried.with_signals(F=plant.actuator.k_a * values)
        return tried

    now = np.array(x)
    before = cost(replaced(now))
    run = window_run(plant, one, drive, states.begun)
    kicked = [] if run is None else _kicks(states(window_errors(run, one, drive))[0], x)
    for first, length, rough in (*_candidates(x), *kicked):
        own = slice(first, first + length)
        if np.any(bad[max(first - SIDES[0], 0) : first + SIDES[0]]):
            continue
        without = now.copy()
        if length > 0:
            inside = np.arange(first, first + length)
            without[own] = np.interp(
                inside, [first - 1, first + length], x[inside[[0, -1]] + [-1, 1]]
            )
        else:
            own = slice(first, first + 1)
        after = cost(replaced(without))
        if length > 0 and before - after <= gains:
            continue
        # What was given there is not known but by what the run makes of it.
        for _ in range(SHIFTS):
            shift = np.zeros(len(x))
            shift[own] = rough
            low, high = (cost(replaced(without + way * shift)) for way in (-1.0, 1.0))
            if not low + high - 2.0 * after > 0.0:
                break
            best = float(np.clip(0.5 * (low - high) / (low + high - 2.0 * after), -FAR, FAR))
            moved = without + best * shift
            left = cost(replaced(moved))
            if left >= after:
                break
            without, after = moved, left
        if before - after <= (gains if length > 0 else KICK_GAINS * gains):
            continue
        now, before = without, after
        bad[own], height[own] = True, np.abs(x[own] - without[own])
    edges = np.flatnonzero(np.diff(np.concatenate(([0], bad.astype(np.int8), [0]))))
    found = list[BadSamples]()
    for a, b in zip(edges[0::2].tolist(), edges[1::2].tolist(), strict=True):
        only = np.zeros_like(bad)
        only[a:b] = True
        found += _told(one.log, name, "spike", only, height)
    return replaced(now) if found else one.log, found


def _kicks(r: Array, x: Array) -> list[tuple[int, int, float]]:
    """Samples at which a run's errors (n,) begin to go away, as after a drive x (n,) that is wrong
    there but does not stand out: length 0, and the drive's roughness."""
    if len(r) < 4 * BENT[-1]:
        return []
    size, way = np.full(len(r), np.inf), np.zeros(len(r))
    for side in BENT:
        weights = slope_weights(side)
        bent = np.correlate(r, weights, mode="valid") / (_spread(r) * np.linalg.norm(weights))
        here = slice(side - 1, len(r) - side)
        size[here] = np.minimum(size[here], np.abs(bent))
        way[here] += np.sign(bent)
    size[(np.abs(way) < len(BENT)) | ~np.isfinite(size)] = 0.0
    size[: BENT[-1]] = size[-BENT[-1] :] = 0.0
    peak = np.flatnonzero((size > KICK) & (size == maximum_filter1d(size, 2 * BENT[0] + 1)))
    rough = float(np.median(np.abs(np.diff(x))))
    return [(k, 0, rough) for k in peak[np.argsort(-size[peak])][:MOST_KICKS].tolist()]


def _candidates(x: Array) -> Sequence[tuple[int, int, float]]:
    """First samples and lengths of what stands out of a drive (n,) the most, and the roughness
    around."""
    found = list[tuple[float, int, int, float]]()
    for length in range(1, LONGEST + 1):
        height, own = deviations(x, length)
        usual = max(float(np.median(own)), 1e-300)
        share = height / np.maximum(own, usual)
        for k in np.argsort(-share)[:MOST_TRIED].tolist():
            if share[k] > SEEN:
                rough = float(np.maximum(own[k], usual))
                found.append((float(share[k]) * length**0.5, k, length, rough))
    return [one[1:] for one in sorted(found, reverse=True)[:MOST_TRIED]]


def told_of(fit_bad: Sequence[BadSamples]) -> tuple[str, ...]:
    """A line for each finding of a fit."""
    return tuple(f"{one.line}, since the run contradicts it" for one in fit_bad)
