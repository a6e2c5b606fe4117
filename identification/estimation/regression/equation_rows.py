"""The two equations of a machine as weighted regressions, in which every effect is a candidate.

Mechanical, in windows of sliding in one direction (N):
    mean F = m second y + (+-)F_c + F_v first y + (+-)friction added - force added.
Actuator, in windows over the whole log (N/s), where a linear actuator has a logged command:
    first F = k1 mean u - k2 first y + offset + rate added.
Each row is divided by what the sensors' noise makes of it, so a complete model leaves 1.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from identification.arrays import Array, BoolArray, IntArray
from identification.estimation.regression.weighted_rows import BLOCKS, Rows
from identification.log import Log
from identification.model.estimates import Drive
from identification.model.karnopp import Karnopp
from identification.progress import Halt
from identification.signals.force_random_walk import corrected_share
from identification.signals.smooth_stretches import smooth_stretches
from identification.signals.weak_form import (
    WeakWindows,
    noise_gain,
    weights,
)

MECHANICAL, ACTUATOR, REST, BREAKAWAY = "mechanical", "actuator", "rest", "breakaway"
EQUATIONS = (MECHANICAL, ACTUATOR, REST, BREAKAWAY)
NOTHING_KNOWN = np.array([1.0, 0.0, 0.0, 0.0, 0.0])  # a body of 1 kg alone, before a first estimate
FIVE = ("m", "F_cp", "F_cn", "F_vp", "F_vn")
OF_FORCE = 1e-5  # of the force's spread, noise of it that is of no account


@dataclass(frozen=True)
class LogNoise:
    """Noise of a log, one sigma each.

    y [m]: of the position at rest; jitter [s]: of the instants of its samples; v [m/s]: of the
    smoothed velocity; F [N]: of the force; between [N]: the part of F that no log shows, of a loop
    faster than the log, None of a force that is known to be exact; random_walk [N]: by which a
    sample more may take the force away from what the command makes of it (0: the command is exact,
    or there is none).
    """

    y: float
    jitter: float
    v: float
    F: float
    between: float | None = 0.0
    random_walk: float = 0.0

    @property
    def corrected(self) -> float:
        """Share of its distance to the measured force, by which the force of a run driven by the
        command is corrected: Kalman's steady gain of a local level (Harvey 1989)."""
        return corrected_share(self.random_walk, self.F)


@dataclass(frozen=True, eq=False)
class MotionLog:
    """One log with its motion, and its windows in the two equations (actuator: None without u).

    kinks: by how much the measured force lies beyond the lines through its samples [N], (n,).
    reference: friction with which a run drifts at most under the noise of the measured force; a
    plant that drifts more must not gain by it. rotary: y is an angle [rad]. prescribed: the motion
    is prescribed by a rig. halt: asked before every run along the log.
    """

    log: Log
    signals: Mapping[str, Array]
    sliding: WeakWindows
    up: BoolArray
    speed: Array
    whole: WeakWindows | None
    noise: LogNoise
    zoh: bool
    kinks: Array
    rotary: bool = False
    prescribed: bool = False
    reference: Karnopp | None = None
    halt: Halt = field(default_factory=Halt)

    def is_forced(self, drive: Drive) -> bool:
        """Whether a force drives its runs: the measured one, or a motor's, that of its command."""
        return drive == "force" or self.zoh

    def has_random_walk(self, drive: Drive) -> bool:
        """Whether a run drifts off with the noise of the force that drives or corrects it."""
        return (self.is_forced(drive) or self.noise.random_walk > 0.0) and self.noise.F > 0.0

    @property
    def by_motor(self) -> bool:
        """Whether its force is that of a motor's command, not one that is measured."""
        return self.zoh and not self.log.zoh

    @cached_property
    def position_sd(self) -> Array:
        """Noise of every sample of the position [m], (n,): more in motion if the clock jitters."""
        return np.hypot(self.noise.y, self.noise.jitter * self.signals["v"])

    @cached_property
    def in_motion(self) -> tuple[BoolArray, Mapping[str, Array]]:
        """Samples (n,) in which the body clearly moves, the first, and the signals in them."""
        own = self.signals["d"] != 0
        own[:1] = True  # from which time counts
        return own, {key: x[own] for key, x in self.signals.items()}

    @cached_property
    def driving(self) -> Log:
        """The log with the force that drives a run, between its samples too, and without the noise
        of a measured one as far as that is smooth, since noise alone would begin a motion: of one
        that is no hold, which changes between its samples, at rest alone."""
        F = np.asarray(self.log["F"])
        if not self.by_motor:
            smooth = self.zoh or self.signals["d"] == 0.0
            F = np.where(smooth, smooth_stretches(F, self.noise.F), F)
        return self.log.with_signals(F=F + self.kinks)


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
    b = (w.zoh if one.zoh else w.mean) @ one.log["F"]
    if k1 != 0.0:
        impulse = k1 * integral(one.log["u"], one.log.h)
        b = b + w.kinked @ impulse - w.mean @ impulse
    sd = sliding_sd(one, w, up, theta)
    return Rows(b, X, sd, blocks_of(w, len(one.log)), one.speed, FIVE)


def sliding_sd(one: MotionLog, w: WeakWindows, up: BoolArray, theta: Array) -> Array:
    """Noise [N] of rows of sliding in these windows, each up or down (r,); theta: a first estimate
    of the five. Source: `README.md`, (7) (Messenger, Bortz 2021)."""
    mean, first, second, *_ = weights(w.length, one.log.h)
    by_position = [noise_gain(theta[0] * second + viscous * first) for viscous in theta[3:5]]
    square = one.position_sd[w.middle] ** 2 * np.where(up, *by_position)
    # Of a mass and a damping of 0 the position's noise makes none, and no row is without.
    force = one.log["F"]
    spread = np.std(force) if np.ptp(force) > 0.0 else np.max(np.abs(force))
    least = OF_FORCE * float(spread)
    return np.maximum(np.sqrt(one.noise.F**2 * noise_gain(mean) + square), least)


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
    white = one.noise.F**2 + (theta[1] * one.position_sd[w.middle]) ** 2
    random_walk_variance = one.noise.random_walk**2 * noise_gain(np.cumsum(first))
    sd = np.sqrt(white * noise_gain(first) + random_walk_variance)
    # A force that stands at its sensor's end shows no noise, and no row is without.
    sd = np.where(sd > 0.0, sd, OF_FORCE * float(np.std(one.log["F"])))
    r = len(w.start)
    return Rows(
        w.first @ one.log["F"], X, sd, blocks_of(w, len(one.log)), np.full(r, np.inf),
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


def blocks_of(w: WeakWindows, n: int) -> IntArray:
    """Stretch of a log of n samples that each window is in, (r,)."""
    return (w.middle * BLOCKS // n).astype(np.int64)
