"""Free runs in windows from measured states, and errors freed of the states' uncertainty.

A window begins at a clear rest if one is near: the state is known there. In motion position
and velocity are known within the sensors' noise only, and a small error of either moves the whole
window. So the states are unknowns z of unit variance, and what their likeliest values leave counts:
r - B z, z = (I + B'B)^-1 B'r, for residuals r and B their change with the states in units of the
states' deviations. Sources: multiple shooting, Bock (1983); the states as random effects, Robinson,
Statistical Science 6 (1991) 15.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.arrays import Array, IntArray
from identification.compiled import compiled_fast
from identification.errors import BadModel
from identification.estimation.regression.equation_rows import MotionLog
from identification.estimation.windowed_run.parameters import on_bristle, plant_is_motor
from identification.estimation.windowed_run.window_places import window_places
from identification.log import Log
from identification.model.estimates import Drive
from identification.model.plant import Actuator, Motor, Plant
from identification.signals.sampling import samples
from identification.simulation.free_run import FreeRun, free_run

RUN_WINDOW = 2.0  # of a window
COARSE = 5e-4  # s, sub-step of a bristle: errs by a hundredth of the noise where a spring holds it
ON_ONE_COUNT = 0.3  # of the position's noise, that its samples scatter by where noise is white
AROUND = 8  # samples of a rest whose mean is the position
WHOLE = np.inf  # seconds of a window that is the whole log
NOISE_RUNS = 6  # runs by which the drift by a measured force's noise is seen
RETURNS = 2  # runs until the body's place behind a transducer has converged
MOTOR_WINDOW = 8.0  # s, of those in which a motor is followed in the end
PLACE_CONVERGED = 1e-3  # of the position's noise, by which that place may still change
STATE_STEP = 0.3  # of a state's deviation, by which the change with it is taken


@dataclass(frozen=True, eq=False)
class Starts:
    """Samples (k,) at which the windows of a log begin, states there, and their deviations.

    y [m], v [m/s] (0 at rest), F [N]; sd (3, k) of y, v, F: 0 where a state is known.
    """

    at: IntArray
    y: Array
    v: Array
    F: Array
    sd: Array


def starts(one: MotionLog, drive: Drive, seconds: float = RUN_WINDOW) -> Starts:
    """Windows of about so many seconds, begun at rest where the body rests near by.

    Source: restarts as in multiple shooting, Bock (1983); where they lie is ours.
    """
    index, rest = window_places(one, seconds)
    y, around = np.asarray(one.log["y"]), samples(AROUND, one.log.h)
    near = [y[max(k - around // 2, 0) : k + around // 2 + 1] for k in index.tolist()]
    level = np.array([float(np.mean(x)) for x in near])
    # A body at rest on one count of its encoder is anywhere within it, however long.
    counted = np.array([float(np.std(x)) < ON_ONE_COUNT * one.noise.y for x in near])
    level_sd = np.where(counted, one.noise.y, one.noise.y / np.sqrt(around))
    sd_F = 0.0 if one.is_forced(drive) else one.noise.F
    sd = np.array(
        [
            np.where(rest, level_sd, one.position_sd[index]),
            np.where(rest, 0.0, one.noise.v),
            np.full(len(index), sd_F),
        ]
    )
    return Starts(
        index,
        np.where(rest, level, one.signals["smooth"][index]),
        np.where(rest, 0.0, one.signals["v"][index]),
        np.asarray(one.log["F"])[index],
        sd,
    )


def window_of(begun: Starts, n: int) -> IntArray:
    """Number of the window that each of n samples is in, (n,)."""
    return np.searchsorted(begun.at, np.arange(n), side="right").astype(np.int64) - 1


def window_run(
    plant: Plant, one: MotionLog, drive: Drive, begun: Starts, shift: Array | None = None,
    log: Log | None = None,
) -> FreeRun | None:  # fmt: skip
    """Free run in windows; None where the model cannot be followed.

    shift: (3, k) on y, v, F; log: driven by this one in place of its own. Raises Halted where the
    log's `halt` says so: all refinements and searches in windows come by here. A force corrected by
    the measured one: Kalman's steady gain (Harvey 1989); `README.md`, (3).
    """
    one.halt.ask()
    driven = driven_by(one, drive) if log is None else log
    more = np.zeros((3, len(begun.at))) if shift is None else shift
    y, v, F = begun.y + more[0], begun.v + more[1], begun.F + more[2]

    def run_from(y: Array) -> FreeRun:
        start = (float(y[0]), float(v[0]), float(F[0]))
        return free_run(
            plant,
            driven,
            start,
            drive,
            restarts=(begun.at, y, v, F),
            gain=one.noise.corrected if drive == "command" else 0.0,
            bristle_step=COARSE,
        )

    sensors = [acting.effect for acting in plant.effects if acting.effect.place.shows]
    # A play is as wide open as the motion before has left it.
    at = begun.at - (1 if any(one.evolve is not None for one in sensors) else 0)
    try:
        run, shift = run_from(y), np.zeros(len(y))
        for _ in range(RETURNS if sensors else 0):  # what was measured is what is shown
            before, shift = shift, (run.shown - run.y)[np.maximum(at, 0)]
            if np.all(np.abs(shift - before) <= PLACE_CONVERGED * one.noise.y):
                break
            run = run_from(y - shift)
        return run
    except BadModel:
        return None


def driven_by(one: MotionLog, drive: Drive) -> Log:
    """The log that drives a run: with the measured force between its samples where that does."""
    return one.driving if drive == "force" else one.log


def compared(one: MotionLog, drive: Drive) -> tuple[tuple[Array, ...], Array, Array]:
    """Signals (k of (n,)) that a run is compared with, position [m] and, driven by the command,
    force [N]; the share of a distance to each that counts, and their noise (k,).

    Source of the share: steady gain of a local level, Harvey (1989); `README.md`, (3).
    """
    if one.is_forced(drive):
        return (one.log["y"],), np.ones(1), np.array([one.noise.y])
    # Beside the sensor's noise, that of the force before it was corrected.
    share = np.array([1.0, np.sqrt(1.0 - one.noise.corrected)])
    return (one.log["y"], one.log["F"]), share, np.array([one.noise.y, max(one.noise.F, 1e-12)])


def window_errors(run: FreeRun, one: MotionLog, drive: Drive) -> Array:
    """Errors of a run in units of the noise (k, n), of position and maybe force: `compared`."""
    signals, share, noise = compared(one, drive)
    seen = zip((run.shown, run.F), signals, share, noise, strict=False)
    return np.array([(x - measured) * part / sd for x, measured, part, sd in seen])


@dataclass(frozen=True, eq=False)
class Freed:
    """What takes the part of residuals away that the windows' states account for.

    weight (k, n): less than 1 where the run itself is uncertain; B (3, k, n): change of the
    weighted errors with each state in units of its deviation; inverse (windows, 3, 3) of I + B'B.
    """

    begun: Starts
    weight: Array
    B: Array
    inverse: Array

    @classmethod
    def of_known(cls, begun: Starts, rows: int, n: int) -> "Freed":
        """Of windows whose states are taken as they are measured, errors (rows, n)."""
        inverse = np.tile(np.eye(3), (len(begun.at), 1, 1))
        return cls(begun, np.ones((rows, n)), np.zeros((3, rows, n)), inverse)

    def __call__(self, r: Array) -> Array:
        """Errors (k, n), weighted, less their states' part."""
        out = r * self.weight
        freed_kernel(self.begun.at, self.B, self.inverse, out)
        return out


@compiled_fast
def freed_kernel(at: IntArray, B: Array, inverse: Array, r: Array) -> None:
    """Takes from the weighted errors r (k, n) what the states of their windows account for.

    Those of a window, from sample at[w] on, are most likely (I + B'B)^-1 B'r in units of their
    deviations (Robinson 1991).
    """
    rows, n = r.shape
    states = np.empty(3)
    for w in range(len(at)):
        low, high = at[w], at[w + 1] if w + 1 < len(at) else n
        a, b, c = 0.0, 0.0, 0.0
        for i in range(rows):
            for k in range(low, high):
                a += B[0, i, k] * r[i, k]
                b += B[1, i, k] * r[i, k]
                c += B[2, i, k] * r[i, k]
        for j in range(3):
            states[j] = inverse[w, j, 0] * a + inverse[w, j, 1] * b + inverse[w, j, 2] * c
        for i in range(rows):
            for k in range(low, high):
                r[i, k] -= states[0] * B[0, i, k] + states[1] * B[1, i, k] + states[2] * B[2, i, k]


def freed(
    plant: Plant, one: MotionLog, drive: Drive, begun: Starts, *, even: bool = False
) -> Freed | None:
    """The states' part of errors of this plant; None where it cannot be followed.

    even: every error counts the same, however uncertain the run is there. Source: Robinson (1991);
    `README.md`, (2).
    """
    base = window_run(plant, one, drive, begun)
    if base is None:
        return None
    window = window_of(begun, len(one.log))
    r = window_errors(base, one, drive)
    weight = np.ones(r.shape) if even else _weights(plant, one, drive, begun, base, r)
    B = np.zeros((3, *r.shape))
    for i in range(3):
        if not np.any(begun.sd[i]):
            continue
        shift = np.zeros((3, len(begun.at)))
        shift[i] = STATE_STEP * begun.sd[i]
        moved = window_run(plant, one, drive, begun, shift)
        if moved is not None:
            B[i] = weight * (window_errors(moved, one, drive) - r) / STATE_STEP
    gram = np.einsum("ikn,jkn->ijn", B, B)
    count = len(begun.at)
    sums = [[np.bincount(window, gram[i, j], count) for j in range(3)] for i in range(3)]
    inverse = np.linalg.inv(np.eye(3) + np.moveaxis(np.array(sums), 2, 0))
    return Freed(begun, weight, B, inverse)


def _weights(
    plant: Plant, one: MotionLog, drive: Drive, begun: Starts, base: FreeRun, r: Array
) -> Array:
    """Weights (k, n) of the errors: a run by a measured force drifts with the force's noise.

    By a few runs with as much noise once more (of fixed seeds: a quadrature, nothing random). And
    what a jittering clock shows of it is uncertain in fast motion.
    """
    square = np.zeros(r.shape)
    if one.has_random_walk(drive):
        square[0] = _least_drift(plant, one, drive, begun, base)
    square[0] += (one.noise.jitter * one.signals["v"] / one.noise.y) ** 2
    return np.asarray(1.0 / np.sqrt(1.0 + square))


def _least_drift(plant: Plant, one: MotionLog, drive: Drive, begun: Starts, base: FreeRun) -> Array:
    """As `_drift_variance`, of the plant or of the reference, if that drifts less."""
    square = _drift_variance(plant, one, drive, begun, base)
    if one.reference is not None:
        plain = Plant(one.reference, plant.actuator)
        run = window_run(plain, one, drive, begun)
        if run is not None:
            square = np.minimum(square, _drift_variance(plain, one, drive, begun, run))
    return square


def _drift_variance(
    plant: Plant, one: MotionLog, drive: Drive, begun: Starts, base: FreeRun
) -> Array:
    """Variance (n,) of a run by the force's noise, in units of the position's."""
    square = np.zeros(len(one.log))
    for seed in range(NOISE_RUNS):
        noisy = _noisier(plant, one, drive, np.random.default_rng(seed))
        run = window_run(plant, one, drive, begun, log=noisy)
        if run is not None:
            square += ((run.shown - base.shown) / one.noise.y) ** 2 / NOISE_RUNS
    return square


def _noisier(plant: Plant, one: MotionLog, drive: Drive, rng: np.random.Generator) -> Log:
    """The log that drives a run, with its force's (and command's) noise once more."""
    own = driven_by(one, drive)
    sd = np.hypot(one.noise.F, one.kinks) if drive == "force" else one.noise.F
    noise = sd * rng.standard_normal(len(one.log))
    more = {"F": own["F"] + noise}
    if isinstance(plant.actuator, Motor):
        more["u"] = own["u"] + noise / plant.actuator.k_a
    elif drive == "command" and isinstance(plant.actuator, Actuator):
        step = one.noise.random_walk / (plant.actuator.k1 * one.log.h)
        more["u"] = own["u"] + step * rng.standard_normal(len(one.log))
    return own.with_signals(**more)


def noise_errors(
    plant: Plant, one: MotionLog, drive: Drive, found: Freed, rng: np.random.Generator
) -> Array | None:
    """Errors (k, n), less their states' part, that every signal's noise alone makes of a run.

    Noise of force and command enters the run and drifts, that of the states moves whole windows,
    that of the position is white. Draws of them make the covariance of `README.md`, (9); ours.
    """
    base = window_run(plant, one, drive, found.begun)
    noisy = _noisier(plant, one, drive, rng)
    shift = found.begun.sd * rng.standard_normal(found.begun.sd.shape)
    run = window_run(plant, one, drive, found.begun, shift, noisy)
    if base is None or run is None:
        return None
    y = one.log["y"] + one.position_sd * rng.standard_normal(len(one.log))
    seen = replace(one, log=one.log.with_signals(y=y, F=noisy["F"]))
    return found(window_errors(run, seen, drive) - window_errors(base, one, drive))


def longest_window(plant: Plant, logs: Sequence[MotionLog], drive: Drive) -> float:
    """Windows [s] in which a run of the plant may be followed in the end: as long as the log where
    an exact command drives it, a motor's shorter; RUN_WINDOW where it drifts, or errs by itself."""
    if drive == "force" or on_bristle(plant) or any(one.has_random_walk(drive) for one in logs):
        return RUN_WINDOW
    return MOTOR_WINDOW if plant_is_motor(plant) else WHOLE


def left_in_windows(
    plant: Plant, one: MotionLog, drive: Drive, seconds: float = RUN_WINDOW, *,
    even: bool = False, weighed_by: Plant | None = None,
) -> Array | None:  # fmt: skip
    """Errors of a plant in its own windows of so many seconds, less their states' part, (k, n);
    None: not to be followed. even: as `freed` has it; weighed_by: plant of the weights and states'
    part, by default the same. Source: Robinson (1991)."""
    begun = starts(one, drive, seconds)
    by = plant if weighed_by is None else weighed_by
    return window_residual(plant, one, drive, freed(by, one, drive, begun, even=even))


def window_residual(
    plant: Plant, one: MotionLog, drive: Drive, found: Freed | None
) -> Array | None:
    """Errors of a plant in windows less their states' part, (k, n); None: not to be followed.

    Source: as `freed`, Robinson (1991).
    """
    if found is None:
        return None
    run = window_run(plant, one, drive, found.begun)
    return None if run is None else found(window_errors(run, one, drive))


def position_rms(plant: Plant, logs: Sequence[MotionLog], drive: Drive) -> float | None:
    """Root mean square of the shown position's error in windows [m], over all logs."""
    off = [position_errors(plant, one, drive) for one in logs]
    squares = [e**2 for e in off if e is not None]
    return float(np.sqrt(np.mean(np.concatenate(squares)))) if len(squares) == len(off) else None


def position_errors(plant: Plant, one: MotionLog, drive: Drive) -> Array | None:
    """The shown position's error in windows [m], (n,); None where it cannot be followed."""
    r = left_in_windows(plant, one, drive, even=True)
    return None if r is None else r[0] * one.noise.y
