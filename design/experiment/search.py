"""The search for the reference that is most informative: segments, their shares of the time, then
exchange.

1. Each segment of the library is run alone, on the machine as the model has it and as it may be;
   one that comes near a limit on any of them is left out.
2. How the time is best shared among them is a convex program (`allocation`).
3. The shares are rounded to a run, and the run changed piece by piece, each time simulated as a
   whole, as long as its information grows and somebody waits.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from design.experiment.allocation import MOST_REPEATS, Allocation
from design.experiment.limits import MotionLimits, Peaks
from design.experiment.segments import SEGMENT_DWELL, Segment, allowed, library, reference
from identification.arrays import Array
from identification.errors import NotIdentifiable
from identification.progress import KeepGoing, Progress

OF_A_LIMIT = 0.97  # share of a limit that a run of the search may use
FEWEST_SEGMENTS = 24  # segments that are looked at, however little time there is
REPEATED_KINDS = ("steps", "multisine")  # of which a whole run may be made, repeated
SWAPS_TRIED = 1500  # exchanges tried among segments, as sums of their information
STALE_CHANGES = 60  # changes in a row that do not help, after which the run is done
RUNS_AT_ONCE = 2  # runs
CHANGE_FACTORS = (0.6, 0.8, 0.9, 1.1, 1.25, 1.6)  # by which a change takes amplitude or rate


@dataclass(frozen=True, eq=False)
class Evaluated:
    """What a reference does and its information: extremes over all plants, and a value the larger
    the better its information; information: whatever the criterion adds up over segments."""

    peaks: Peaks
    value: float
    information: object = None


Evaluate = Callable[
    [Array], Evaluated | None
]  # at r [m], (n,); None where the run cannot be followed


@dataclass(frozen=True, eq=False)
class Joint:
    """Segments together, as the sum of their information. shared: the best shares of the time [s];
    measure: what these are the best of, of so many repeats of each; value: as a `Seen` has it."""

    shared: Callable[[Array, float], Allocation]
    measure: Callable[[Array], float]
    value: Callable[[Array], float]


@dataclass(frozen=True, eq=False)
class Criterion:
    """What a run is to identify. look: at a reference; joint: segments that were evaluated."""

    evaluate: Evaluate
    joint: Callable[[Sequence[Evaluated]], Joint]


@dataclass(frozen=True, eq=False)
class Plan:
    """A reference r [m], (n,), its segments, what it does and its information; bound: what the best
    shares
    reach, joined: what the rounded ones do, both as sums over segments; tried: segments, runs."""

    segments: tuple[Segment, ...]
    r: Array
    seen: Evaluated
    bound: float
    joined: float
    tried: tuple[int, int]


def best_run(
    criterion: Criterion, limits: MotionLimits, h: float, rng: np.random.Generator,
    report: Progress, keep_going: KeepGoing,
) -> Plan:  # fmt: skip
    """The run to make next; h [s]: period of the reference.

    keep_going: asked between runs; once it says no, the best so far is given. Raises
    NotIdentifiable where no segment stays within the limits, or none identifies anything.
    """
    report("segments", 0.0)
    parts, seen = _evaluated(criterion.evaluate, limits, h, report, keep_going)
    report("sharing the time", 0.0)
    seconds = np.array([one.seconds(h) for one in parts])
    room = limits.seconds - SEGMENT_DWELL
    joint = criterion.joint(seen)
    shares = joint.shared(seconds, room)
    times = _rounded(joint, seconds, room, shares.times)
    times = _swapped(joint, seconds, room, times, rng)
    chosen = [tuple(parts[i] for i in _in_turn(times)), *_repeated(parts, seen, seconds, room)]
    report("whole runs", 0.0)
    plan, count = _exchanged(criterion, chosen, parts, limits, h, rng, report, keep_going)
    segments, one = plan
    r = reference(segments, limits, h)
    bound, joined = joint.measure(shares.times), joint.measure(times)
    return Plan(segments, r, one, bound, joined, (len(parts), count))


def _evaluated(
    evaluate: Evaluate, limits: MotionLimits, h: float, report: Progress, keep_going: KeepGoing
) -> tuple[list[Segment], list[Evaluated]]:
    """The segments that stay within the limits on every plant, and their information."""
    every = [one for one in library(limits) if allowed(one, limits, h)]
    # Mixed, so that where the time is short some of each kind have been seen.
    every = [every[i] for i in np.random.default_rng(0).permutation(len(every))]

    def seen_of(i: int) -> Evaluated | None:
        if i >= FEWEST_SEGMENTS and not keep_going():
            return None
        one = every[i]
        r = np.concatenate([np.zeros(round(SEGMENT_DWELL / h)), one.signal(h)])
        return evaluate(limits.home + r)

    parts, seen = [], []
    with ThreadPoolExecutor(RUNS_AT_ONCE) as pool:
        for i, (one, found) in enumerate(
            zip(every, pool.map(seen_of, range(len(every))), strict=True)
        ):
            report("segments", (i + 1) / len(every))
            if found is not None and found.peaks.share_of(limits) <= OF_A_LIMIT:
                parts.append(one)
                seen.append(found)
    if not parts:
        raise NotIdentifiable(
            f"none of {len(every)} pieces of motion stays within stroke {limits.stroke[0]:.3g}"
            f" to {limits.stroke[1]:.3g}, speed {limits.speed:.3g}, force {limits.force:.3g} and"
            f" command {limits.command:.3g} on this model; widen the limits, or give a longer time"
        )
    return parts, seen


def _rounded(joint: Joint, seconds: Array, room: float, shares: Array) -> Array:
    """Whole numbers of repeats (k,) near the best shares (k,), that fit into the time."""
    times = np.floor(shares + 1e-6)
    near = np.flatnonzero(shares > 1e-3)
    near = near if len(near) else np.arange(len(seconds))
    while True:
        left = room - float(times @ seconds)
        fits = [int(i) for i in near if seconds[i] <= left and times[i] < MOST_REPEATS]
        fits = fits or [i for i in range(len(times)) if seconds[i] <= left and times[i] < 1.0]
        if not fits:
            return times
        now = joint.value(times)
        gains = [joint.value(times + _one_more(i, len(times))) - now for i in fits]
        worth = np.array(gains) / seconds[fits]
        times[fits[int(np.argmax(worth))]] += 1.0


def _one_more(i: int, k: int) -> Array:
    out = np.zeros(k)
    out[i] = 1.0
    return out


def _swapped(
    joint: Joint, seconds: Array, room: float, times: Array, rng: np.random.Generator
) -> Array:
    """Repeats (k,) in which segments were exchanged for others as long as that adds information."""
    best, value = times, joint.value(times)
    for _ in range(SWAPS_TRIED):
        trial = best.copy()
        trial[int(rng.choice(np.flatnonzero(trial > 0.0)))] -= 1.0
        while True:
            left = room - float(trial @ seconds)
            fits = np.flatnonzero((seconds <= left) & (trial < MOST_REPEATS))
            if not len(fits):
                break
            trial[int(rng.choice(fits))] += 1.0
        found = joint.value(trial)
        if found > value:
            best, value = trial, found
    return best


def _in_turn(times: Array) -> list[int]:
    """Numbers of segments, each as often as it is repeated, its repeats apart."""
    out: list[int] = []
    left = times.copy()
    while np.any(left >= 1.0):
        for i in np.flatnonzero(left >= 1.0):
            out.append(int(i))
            left[i] -= 1.0
    return out


def _repeated(
    parts: Sequence[Segment], seen: Sequence[Evaluated], seconds: Array, room: float
) -> list[tuple[Segment, ...]]:
    """Runs of one and the same segment, of each kind that is usual the most informative one."""
    out = []
    for kind in REPEATED_KINDS:
        of_kind = [i for i, one in enumerate(parts) if one.kind == kind]
        if of_kind:
            best = max(of_kind, key=lambda i: seen[i].value)
            out.append((parts[best],) * max(1, int(room / seconds[best])))
    return out


def _exchanged(
    criterion: Criterion, begun: Sequence[tuple[Segment, ...]], parts: Sequence[Segment],
    limits: MotionLimits, h: float, rng: np.random.Generator, report: Progress,
    keep_going: KeepGoing,
) -> tuple[tuple[tuple[Segment, ...], Evaluated], int]:  # fmt: skip
    """The best run that changes of one piece at a time lead to from the best of those begun with,
    and how many were tried."""

    def evaluated(segments: tuple[Segment, ...]) -> Evaluated | None:
        found = criterion.evaluate(reference(segments, limits, h))
        return found if found is not None and found.peaks.share_of(limits) <= OF_A_LIMIT else None

    starts = [(one, evaluated(one)) for one in begun if one]
    best = max(starts, key=lambda one: -np.inf if one[1] is None else one[1].value)
    count, stale, chosen = len(starts), 0, best[0]
    while best[1] is None and chosen:  # a run as a whole may go further than its pieces
        chosen = tuple(one.changed(0.9, 1.0) for one in chosen)
        best = (chosen, evaluated(chosen))
        count += 1
        if count > STALE_CHANGES:
            raise NotIdentifiable("no run within the limits was found; widen them")
    with ThreadPoolExecutor(RUNS_AT_ONCE) as pool:
        while stale < STALE_CHANGES and keep_going():
            trials = [_changed(best[0], parts, limits, h, rng) for _ in range(RUNS_AT_ONCE)]
            for segments, found in zip(trials, pool.map(evaluated, trials), strict=True):
                count += 1
                better = found is not None and best[1] is not None
                if better and found is not None and found.value > (best[1] or found).value:
                    best, stale = (segments, found), 0
                else:
                    stale += 1
            report("whole runs", stale / STALE_CHANGES)
    assert best[1] is not None
    return (best[0], best[1]), count


def _changed(
    segments: tuple[Segment, ...], parts: Sequence[Segment], limits: MotionLimits, h: float,
    rng: np.random.Generator,
) -> tuple[Segment, ...]:  # fmt: skip
    """A run in which one piece is another, larger, smaller, faster, slower or elsewhere, or all
    are larger or smaller."""
    out = list(segments)
    i = int(rng.integers(len(out)))
    way = rng.random()
    if way < 0.15:
        factor = float(rng.choice(CHANGE_FACTORS))
        out = [one.changed(factor, 1.0) for one in out]
    elif way < 0.45:
        out[i] = parts[int(rng.integers(len(parts)))]
    elif way < 0.85:
        factors = [1.0, 1.0]
        factors[int(rng.integers(2))] = float(rng.choice(CHANGE_FACTORS))
        out[i] = out[i].changed(*factors)
    else:
        k = int(rng.integers(len(out)))
        out[i], out[k] = out[k], out[i]
    if not all(allowed(one, limits, h) for one in out):
        return segments
    while sum(one.seconds(h) for one in out) > limits.seconds - SEGMENT_DWELL and len(out) > 1:
        del out[int(rng.integers(len(out)))]
    left = limits.seconds - SEGMENT_DWELL - sum(one.seconds(h) for one in out)
    fits = [one for one in parts if one.seconds(h) <= left]
    if fits:
        out.append(fits[int(rng.integers(len(fits)))])
    return tuple(out)
