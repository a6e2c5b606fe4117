"""The linear body behind an elastic shaft or frame, as a position controller sees it, sampled.

    y/F = Z(s) / (m s^2 D(s) + F_v s Z(s)),   Z = prod Z_i, D = prod D_i,
    Z_i = (s/w_a)^2 + 2 z_a s/w_a + 1,   D_i = (s/w_r)^2 + 2 z_r s/w_r + 1

with m [kg] the whole mass and F_v [N s/m] the friction of what is measured; one factor an elastic
part. Where a part shows no anti-resonance its Z_i is 1. Two masses are one such factor, with
z_a w_r = z_r w_a. Source: Schroeder, Elektrische Antriebe - Regelung von Antriebssystemen, 4th ed.,
chapter 19.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import tf2ss

from design.force_pi import ForcePI
from design.linear import force_loop, transfer, zoh_step
from design.polynomial import check_period
from identification.arrays import Array
from identification.errors import BadSpecification
from identification.model.plant import Actuator


@dataclass(frozen=True)
class Swing:
    """An elastic part: resonance [Hz] and its damping, and its anti-resonance [Hz] with its own,
    None where it shows none."""

    resonance: float
    damping: float
    anti_resonance: float | None = None
    anti_damping: float = 0.0

    def __post_init__(self) -> None:
        anti = self.anti_resonance
        positive = self.resonance > 0 and (anti is None or anti > 0)
        if not (positive and self.damping >= 0 and self.anti_damping >= 0):
            raise BadSpecification(
                f"resonance {self.resonance:g} Hz of damping {self.damping:g}, anti-resonance"
                f" {anti or 0.0:g} Hz: need frequencies > 0 and dampings >= 0"
            )

    @classmethod
    def of_two_masses(cls, resonance: float, anti_resonance: float, damping: float) -> "Swing":
        """That of two masses, by frequencies [Hz] and the damping of the resonance."""
        return cls(resonance, damping, anti_resonance, damping * anti_resonance / resonance)

    def times(self, factor: float) -> "Swing":
        """The same at frequencies `factor` times as high."""
        anti = None if self.anti_resonance is None else factor * self.anti_resonance
        return replace(self, resonance=factor * self.resonance, anti_resonance=anti)


def elastic_plant(
    m: float, f: float, h: float, swings: Sequence[Swing], actuator: Actuator | None = None,
    force: ForcePI | None = None, ratio: int = 1,
) -> tuple[Array, Array]:  # fmt: skip
    """(A, B) in z^-1 as of `design.linear.linear_plant`, of a body with elastic parts.

    m: the whole mass [kg]; f: viscous friction [N s/m]. With an actuator the input is the reference
    of its force loop, or its command where there is no such loop. Raises BadSpecification as there.
    """
    fast = check_period(h) / ratio
    A, b, c = _body(m, f, fast, swings)
    n = len(b)
    if actuator is None:
        step, entry = zoh_step(A, b, 1.0)
        return _seen(step, entry, c)
    # dF/dt = k1 u - k2 v, in periods.
    driven = np.zeros((n + 1, n + 1))
    driven[:n, :n], driven[:n, n] = A, b
    driven[n, :n] = -actuator.k2 * (c @ A)
    step, entry = zoh_step(driven, np.append(np.zeros(n), actuator.k1 * fast), 1.0)
    if force is None:
        return _seen(step, entry, np.append(c, 0.0))
    return _seen(*force_loop(step, entry, fast, force, ratio), np.append(c, (0.0, 0.0)))


def _seen(step: Array, entry: Array, c: Array) -> tuple[Array, Array]:
    # The numerator is a difference of polynomials: scaled, so that it is not lost in them.
    size = float(np.abs(np.linalg.matrix_power(step, len(step)) @ entry).max())
    unit = 1.0 / max(float(np.linalg.norm(c)) * size, 1e-300)
    A, B = transfer(step, entry, unit * c)
    return A, B / unit


def _body(m: float, f: float, h: float, swings: Sequence[Swing]) -> tuple[Array, Array, Array]:
    """A, b, c of x' = A x + b F, y = c x, v = c A x: time in periods of h [s]."""
    if not (m > 0 and f >= 0):
        raise BadSpecification(f"m = {m:g} kg, f = {f:g} N s/m: need m > 0 and f >= 0")
    zeros: Array = np.ones(1)
    poles: Array = np.ones(1)
    for one in swings:
        poles = _product(poles, _second(one.resonance, one.damping, h))
        if one.anti_resonance is not None:
            zeros = _product(zeros, _second(one.anti_resonance, one.anti_damping, h))
    below = np.polyadd(np.polymul([m / h**2, 0.0, 0.0], poles), np.polymul([f / h, 0.0], zeros))
    A, b, c, _ = (np.asarray(one, dtype=np.float64) for one in tf2ss(zeros, below))
    return A, b[:, 0], c[0]


def _product(a: Array, b: Array) -> Array:
    return np.asarray(np.polymul(a, b), dtype=np.float64)


def _second(hertz: float, damping: float, h: float) -> Array:
    """(s/w)^2 + 2 z s/w + 1 in s h."""
    w = 2.0 * math.pi * hertz * h
    return np.array([1.0 / w**2, 2.0 * damping / w, 1.0])
