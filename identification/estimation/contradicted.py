"""Bad samples that no signal shows by itself: those with which a run that follows the log
disagrees.

A position that has jumped by a few deviations of its noise looks like any other, but from there on
the run is off by as much. A command or a force that was logged wrong for a sample drives the run
away, and without it the run stays. So where a plant follows a log but for a few places, these are
tested, corrected and reported, and the plant is fitted anew.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import maximum_filter1d, median_filter

from identification.arrays import Array, BoolArray, IntArray
from identification.estimation.gauss_newton import gauss_newton
from identification.estimation.recorded_logs import RecordedLogs
from identification.estimation.regression.equation_rows import MotionLog
from identification.estimation.regression.motion_log import again
from identification.estimation.windowed_run.run_errors import (
    CANNOT_BE_FOLLOWED,
    NOISE_LOSS,
    loss,
    soft,
)
from identification.estimation.windowed_run.windows import (
    Freed,
    Starts,
    freed,
    starts,
    window_errors,
    window_run,
)
from identification.log import Log
from identification.model.estimates import Drive, KarnoppFit
from identification.model.plant import Actuator, Motor, Plant
from identification.signals.bad_samples import BadSamples, Kind
from identification.signals.steps import (
    LINE_SIDES,
    LONGEST_SMALL,
    deviations,
    jump_size,
    line_weights,
    outstanding,
    steps_between,
)
from identification.thresholds import BEYOND_CHANCE, FAULT_FROM, HOPELESS

CORRECTION_ROUNDS = 3  # in which a fit searches for bad samples, again without those found
RUN_SIDES = (12, 24)  # samples to either side of a jump, over which a run's errors are compared
CLEAR_OF_ERRORS = 2.5  # times what lines through them leave of the errors, that a jump is
MEDIAN_OVER = 11  # samples whose median a single one is compared to
MOST_EXPLAINED = 0.8  # of what a run leaves beyond noise, that wrong samples of its drive explain
# Of a jump in a run, that the position itself may differ from it, and times its noise
JUMP_SHOWN, JUMP_UNSURE = 0.4, 2.5
SIGNAL_SHOWN = 0.5  # of a run's single error, that the signal itself shows
MOST_SPIKES = 0.05  # share of a signal, beyond which these are no single samples
MOST_CANDIDATES = 16  # samples of a drive that are tried without
# Times the drive's own roughness, from which one is tried; of a measured one, which has kinks
SEEN_FROM, MEASURED_SEEN_FROM = 2.0, 8.0
DRIFTS_OVER = 0.17  # s, over which what a command's noise adds up to passes for one bad sample
SHIFT_STEPS = 3  # to the likeliest value in place of a bad one
FARTHEST_SHIFT = 60.0  # times the drive's roughness, that it is away at most
SHORTEST_PIECE, LEAST_PIECE = 1.0, 250  # s, and samples, of a piece of a log that is cut
BENT, KICK_FROM = (30, 90), 4.0  # samples a side, deviations by which lines through errors bend
MOST_KICKS, KICK_GAINS = 6, 2.0  # tried; times the gain of a sample that stands out by itself
LEAST_SPREAD = 1e-3  # of a run's errors in noise units: a simulated log may have none


@dataclass(frozen=True, eq=False)
class Corrected:
    """Logs without the samples that runs have contradicted, and what these were.

    owner: for each log the number of the given one that it is a piece of.
    """

    recorded: RecordedLogs
    bad: tuple[BadSamples, ...]
    owner: tuple[int, ...]

    @classmethod
    def of_nothing(cls, recorded: RecordedLogs) -> "Corrected":
        """The logs as they are given."""
        return cls(recorded, (), tuple(range(len(recorded.logs))))

    def by(self, plant: Plant, misfit: float) -> "Corrected":
        """The same without what the run of this plant contradicts too; itself if that is nothing.

        Where the command was logged wrong, the log is cut: what the machine was given is not known;
        so it is at a jump, whose size is known within its noise only. misfit: what the plant
        leaves; of a run that is not followed at all nothing is searched. Ours.
        """
        if misfit > HOPELESS:
            return self
        logs, bad, owner = list[Log](), list[BadSamples](), list[int]()
        with self.recorded.halt.closing():
            for one, of in zip(self.recorded.logs, self.owner, strict=True):
                log, found = _of_log(plant, one, self.recorded.drive, misfit)
                pieces = _pieces(log, one, found)
                logs += pieces
                owner += [of] * len(pieces)
                bad += found
        if not bad:
            return self
        return Corrected(self.recorded.of(logs), (*self.bad, *bad), tuple(owner))

    def reported(self, fit: KarnoppFit, given: RecordedLogs) -> KarnoppFit:
        """The fit of all pieces as one of the given logs, that says what became of them."""
        fit = replace(fit, remarks=(*given.remarks, *fit.remarks))
        if not self.bad:
            return fit
        logs = []
        for i in range(len(given.logs)):
            own = [one for one, of in zip(fit.logs, self.owner, strict=True) if of == i]
            logs.append(
                replace(
                    own[0],
                    position_rms=_together([one.position_rms for one in own]),
                    force_rms=None if own[0].force_rms is None
                    else _together([one.force_rms or 0.0 for one in own]),
                    chi_square=float(np.mean([one.chi_square for one in own])),
                )
            )  # fmt: skip
        said = (*(f"{one.line}, since the run contradicts it" for one in self.bad), *fit.remarks)
        return replace(fit, bad=self.bad, remarks=said, logs=tuple(logs))


def _together(rms: Sequence[float]) -> float:
    """Root mean square over pieces, of that of each."""
    return float(np.sqrt(np.mean(np.square(rms))))


def _pieces(log: Log, one: MotionLog, found: Sequence[BadSamples]) -> list[Log]:
    """The log cut where its command was wrong or its position jumps, where both pieces move.

    What is left of a jump's size would be an error of all that follows.
    """
    t, moves = log["t"], one.signals["d"] != 0
    least = max(LEAST_PIECE, round(SHORTEST_PIECE / log.h))
    out, low = list[Log](), 0
    for bad in sorted(found, key=lambda one: one.first):
        if bad.signal != "u" and bad.kind != "jump":
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
    gains = BEYOND_CHANCE**2 * max(1.0, misfit) ** 2
    log, found = one.log, list[BadSamples]()
    noisy = isinstance(plant.actuator, Motor) and one.walks(drive)  # as much as a wrong sample
    if not noisy:
        log, found = _without_drive_spikes(_Driven(plant, one, drive, weighted), gains)
    run = window_run(plant, one, drive, begun, log=_driving(one, log, drive))
    if run is None or misfit > HOPELESS:
        return log, found
    r = states(window_errors(run, one, drive))
    noisier = one.position_sd / one.noise.y
    y, off = _without_spikes(r[0], log["y"] / one.noise.y, noisier)
    found += _finding(log, "y", "spike", off, np.abs(r[0] - y) * one.noise.y)
    seen = log["y"] + (r[0] - y) * one.noise.y
    jumped = _jumps(y / noisier, begun)
    for k in jumped.tolist():
        size = -jump_size(y, k, _side(k, begun, len(y))) * one.noise.y
        if not _shown(one, log["y"], k, size):
            continue
        seen = np.concatenate([seen[: k + 1], seen[k + 1 :] - size])
        t = float(log["t"][k + 1])
        found.append(BadSamples(log.name, "y", "jump", t, t, 1, abs(size), "offset removed"))
    log = log.with_signals(y=seen)
    if len(r) > 1:
        F, off = _without_spikes(r[1], log["F"] / one.noise.F, np.ones(len(log)))
        found += _finding(log, "F", "spike", off, np.abs(r[1] - F) * one.noise.F)
        log = log.with_signals(F=log["F"] + (r[1] - F) * one.noise.F)
    return log, found


def _spread(r: Array) -> float:
    """Standard deviation of errors (n,), whatever single ones and slow parts are."""
    return max(float(np.median(np.abs(np.diff(r)))) / 0.954, LEAST_SPREAD)


def _without_spikes(r: Array, seen: Array, noisier: Array) -> tuple[Array, BoolArray]:
    """Errors (n,) of a run with the single ones put on the level around them, and where.

    noisier (n,): how much noisier than at rest every sample is; seen (n,): the signal in the same
    unit, which has to show the spike too: where it does not, the run has stopped or set off a
    sample too late.
    """
    level = np.asarray(median_filter(r, MEDIAN_OVER, mode="nearest"))
    shown = np.zeros(len(r))
    for length in range(1, LONGEST_SMALL + 1):
        height = deviations(seen, length)[0]
        for i in range(length):
            shown[i:] = np.maximum(shown[i:], height[: len(r) - i])
    off = np.abs(r - level) > FAULT_FROM * _spread(r / noisier) * noisier
    off &= shown > SIGNAL_SHOWN * np.abs(r - level)
    edges = np.flatnonzero(np.diff(np.concatenate(([0], off.astype(np.int8), [0]))))
    for a, b in zip(edges[0::2].tolist(), edges[1::2].tolist(), strict=True):
        off[a:b] = b - a <= LONGEST_SMALL
    if off.mean() > MOST_SPIKES:
        return r, np.zeros_like(off)
    return np.where(off, level, r), off


def _jumps(r: Array, begun: Starts) -> IntArray:
    """Samples after which a run's errors (n,) stay off, none beside the start of a window."""
    if len(r) < 4 * RUN_SIDES[-1]:
        return np.zeros(0, dtype=np.int64)
    steps = steps_between(r, RUN_SIDES, CLEAR_OF_ERRORS)
    for k in begun.at.tolist():
        steps[max(k - RUN_SIDES[0], 0) : k + RUN_SIDES[0]] = 0.0
    least = FAULT_FROM * _spread(r) * np.linalg.norm(line_weights(RUN_SIDES[-1])[0])
    return np.asarray(outstanding(steps, float(least)), dtype=np.int64)


def _shown(one: MotionLog, y: Array, k: int, size: float) -> bool:
    """Whether the position y (n,) itself jumps by about that size after sample k: by lines over so
    few samples that these do not jump as much wherever the body moves, as where it turns back."""
    apart = JUMP_SHOWN * abs(size) + JUMP_UNSURE * one.noise.y
    for side in LINE_SIDES:
        every = np.correlate(y, line_weights(side)[0], "valid")
        moves = one.signals["d"][side - 1 : side - 1 + len(every)] != 0
        usual = float(np.median(np.abs(every[moves]))) if np.any(moves) else 0.0
        if abs(jump_size(y, k, side) - size) <= apart and abs(size) > BEYOND_CHANCE * usual:
            return True
    return False


def _side(k: int, begun: Starts, n: int) -> int:
    """Samples to either side of a jump after sample k that are of its window."""
    borders = np.append(begun.at, n)
    nearest = int(np.min(np.abs(borders - k)))
    return int(np.clip(nearest - 1, RUN_SIDES[0] // 2, 2 * RUN_SIDES[-1]))


def _finding(log: Log, name: str, kind: Kind, off: BoolArray, size: Array) -> list[BadSamples]:
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
    return again(one, log).driving if log is not one.log else one.driving


@dataclass(frozen=True, eq=False)
class _Driven:
    """A plant's run in windows along a log, by another command or force than the logged one."""

    plant: Plant
    one: MotionLog
    drive: Drive
    states: Freed

    @property
    def name(self) -> str:
        """The signal that drives the run."""
        return "F" if self.drive == "force" else "u"

    @property
    def usual(self) -> float:
        """Error of one sample of an actuator's command, that its own noise adds up to at times."""
        one, actuator = self.one, self.plant.actuator
        if not isinstance(actuator, Actuator):
            return 0.0
        noise = one.noise.walk / (actuator.k1 * one.log.h)
        return FAULT_FROM * noise * float(np.sqrt(max(1.0, DRIFTS_OVER / one.log.h)))

    def by(self, x: Array) -> Log:
        """The log with this drive (n,)."""
        log = self.one.log.with_signals(**{self.name: x})
        motor = self.plant.actuator
        return log.with_signals(F=motor.k_a * x) if isinstance(motor, Motor) else log

    def errors(self, x: Array) -> Array | None:
        """What a run by this drive (n,) leaves; None where it cannot be followed."""
        log = _driving(self.one, self.by(x), self.drive)
        run = window_run(self.plant, self.one, self.drive, self.states.begun, log=log)
        return None if run is None else self.states(window_errors(run, self.one, self.drive))

    def cost(self, x: Array) -> float:
        """The robust cost of these."""
        r = self.errors(x)
        return np.inf if r is None else loss(r)

    def likeliest(self, x: Array, own: slice, rough: float) -> tuple[Array, float]:
        """The drive (n,) with its samples `own` where the run follows best, and the cost.

        What was given there is not known but by what the run makes of it. rough: first step.
        """
        off = np.zeros(len(x))
        off[own] = rough

        def errors_at(shift: Array) -> Array:
            r = self.errors(x + shift * off)
            lost = np.full(self.states.weight.size, CANNOT_BE_FOLLOWED)
            return lost if r is None else soft(r.ravel())

        found = gauss_newton(errors_at, np.zeros(1), SHIFT_STEPS, 1.0, FARTHEST_SHIFT)
        return x + found.x * off, found.mean * self.states.weight.size


def _without_drive_spikes(driven: _Driven, gains: float) -> tuple[Log, list[BadSamples]]:
    """The log without those samples of what drives it, without which the run follows better.

    gains: cost that each of them gains at least.
    """
    log = driven.one.log
    x = np.asarray(log[driven.name])
    r = driven.errors(x)
    if r is None:
        return log, []
    now, before, found = x, loss(r), list[BadSamples]()
    near = np.zeros(len(x), dtype=bool)  # what is as near to a bad sample is its own doing
    if driven.drive == "force":  # which has noise, so that every run by it drifts off
        tried = _candidates(x, MEASURED_SEEN_FROM, FAULT_FROM * driven.one.noise.F)
    else:
        tried = [*_candidates(x, SEEN_FROM), *_kicks(r[0], x)]
    for first, length, rough in tried:
        own = slice(first, first + max(length, 1))
        if near[first]:
            continue
        without = now.copy()
        if length > 0:
            ends = [first - 1, first + length]
            without[own] = np.interp(np.arange(first, first + length), ends, x[ends])
            if before - driven.cost(without) <= gains:
                continue
        without, after = driven.likeliest(without, own, rough)
        if before - after <= (gains if length > 0 else KICK_GAINS * gains):
            continue
        if driven.drive == "command" and np.max(np.abs(x - without)[own]) < driven.usual:
            continue
        now, before = without, after
        near[max(first - RUN_SIDES[0], 0) : first + RUN_SIDES[0]] = True
        off = np.zeros(len(x), dtype=bool)
        off[own] = True
        found += _finding(log, driven.name, "spike", off, np.abs(x - now))
    # Where most is left all the same, something else than a few samples is wrong.
    excess = max(loss(r) - NOISE_LOSS * r.size, 0.0)
    if not found or loss(r) - before < MOST_EXPLAINED * excess:
        return log, []
    return driven.by(now), found


def _kicks(r: Array, x: Array) -> list[tuple[int, int, float]]:
    """Samples at which a run's errors (n,) begin to go away, as after a drive x (n,) that is wrong
    there but does not stand out: length 0, and the drive's roughness."""
    if len(r) < 4 * BENT[-1]:
        return []
    size, way = np.full(len(r), np.inf), np.zeros(len(r))
    for side in BENT:
        weights = line_weights(side)[1]
        bent = np.correlate(r, weights, mode="valid") / (_spread(r) * np.linalg.norm(weights))
        here = slice(side - 1, len(r) - side)
        size[here] = np.minimum(size[here], np.abs(bent))
        way[here] += np.sign(bent)
    size[(np.abs(way) < len(BENT)) | ~np.isfinite(size)] = 0.0
    size[: BENT[-1]] = size[-BENT[-1] :] = 0.0
    peak = np.flatnonzero((size > KICK_FROM) & (size == maximum_filter1d(size, 2 * BENT[0] + 1)))
    rough = float(np.median(np.abs(np.diff(x))))
    return [(k, 0, rough) for k in peak[np.argsort(-size[peak])][:MOST_KICKS].tolist()]


def _candidates(x: Array, seen_from: float, least: float = 0.0) -> list[tuple[int, int, float]]:
    """First samples and lengths of what stands out of a drive (n,) the most, and the roughness
    around. seen_from: times that roughness; least: height."""
    found = list[tuple[float, int, int, float]]()
    for length in range(1, LONGEST_SMALL + 1):
        height, own = deviations(x, length)
        usual = max(float(np.median(own)), 1e-300)
        share = height / np.maximum(own, usual)
        for k in np.argsort(-share)[:MOST_CANDIDATES].tolist():
            if share[k] > seen_from and height[k] > least:
                rough = float(np.maximum(own[k], usual))
                found.append((float(share[k]) * length**0.5, k, length, rough))
    return [one[1:] for one in sorted(found, reverse=True)[:MOST_CANDIDATES]]
