"""The two equations of a machine as weighted regressions, in which every effect is a candidate.

Mechanical, in windows of sliding in one direction (N):
    mean F = m second y + (+-)F_c + F_v first y + (+-)friction added - force added.
Actuator, in windows over the whole log (N/s), where a linear actuator has a logged command:
    first F = k1 mean u - k2 first y + offset + rate added.
Each row is divided by what the sensors' noise makes of it, so a complete model leaves 1.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from identification.arrays import Array, BoolArray, IntArray
from identification.errors import BadLog
from identification.estimation.regression.weighted_rows import BLOCKS, Rows, solve_rows
from identification.log import Log
from identification.model.karnopp import Karnopp
from identification.progress import Halt
from identification.signals.clock_jitter import position_noise
from identification.signals.differentiate import Motion, differentiate, resolution
from identification.signals.force_random_walk import corrected_share, force_random_walk
from identification.signals.intersample import kinks
from identification.signals.noise import local_noise, quiet_part
from identification.signals.weak_form import (
    WeakWindows,
    all_windows,
    noise_gain,
    sliding_windows,
    weights,
)

WINDOW_SECONDS = 0.06  # of a window
EXACT_SHARE = 1e-12  # of its range, to which any position is uncertain
LEAST_SAMPLES = 16  # samples in a window
LEAST_PART = 200  # samples in a part of a log
BEFORE_MOTION = 0.5  # s before the body moves, with which a part of a log begins
SURE_OF_DIRECTION = 5.0  # times the velocity's noise from which its sign is significant
# Hz; a slow motion needs smoothing to stand out of its noise
IMPOSED_CUTOFFS = (20.0, 10.0, 5.0, 3.0)
MOSTLY_KNOWN = 0.9  # of the samples of prescribed motion, whose direction is to be significant
STILL_UNKNOWN = 0.8  # of the others, at most, that more smoothing may leave: a body may rest
MECHANICAL, ACTUATOR, REST, BREAKAWAY = "mechanical", "actuator", "rest", "breakaway"
EQUATIONS = (MECHANICAL, ACTUATOR, REST, BREAKAWAY)
FIVE = ("m", "F_cp", "F_cn", "F_vp", "F_vn")
NOTHING_KNOWN = np.array([1.0, 0.0, 0.0, 0.0, 0.0])  # a body of 1 kg alone, before a first estimate
CONTROL_LAGS = 25  # samples of the position that a controller's force is taken to depend on
OF_FILTER = 0.01  # of the fast content, that a filter cut short and roundoff may leave
OF_FORCE = 1e-5  # of the force's spread, noise of it that is of no account
CALM_SHARE = 0.9  # of the samples, those that show the controller
OF_DRIFT = 6.0 / 20.0  # of its steps' variance, that third differences count as noise
LEAST_PART_OF_NOISE = 0.1  # of that variance, which is the sensor's at least
FEWEST_LEFT = 20  # from which what they leave shows noise


@dataclass(frozen=True, eq=False)
class MotionLog:
    """One log with its motion, and its windows in the two equations (actuator: None without u).

    kinks: by how much the measured force lies beyond the lines through its samples [N], (n,).
    reference: friction with which a run drifts at most under the noise of the measured force; a
    plant that drifts more must not gain by it. rotary: y is an angle [rad]. imposed: the motion is
    prescribed by a rig. walk: by how much a sample more may take the force away from what
    the command makes of it [N], one sigma (0: the command is exact, or there is none). halt:
    asked before every run along the log. between: the part of noise_F that no log shows, of a
    loop faster than the log [N]; jitter: of the instants of the samples [s], one sigma.
    """

    log: Log
    signals: Mapping[str, Array]
    sliding: WeakWindows
    up: BoolArray
    speed: Array
    whole: WeakWindows | None
    noise_y: float
    noise_F: float
    held: bool
    v_noise: float
    kinks: Array
    rotary: bool = False
    imposed: bool = False
    reference: Karnopp | None = None
    walk: float = 0.0
    halt: Halt = field(default_factory=Halt)
    between: float = 0.0
    jitter: float = 0.0

    @property
    def gain(self) -> float:
        """Share of its distance to the measured force, by which the force of a run driven by the
        command is corrected: Kalman's steady gain of a local level (Harvey 1989)."""
        return corrected_share(self.walk, self.noise_F)

    def again(self, log: Log) -> "MotionLog":
        """The same of another log of this machine."""
        by_command = self.whole is not None
        other = motion_log(
            log, held=self.held, by_command=by_command, rotary=self.rotary, imposed=self.imposed,
            between=self.between,
        )  # fmt: skip
        return replace(other, halt=self.halt)

    @cached_property
    def position_sd(self) -> Array:
        """Noise of every sample of the position [m], (n,): noise_y, and more in motion under a
        jittering clock."""
        return np.hypot(self.noise_y, self.jitter * self.signals["v"])

    @cached_property
    def in_motion(self) -> tuple[BoolArray, Mapping[str, Array]]:
        """Samples (n,) in which the body clearly moves, the first, and the signals in them."""
        own = self.signals["d"] != 0
        own[:1] = True  # from which time counts
        return own, {key: x[own] for key, x in self.signals.items()}

    @cached_property
    def driving(self) -> Log:
        """The log with the force that drives a run, between its samples too."""
        return self.log.with_signals(F=self.log["F"] + self.kinks)


def motion_log(
    log: Log, *, held: bool, by_command: bool, rotary: bool = False, imposed: bool = False,
    between: float = 0.0,
) -> MotionLog:  # fmt: skip
    """A log with its motion and windows.

    held: the force is a zero-order hold of a command; imposed: by a rig; the motion is then
    smoothed until most of it has a significant direction. between [N]: noise of the force beside
    what the log shows of it. Source of the windows: weak form, Messenger, Bortz (2021).
    """
    h = log.h
    motion = differentiate(log["y"], h)
    d = _direction(motion)
    for cutoff in IMPOSED_CUTOFFS if imposed else ():
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
    quiet = max(local_noise(log["y"]), resolution(log["y"]) / np.sqrt(12.0))
    # A position that stands for a fifth of its log to the last digit hides its noise there.
    noise_y = min(motion.noise, quiet) if quiet > 0.0 else motion.noise
    unsteady = position_noise(log["y"], motion.v)
    noise_y = noise_y if unsteady is None else unsteady.at_rest
    noise_y = max(noise_y, EXACT_SHARE * float(np.ptp(log["y"])))
    noise_F = float(np.hypot(_beside_control(log), between)) if held else local_noise(log["F"])
    beyond = kinks(np.asarray(log["F"]), noise_F)
    one = MotionLog(
        log, signals, sliding, up, slowest, whole, noise_y, noise_F, held, motion.v_noise, beyond,
        rotary, imposed, between=between, jitter=0.0 if unsteady is None else unsteady.jitter,
    )  # fmt: skip
    if held:
        return replace(one, noise_F=min(noise_F, _left_of_force(one)))
    if not by_command:
        return one
    noise_F = min(noise_F, _unexplained(one))
    walk = force_random_walk(log["F"], motion.y, integral(u, h), h, 1.0 / motion.cutoff)
    # A random walk's steps are in the third differences by which the sensor's noise was seen.
    noise_F = float(np.sqrt(max(noise_F**2 - OF_DRIFT * walk**2, LEAST_PART_OF_NOISE * noise_F**2)))
    return replace(one, noise_F=noise_F, walk=walk)


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


def shortened(one: MotionLog, seconds: float, begin: int | None = None) -> MotionLog:
    """So many seconds of a log from a sample on, with its motion; where none is given, from just
    before the body first moves. A part may stand still, so the noise is the whole log's."""
    n = min(len(one.log), max(LEAST_PART, round(seconds / one.log.h)))
    if begin is None:
        begin = int(np.argmax(one.signals["d"] != 0)) - round(BEFORE_MOTION / one.log.h)
    begin = min(max(begin, 0), len(one.log) - n)
    cut = Log(one.log.name, {key: x[begin : begin + n] for key, x in one.log.signals.items()})
    part = replace(one.again(cut), noise_y=one.noise_y, noise_F=one.noise_F, walk=one.walk)
    return replace(part, reference=one.reference, jitter=one.jitter)


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
    X = X / np.maximum(np.sqrt(np.mean(X**2, axis=0)), 1e-300)
    # Kinks of the command (limits, steps of the reference) are few and large.
    quiet = np.abs(b) <= np.quantile(np.abs(b), CALM_SHARE)
    theta = np.linalg.lstsq(X[quiet], b[quiet], rcond=1e-10)[0]
    noise = quiet_part(b - X @ theta)
    least = max(OF_FILTER * quiet_part(third["F"]), OF_FORCE * float(np.std(log["F"])))
    return noise if noise > least else 0.0


def _left_of_force(one: MotionLog) -> float:
    """Noise of a motor's force [N] that would leave as much of the equation of motion as is left.

    No more than that is noise: what its controller makes of a noise that no signal shows was given
    to the motor too, and is none.
    """
    rows = mechanical(one, NOTHING_KNOWN)
    if len(rows.b) < FEWEST_LEFT:
        return np.inf
    rest = rows.b - rows.X @ np.linalg.lstsq(rows.X, rows.b, rcond=1e-12)[0]
    mean = weights(one.sliding.length, one.log.h)[0]
    return float(np.sqrt(np.mean(rest**2) / noise_gain(mean)))


def _unexplained(one: MotionLog) -> float:
    """Noise of the force [N] but for what the command makes of it: a controller passes noise on."""
    k1, k2, _ = solve_rows(actuator(one, np.array([1.0, 0.0, 0.0]))).theta
    h = one.log.h
    force = one.log["F"] - k1 * integral(one.log["u"], h) + k2 * one.signals["smooth"]
    return local_noise(force)


def mechanical(one: MotionLog, theta: Array, y: Array | None = None, k1: float = 0.0) -> Rows:
    """Rows of the mechanical equation with the five parameters m, F_cp, F_cn, F_vp, F_vn.

    theta: a first estimate of them, for the rows' noise; y: position in place of the log's [m]; k1:
    of the actuator, whose force has kinks where its command jumps. Sources: weak form, Messenger,
    Bortz, J. Comput. Phys. 443 (2021) 110525; inverse dynamic model, Gautier, Khalil, CDC 1988;
    friction, the paper's eq. (1) outside its band.
    """
    w, up = one.sliding, one.up
    y = one.log["y"] if y is None else y
    speed = w.first @ y
    X = np.column_stack([w.second @ y, 1.0 * up, -1.0 * ~up, speed * up, speed * ~up])
    b = (w.held if one.held else w.mean) @ one.log["F"]
    if k1 != 0.0:
        impulse = k1 * integral(one.log["u"], one.log.h)
        b = b + w.kinked @ impulse - w.mean @ impulse
    mean, first, second, *_ = weights(w.length, one.log.h)
    spread = [
        one.noise_F**2 * noise_gain(mean)
        + one.position_sd[w.middle] ** 2 * noise_gain(theta[0] * second + viscous * first)
        for viscous in (theta[3], theta[4])
    ]
    # Of a mass and a damping of 0 the position's noise makes none, and no row is without.
    least = OF_FORCE * float(np.std(one.log["F"]))
    sd = np.maximum(np.sqrt(np.where(up, spread[0], spread[1])), least)
    return Rows(b, X, sd, _blocks(w, len(one.log)), one.speed, FIVE)


def actuator(one: MotionLog, theta: Array, y: Array | None = None, u: Array | None = None) -> Rows:
    """Rows of the actuator equation with k1, k2 and an offset; theta: a first estimate of them.

    u: integral of the command that reaches the actuator [V s] at every sample. Sources: the paper's
    dF/dt = k1 u - k2 v, in weak form (Messenger, Bortz 2021); drift of the force by the command's
    noise, a local level (Harvey 1989).
    """
    assert one.whole is not None
    w = one.whole
    y = one.log["y"] if y is None else y
    reached = integral(one.log["u"], one.log.h) if u is None else u
    X = np.column_stack([w.first @ reached, -(w.first @ y), np.ones(len(w.start))])
    _, first, *_ = weights(w.length, one.log.h)
    white = one.noise_F**2 + (theta[1] * one.position_sd[w.middle]) ** 2
    walked = one.walk**2 * noise_gain(np.cumsum(first))
    sd = np.sqrt(white * noise_gain(first) + walked)
    # A force that stands at its sensor's end shows no noise, and no row is without.
    sd = np.where(sd > 0.0, sd, OF_FORCE * float(np.std(one.log["F"])))
    r = len(w.start)
    return Rows(
        w.first @ one.log["F"], X, sd, _blocks(w, len(one.log)), np.full(r, np.inf),
        ("k1", "k2", "offset"),
    )  # fmt: skip


def column_noise(one: MotionLog, equation: str) -> Array:
    """Variance (r, k) that the position's noise gives each column of an equation's rows.

    Noise in a column draws its parameter to 0, the more the calmer the motion: without it a mass
    in fast motion would seem to be another in slow motion. Source: Fuller, Measurement Error Models
    (1987).
    """
    w = one.sliding if equation == MECHANICAL else one.whole
    assert w is not None
    _, first, second, *_ = weights(w.length, one.log.h)
    square = one.position_sd[w.middle] ** 2
    none = np.zeros(len(w.start))
    slow = square * noise_gain(first)
    if equation == ACTUATOR:
        return np.column_stack([none, slow, none])
    fast = square * noise_gain(second)
    return np.column_stack([fast, none, none, slow * one.up, slow * ~one.up])


def integral(u: Array, h: float) -> Array:
    """Integral of a command, a zero-order hold, up to each sample [V s]."""
    return h * np.concatenate([[0.0], np.cumsum(u)[:-1]])


def _blocks(w: WeakWindows, n: int) -> IntArray:
    return (w.middle * BLOCKS // n).astype(np.int64)
