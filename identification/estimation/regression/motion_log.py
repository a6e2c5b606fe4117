"""A log with its motion, its windows in the two equations, and its noise: all that rows and runs
take from it."""

from dataclasses import replace

import numpy as np
from scipy.special import chdtri

from identification.arrays import Array
from identification.errors import BadLog
from identification.estimation.regression.equation_rows import (
    NOTHING_KNOWN,
    OF_FORCE,
    LogNoise,
    MotionLog,
    actuator,
    integral,
    mechanical,
)
from identification.estimation.regression.weighted_rows import OVERLAP, least_squares, solve_rows
from identification.log import Log
from identification.signals.clock_jitter import position_noise
from identification.signals.differentiate import Motion, differentiate
from identification.signals.force_random_walk import force_random_walk
from identification.signals.intersample import kinks
from identification.signals.noise import (
    local_noise,
    noise_of_lost_rows,
    quiet_part,
    rounding_of_force,
)
from identification.signals.weak_form import all_windows, noise_gain, sliding_windows, weights
from identification.thresholds import CHANCE_LEVEL

WINDOW_SECONDS = 0.06  # of a window
EXACT_SHARE = 1e-9  # of its range, to which any position is uncertain, by its simulation too
LEAST_SAMPLES = 16  # samples in a window
LEAST_PART = 200  # samples in a part of a log
BEFORE_MOTION = 0.5  # s before the body moves, with which a part of a log begins
SURE_OF_DIRECTION = 5.0  # times the velocity's noise from which its sign is significant
# Hz; a slow motion needs smoothing to stand out of its noise
PRESCRIBED_CUTOFFS = (20.0, 10.0, 5.0, 3.0)
MOSTLY_KNOWN = 0.9  # of the samples of prescribed motion, whose direction is to be significant
STILL_UNKNOWN = 0.8  # of the others, at most, that more smoothing may leave: a body may rest
CONTROL_LAGS = 25  # samples of the position that a controller's force is taken to depend on
OF_FILTER = 0.01  # of the fast content, that a filter cut short and roundoff may leave
CALM_SHARE = 0.9  # of the samples, those that show the controller
OF_DRIFT = 6.0 / 20.0  # of its steps' variance, that third differences count as noise
LEAST_PART_OF_NOISE = 0.1  # of that variance, which is the sensor's at least
SLOWEST_PART = 0.3  # of the windows, in which the body may be within its stick band
OFF_ITS_ROW = 8  # samples, to either side, by which a motor's force may act off its row


def motion_log(
    log: Log, *, zoh: bool, by_command: bool, rotary: bool = False, prescribed: bool = False,
    between: float | None = 0.0,
) -> MotionLog:  # fmt: skip
    """A log with its motion and windows.

    zoh: the force is a zero-order hold, as the log itself may say; prescribed: by a rig; the motion
    is then smoothed until most of it has a significant direction. between [N]: noise of the force
    beside what the log shows of it, None of a zero-order hold that has none. Source of the windows:
    weak form, Messenger, Bortz (2021).
    """
    h, zoh = log.h, zoh or log.zoh
    motion = differentiate(log["y"], h)
    d = _direction(motion)
    for cutoff in PRESCRIBED_CUTOFFS if prescribed else ():
        if np.mean(d != 0) >= MOSTLY_KNOWN:
            break
        smooth = differentiate(log["y"], h, min(cutoff, motion.cutoff))
        # Much smoothing rings where a body stops: the log itself must have gone that way.
        sure = np.where(_gone(log["y"], smooth, h) == _direction(smooth), _direction(smooth), 0.0)
        if smooth.cutoff < motion.cutoff and np.mean(sure == 0) > STILL_UNKNOWN * np.mean(d == 0):
            break
        motion, d = smooth, sure
    length = max(LEAST_SAMPLES, 2 * round(WINDOW_SECONDS / h / 2))
    if len(log) <= length:
        raise BadLog(
            f"{log.name}: {len(log)} samples in {len(log) * h:.3g} s, {length + 1} needed for one"
            f" stretch of {length * h:.3g} s; log a longer run"
        )
    sliding = sliding_windows(d, length, h)
    view = np.lib.stride_tricks.sliding_window_view(np.abs(motion.v), length + 1)
    u = log["u"] if "u" in log else np.zeros(len(log))
    signals = {
        **{k: np.asarray(v) for k, v in log.signals.items()},
        "v": motion.v, "a": motion.a, "smooth": motion.y, "d": d, "u": u,
    }  # fmt: skip
    up, slowest = d[sliding.middle] > 0, np.min(view[sliding.start], axis=1)
    whole = all_windows(len(log), length, h) if by_command else None
    noise = _of_sensors(log, motion, zoh, between)
    beyond = np.zeros(len(log)) if zoh else kinks(np.asarray(log["F"]), noise.F)
    one = MotionLog(
        log, signals, sliding, up, slowest, whole, noise, zoh, beyond, rotary, prescribed
    )  # fmt: skip
    return replace(one, noise=_beside_the_equations(one, motion))


def again(one: MotionLog, log: Log) -> MotionLog:
    """The same of another log of this machine."""
    other = motion_log(
        log, zoh=one.zoh, by_command=one.whole is not None, rotary=one.rotary,
        prescribed=one.prescribed, between=one.noise.between,
    )  # fmt: skip
    return replace(other, halt=one.halt)


def shortened(one: MotionLog, seconds: float, begin: int | None = None) -> MotionLog:
    """So many seconds of a log from a sample on, with its motion; where none is given, from just
    before the body first moves. A part may stand still, so the noise is the whole log's."""
    n = min(len(one.log), max(LEAST_PART, round(seconds / one.log.h)))
    if begin is None:
        begin = int(np.argmax(one.signals["d"] != 0)) - round(BEFORE_MOTION / one.log.h)
    begin = min(max(begin, 0), len(one.log) - n)
    part = again(one, one.log.part(begin, begin + n))
    own = replace(one.noise, v=part.noise.v)
    return replace(part, noise=own, reference=one.reference)


def _of_sensors(log: Log, motion: Motion, zoh: bool, between: float | None) -> LogNoise:
    """The noise of a log as its signals by themselves show it."""
    quiet = local_noise(log["y"])
    # A position that stands for a fifth of its log to the last digit hides its noise there.
    y = min(motion.noise, quiet) if quiet > 0.0 else motion.noise
    unsteady = position_noise(log["y"], motion.v)
    y = y if unsteady is None else unsteady.at_rest
    y = max(y, EXACT_SHARE * float(np.ptp(log["y"])))
    if zoh and between is None:
        F = 0.0
    elif zoh:
        unlogged = 0.0 if log.lost is None else noise_of_lost_rows(log["F"], log.lost)
        F = float(np.linalg.norm([_beside_control(log), between or 0.0, unlogged]))
    else:
        F = max(local_noise(log["F"]), rounding_of_force(log))
    return LogNoise(y, 0.0 if unsteady is None else unsteady.jitter, motion.v_noise, F, between)


def _beside_the_equations(one: MotionLog, motion: Motion) -> LogNoise:
    """The noise of a log, that of its force no more than the equations leave of it."""
    noise, log = one.noise, one.log
    if one.zoh:
        return replace(noise, F=min(noise.F, _left_of_force(one)))
    F = min(noise.F, max(_left_of_force(one), rounding_of_force(log)))
    if one.whole is None:
        return replace(noise, F=F)
    F = min(F, _unexplained(one))
    of_command = integral(one.signals["u"], log.h)
    random_walk = force_random_walk(log["F"], motion.y, of_command, log.h, 1.0 / motion.cutoff)
    # A random walk's steps are in the third differences by which the sensor's noise was seen.
    F = float(np.sqrt(max(F**2 - OF_DRIFT * random_walk**2, LEAST_PART_OF_NOISE * F**2)))
    return replace(noise, F=F, random_walk=random_walk)


def _direction(motion: Motion) -> Array:
    """Direction of the motion (n,), 0 where its velocity's noise leaves it open."""
    sure = np.abs(motion.v) > SURE_OF_DIRECTION * motion.v_noise
    return np.where(sure, np.sign(motion.v), 0.0)


def _gone(y: Array, motion: Motion, h: float) -> Array:
    """Direction (n,) in which the measured position goes over a period of the cut-off."""
    half = max(1, round(0.5 / (motion.cutoff * h)))
    padded = np.pad(y, half, mode="edge")
    step = padded[2 * half :] - padded[: -2 * half]
    return np.where(
        np.abs(step) > SURE_OF_DIRECTION * np.sqrt(2.0) * motion.noise, np.sign(step), 0.0
    )


def _beside_control(log: Log) -> float:
    """Noise of a motor's logged force [N] beside the position's noise that its controller passes.

    That part is in the true force too. A linear controller's force is a filter of position and
    reference; what of the fast content no such filter gives was not in what the motor was given.
    """
    third = {k: np.diff(log[k], 3) for k in ("F", "y", "r") if k in log}
    n = len(third["F"])
    if n < 10 * CONTROL_LAGS:
        return 0.0
    columns = [
        third[k][CONTROL_LAGS - i : n - i]
        for k in ("y", "r")
        if k in third
        for i in range(CONTROL_LAGS)
    ]
    X, b = np.column_stack(columns), third["F"][CONTROL_LAGS:]
    # Kinks of the command (limits, steps of the reference) are few and large.
    quiet = np.abs(b) <= np.quantile(np.abs(b), CALM_SHARE)
    noise = quiet_part(b - X @ least_squares(X[quiet], b[quiet]))
    least = max(OF_FILTER * quiet_part(third["F"]), OF_FORCE * float(np.std(log["F"])))
    return noise if noise > least else 0.0


def _left_of_force(one: MotionLog) -> float:
    """Noise of the force [N] that would hardly leave so little of the equation of motion.

    No more than that is noise: what a controller makes of a noise that no signal shows was given to
    the body too, and is none. Noise leaves the same at any lag, a command that acts off its row
    more than its noise: so by the lag that leaves least. Of a measured force in the faster windows,
    where the equation surely holds. Of a chi-square; ours.
    """
    X = mechanical(one, NOTHING_KNOWN).X
    slowest = 0.0 if one.zoh or not len(X) else float(np.quantile(one.speed, SLOWEST_PART))
    fast = one.speed >= slowest
    X = X[fast]
    free = int((X.shape[0] - X.shape[1]) / OVERLAP)
    if free < 1:
        return np.inf
    F, at = np.asarray(one.log["F"]), np.arange(len(one.log))
    lags = range(-OFF_ITS_ROW, OFF_ITS_ROW + 1)
    mean_of = one.sliding.zoh if one.zoh else one.sliding.mean
    rows = [(mean_of @ np.interp(at - lag, at, F))[fast] for lag in lags]
    square = min(float(np.sum((b - X @ least_squares(X, b)) ** 2)) for b in rows) / OVERLAP
    mean = weights(one.sliding.length, one.log.h)[0]
    return float(np.sqrt(square / chdtri(free, 1.0 - CHANCE_LEVEL) / noise_gain(mean)))


def _unexplained(one: MotionLog) -> float:
    """Noise of the force [N] but for what the command makes of it: a controller passes noise on."""
    k1, k2, _ = solve_rows(actuator(one, np.array([1.0, 0.0, 0.0]))).theta
    h = one.log.h
    force = one.log["F"] - k1 * integral(one.log["u"], h) + k2 * one.signals["smooth"]
    return max(local_noise(force), rounding_of_force(one.log))
