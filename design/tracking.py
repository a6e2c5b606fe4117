"""How a controller takes its reference: T, and a limit of the reference's speed.

Ours. T does not touch the margins. Where T is the number P(1)/B(1), y lags the reference by every
closed-loop pole; where T = R, the zeros of R make a step overshoot and ask for more force than a
machine has. So an RST's T cancels slow poles and a PID has set-point weights, as much of both as
keeps the overshoot of a step. What a large step would ask of the drive is kept off it by moving
the reference at the speed that the drive can follow: a smooth one, being slower, is not touched.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.signal import lfilter

from design.pid import PIDGains, pid_to_rst
from design.polynomial import ComplexArray
from design.rst import RST, closed_loop, closed_loop_poles
from identification.arrays import Array

LEAST_POLES = 2  # closed-loop poles that y/r keeps: fewer ask for a jump of the velocity
LEADS = 11  # parts of the lag tried that T takes off by a lead, 0 to 1
WEIGHTS = 21  # set-point weights b tried, 0 to 1
DERIVATIVE_WEIGHTS = (0.0, 0.5, 1.0)  # c
LAG_WEIGHT = 2.0  # the lag is paid on every motion, a limited speed on the largest step only
RESPONSE_LENGTH = 12.0  # time constants of the slowest pole; then a response has ended
MOST_SAMPLES = 20_000
NEGLIGIBLE = 1e-3  # |z| of a pole that is over within a sample

Plants = Sequence[tuple[Array, Array]]


@dataclass(frozen=True)
class Demand:
    """What the reference may ask for, on top of friction and of what stands still.

    step: the largest change [m]; overshoot: relative to a step, at most; force: [N] at most, None
    for no bound; command: [V] at most, of which the force loop takes per_jump [V/N] of a sample's
    change of the force and per_speed [V s/m] of the body's velocity.
    """

    step: float = 1.0
    overshoot: float = 0.05
    force: float | None = None
    command: float | None = None
    per_jump: float = 0.0
    per_speed: float = 0.0


@dataclass(frozen=True, eq=False)
class Followed:
    """T, the largest speed of the reference [m/s] (None: any), overshoot of a step [-], lag [s].

    lag: of y behind a reference of constant speed.
    """

    T: Array
    rate: float | None
    overshoot: float
    lag: float


class _Loop(NamedTuple):
    """A plant, the closed loop P on it and the samples after which a response has ended."""

    A: Array
    B: Array
    P: Array
    samples: int


def followed(
    plants: Plants, controller: RST, candidates: Iterable[Array], demand: Demand
) -> Followed:
    """The best T of the candidates that keep the overshoot; where none does, that with the least.

    Best: least lag (twice) and mean delay of the demand's step. plants: (A, B), the nominal one
    first; overshoot and force are the worst over those on which the loop is stable.
    """
    loops = [loop for A, B in plants if (loop := _loop(A, B, controller))]
    found = [_judged(loops, T, controller.h, demand) for T in candidates]
    admissible = [one for one in found if one.overshoot <= demand.overshoot]
    if not admissible:
        return min(found, key=lambda one: one.overshoot)
    return min(admissible, key=lambda one: LAG_WEIGHT * one.lag + _travel(demand.step, one.rate))


def rst_candidates(
    A: Array, B: Array, controller: RST, poles: ComplexArray, most: int
) -> Iterator[Array]:
    """T of degree `most` or less that cancel none, one, two ... of the slowest poles z.

    Each as it is, and with a zero that takes off a part of the lag that is left.
    """
    static = static_gain(A, B, controller)
    fixed = _delay(B) - _delay(closed_loop(A, B, controller))
    for T in _cancelling(poles, most):
        lag = fixed + _delay(T)  # in samples
        room = lag > 0 and T.size <= most
        for part in np.linspace(0.0, 1.0, LEADS) if room else (0.0,):
            yield static * np.convolve(T, [1.0 + part * lag, -part * lag] if part else [1.0])


def pid_candidates(gains: PIDGains, h: float) -> Iterator[Array]:
    """T of a PID of these gains with set-point weights b and c from 0 to 1."""
    for b in np.linspace(0.0, 1.0, WEIGHTS).tolist():
        for c in DERIVATIVE_WEIGHTS:
            yield pid_to_rst(gains.k_R, gains.T_i, gains.T_d, gains.eps, h, b=b, c=c).T


def static_gain(A: Array, B: Array, controller: RST) -> float:
    """The T(1) for which y = r at rest: R(1) where the loop integrates, else P(1)/B(1)."""
    if integrates(A, controller):
        return float(controller.R.sum())
    return float(closed_loop(A, B, controller).sum()) / float(B.sum())


def integrates(A: Array, controller: RST) -> bool:
    """Whether the loop gain is infinite at frequency 0."""
    size = float(np.abs(A).sum() * np.abs(controller.S).sum())
    return abs(float(A.sum() * controller.S.sum())) < 1e-9 * size


def _travel(step: float, rate: float | None) -> float:
    """Mean delay [s] of a step that is taken at a limited speed."""
    return 0.0 if rate is None else 0.5 * step / rate


def _delay(c: Array) -> float:
    """Delay [samples] of the filter c(z^-1) at frequency 0."""
    return float(np.arange(c.size) @ c) / float(c.sum())


def _cancelling(poles: ComplexArray, most: int) -> Iterator[Array]:
    """Polynomials of gain 1 at z = 1 that cancel none, one, two ... of the slowest poles."""
    factors = _factors(poles)
    left = sum(factor.size - 1 for factor in factors)
    T = np.ones(1)
    yield T
    for factor in factors:
        left -= factor.size - 1
        if left < LEAST_POLES or T.size - 1 + factor.size - 1 > most:
            return
        T = np.convolve(T, factor / factor.sum())
        yield T


def _factors(poles: ComplexArray) -> list[Array]:
    """The real factors 1 - z_i z^-1 of the poles, pairs as one, the slowest first."""
    upper = [complex(z) for z in poles if z.imag >= 0 and abs(z) > NEGLIGIBLE]
    return [
        np.array([1.0, -z.real]) if z.imag == 0 else np.array([1.0, -2 * z.real, abs(z) ** 2])
        for z in sorted(upper, key=abs, reverse=True)
    ]


def _loop(A: Array, B: Array, controller: RST) -> _Loop | None:
    """The loop on a plant, None where it is unstable."""
    P = closed_loop(A, B, controller)
    radius = float(np.abs(closed_loop_poles(A, B, controller)[:1]).max(initial=NEGLIGIBLE))
    if radius >= 1.0:
        return None
    length = max(-RESPONSE_LENGTH / math.log(radius), 4.0 * P.size)
    return _Loop(A, B, P, int(min(length, MOST_SAMPLES)))


def _judged(loops: Sequence[_Loop], T: Array, h: float, demand: Demand) -> Followed:
    """T on these loops, the first being the nominal one."""
    overshoot, force, jump = 0.0, 0.0, 0.0
    for loop in loops:
        y, F = _step(loop, T)
        overshoot = max(overshoot, float(y.max()) - 1.0)
        # A reference of unit speed is the sum of steps of h.
        force = max(force, h * float(np.max(np.abs(np.cumsum(F)))))
        jump = max(jump, h * float(np.max(np.abs(F))))
    limits = [] if demand.force is None else [demand.force / force]
    if demand.command is not None:
        limits.append(demand.command / (demand.per_jump * jump + demand.per_speed))
    nominal = loops[0]
    lag = h * (_delay(nominal.B) + _delay(T) - _delay(nominal.P))
    return Followed(T, min(limits, default=None), overshoot, lag)


def _step(loop: _Loop, T: Array) -> tuple[Array, Array]:
    """Output and input of the loop at a unit step of the reference under T, until settled."""
    one = np.ones(loop.samples)
    y, u = (
        np.asarray(lfilter(np.convolve(c, T), loop.P, one), dtype=np.float64)
        for c in (loop.B, loop.A)
    )
    return y, u
