"""Friction countermeasures beside the compensator: those that the paper's introduction names.

High gain is a PD of other gains; dead zone and reset of the integral are `IntegralPID`; dither,
disturbance observer and extended Kalman friction observer are here as values. The loop that runs
them is `design.servo`.
"""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from design.pid import pid_to_rst
from design.rst import RST
from identification.arrays import Array
from identification.errors import BadSpecification
from identification.signals.filters import Filter

IntegralRule = Literal["plain", "dead-zone", "reset"]
RULES: tuple[IntegralRule, ...] = ("plain", "dead-zone", "reset")


@dataclass(frozen=True)
class IntegralPID:
    """k_R (1 + 1/(T_i s) + T_d s/(eps s + 1)) on the error, every h [s], with a rule for the sum.

    rule "dead-zone": an error of at most `zone` [m] is not summed; "reset": the sum starts anew
    where the error changes sign; "plain": neither. Raises BadSpecification where a time is not
    positive (T_d may be 0) or `zone` is negative. Source: paper, eq. (6) and its introduction.
    """

    k_R: float
    T_i: float
    T_d: float
    eps: float
    h: float
    rule: IntegralRule = "plain"
    zone: float = 0.0

    def __post_init__(self) -> None:
        _ = self.linear
        if self.rule not in RULES:
            raise BadSpecification(f"rule {self.rule!r} unknown; choose one of {', '.join(RULES)}")
        if not (math.isfinite(self.zone) and self.zone >= 0):
            raise BadSpecification(f"zone = {self.zone:g} m, must be finite and >= 0")

    @property
    def linear(self) -> RST:
        """The PID without its rule."""
        return pid_to_rst(self.k_R, self.T_i, self.T_d, self.eps, self.h)


@dataclass(frozen=True)
class Dither:
    """A sine on the command: amplitude [V], frequency [Hz]."""

    amplitude: float
    frequency: float

    def __post_init__(self) -> None:
        if not (self.amplitude > 0 and self.frequency > 0):
            raise BadSpecification(
                f"dither of {self.amplitude:g} V at {self.frequency:g} Hz: both must be > 0"
            )

    def signal(self, t: Array) -> Array:
        """What is added to the command at the times t [s], (n,) [V]."""
        return np.asarray(self.amplitude * np.sin(2.0 * np.pi * self.frequency * t))


@dataclass(frozen=True)
class DisturbanceObserver:
    """Friction as what F_e leaves of the motion of mass m [kg] with F_v [N s/m], behind Q.

    Q = 1/(s/w + 1)^2, w [rad/s], sampled by the bilinear rule. The estimate is
    Q F_e - Q (m s^2 + F_v s) y: all that is not inertia and viscous friction.
    Source: Ohnishi, Shibata & Murakami, IEEE/ASME Trans. Mechatronics 1 (1996).
    """

    m: float
    F_v: float
    w: float

    def __post_init__(self) -> None:
        if not (self.m > 0 and self.F_v >= 0 and self.w > 0):
            raise BadSpecification(
                f"m = {self.m:g} kg, F_v = {self.F_v:g} N s/m, w = {self.w:g} rad/s: need m, w > 0"
                " and F_v >= 0"
            )

    def filters(self, h: float) -> tuple[Filter, Filter]:
        """Filters of the force and of the position, sampled at h [s]."""
        from scipy.signal import bilinear

        Q = np.array([1.0 / self.w**2, 2.0 / self.w, 1.0])

        def sampled(numerator: list[float]) -> Filter:
            b, a = bilinear(numerator, Q, fs=1.0 / h)
            return Filter(
                tuple(float(c / a[0]) for c in b), (1.0, *(float(c / a[0]) for c in a[1:]))
            )

        return sampled([1.0]), sampled([self.m, self.F_v, 0.0])


@dataclass(frozen=True)
class FrictionObserver:
    """Extended Kalman filter of position, velocity and friction force; the force is added back.

    m [kg]; viscous friction F_vp, F_vn [N s/m] by direction, which is what makes it extended; the
    rest of the friction is a random walk. q_v [m/s per root s], q_F [N per root s]: what drives
    velocity and friction; r_y [m]: standard deviation of the position.
    Source: Ray, Ramasubramanian & Townsend, Control Engineering Practice 9 (2001), the observer
    that the paper's introduction names; the asymmetric viscous friction in it is ours.
    """

    m: float
    F_vp: float
    F_vn: float
    q_v: float
    q_F: float
    r_y: float

    def __post_init__(self) -> None:
        if not (self.m > 0 and min(self.F_vp, self.F_vn) >= 0):
            raise BadSpecification(f"m = {self.m:g} kg, F_v = {self.F_vp:g}, {self.F_vn:g} N s/m")
        if not min(self.q_v, self.q_F, self.r_y) > 0:
            raise BadSpecification(
                f"q_v = {self.q_v:g}, q_F = {self.q_F:g}, r_y = {self.r_y:g}: all must be > 0"
            )
