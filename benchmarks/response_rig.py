"""Machines with friction and, half of them, a load behind a spring, moved in closed loop.

A simulator of its own, so that no model of the project agrees with itself: two masses in small
steps of symplectic Euler, Coulomb and viscous friction on the motor with a breakaway level, a
discrete controller on a noisy position, its command held. `truth` is the linear machine.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
SUBSTEPS = 24  # of a sample
SAMPLE = 5e-4  # s
MULTISINE_PERIOD = 4.0  # s


@dataclass(frozen=True)
class Machine:
    """m_1, m_2 [kg] (0: none), k [N/m], c [N s/m] between them; friction on the motor: Coulomb each
    way and breakaway [N], viscous each way [N s/m]; noise of position [m] and logged force [N]."""

    m_1: float
    m_2: float
    k: float
    c: float
    F_cp: float
    F_cn: float
    F_s: float
    F_vp: float
    F_vn: float
    noise_y: float
    noise_F: float
    bandwidth: float
    counts: float
    multisine: float

    @property
    def mass(self) -> float:
        return self.m_1 + self.m_2

    @property
    def resonance(self) -> float | None:
        """[Hz]"""
        if self.m_2 == 0.0:
            return None
        return float(np.sqrt(self.k * (1.0 / self.m_1 + 1.0 / self.m_2)) / (2.0 * np.pi))

    @property
    def anti_resonance(self) -> float | None:
        """[Hz]"""
        return None if self.m_2 == 0.0 else float(np.sqrt(self.k / self.m_2) / (2.0 * np.pi))

    def truth(self, f: Array) -> NDArray[np.complex128]:
        """Position of the motor over force at f [Hz], its friction viscous alone."""
        s = 2j * np.pi * f
        viscous = 0.5 * (self.F_vp + self.F_vn)
        own = self.m_1 * s**2 + viscous * s
        if self.m_2 > 0.0:
            link = self.c * s + self.k
            own = own + link * self.m_2 * s**2 / (self.m_2 * s**2 + link)
        return np.asarray(1.0 / own)


def machine(seed: int, compliant: bool) -> Machine:
    """A machine drawn by the seed."""
    rng = np.random.default_rng([seed, int(compliant)])
    mass = 10.0 ** rng.uniform(-0.3, 1.0)
    ratio = rng.uniform(0.3, 2.0)  # of load to motor
    f_a = 10.0 ** rng.uniform(np.log10(15.0), np.log10(70.0))
    zeta = 10.0 ** rng.uniform(-2.0, np.log10(0.05))
    m_1, m_2 = mass / (1.0 + ratio), mass * ratio / (1.0 + ratio)
    k = m_2 * (2.0 * np.pi * f_a) ** 2
    coulomb = mass * rng.uniform(0.5, 2.5)  # in N, of accelerations of 1 to 5 m/s^2
    both = coulomb * (1.0 + 0.2 * rng.uniform(-1.0, 1.0, 2))
    viscous = mass * rng.uniform(0.5, 4.0) * (1.0 + 0.15 * rng.uniform(-1.0, 1.0, 2))
    bandwidth = f_a * rng.uniform(0.1, 0.2) if compliant else rng.uniform(4.0, 12.0)
    return Machine(
        m_1 if compliant else mass, m_2 if compliant else 0.0, k if compliant else 0.0,
        2.0 * zeta * np.sqrt(k * m_2) if compliant else 0.0,
        both[0], both[1], float(max(both)) * rng.uniform(1.05, 1.5), viscous[0], viscous[1],
        noise_y=10.0 ** rng.uniform(-7.0, -5.7), noise_F=coulomb * rng.uniform(0.002, 0.02),
        bandwidth=bandwidth, counts=rng.choice([0.0, 1e-6, 5e-6]),
        multisine=rng.choice([0.0, 1.0, 1.0]) * 10.0 ** rng.uniform(-4.7, -4.0),
    )  # fmt: skip


def reference(rng: np.random.Generator, seconds: float, h: float, one: Machine) -> Array:
    """Moves between drawn places, trapezoids of velocity or S-curves with dwells, and in two of
    three machines a small multisine on top."""
    n = round(seconds / h)
    r = np.empty(0)
    here = 0.0
    smooth = rng.random() < 0.5
    while len(r) < n:
        there = rng.uniform(-0.12, 0.12)
        speed, acceleration = rng.uniform(0.08, 0.5), rng.uniform(1.0, 5.0)
        v = _move(there - here, speed, acceleration, h)
        if smooth:
            width = max(3, round(rng.uniform(0.02, 0.08) / h))
            v = np.convolve(v, np.ones(width) / width)
        dwell = np.full(round(rng.uniform(0.05, 0.5) / h), 0.0)
        r = np.concatenate([r, here + h * np.cumsum(np.concatenate([v, dwell]))])
        here = float(r[-1])
    r = r[:n]
    period = round(MULTISINE_PERIOD / h)
    highest = 2.5 * (one.resonance or 60.0)
    lines = np.arange(4, round(highest * MULTISINE_PERIOD))
    spectrum = np.zeros(period // 2 + 1, dtype=np.complex128)
    spectrum[lines] = np.exp(2j * np.pi * rng.random(len(lines)))
    tones = np.fft.irfft(spectrum, period)
    tones = np.tile(tones / np.std(tones), n // period + 1)[:n]
    size = one.multisine
    return np.asarray(r + size * tones)


def _move(distance: float, speed: float, acceleration: float, h: float) -> Array:
    """Velocity of a trapezoid over the distance."""
    top = min(speed, np.sqrt(abs(distance) * acceleration))
    rise = max(2, round(top / acceleration / h))
    flat = max(0, round((abs(distance) / top - top / acceleration) / h)) if top > 0 else 0
    up = np.linspace(0.0, 1.0, rise, endpoint=False)
    shape = np.concatenate([up, np.ones(flat), 1.0 - up])
    total = shape.sum() * h
    return np.asarray(shape * (distance / total if total > 0 else 0.0))


def gains(one: Machine, h: float) -> Array:
    """PID by its crossover [N/m, N s/m, N/(m s)], filter of the derivative, period, feedforward."""
    w = 2.0 * np.pi * one.bandwidth
    M = one.mass
    return np.array([0.4 * M * w**2, M * w, 0.06 * M * w**3, 1.0 / (6.0 * w), h, one.counts])


@njit(cache=True)
def _run(p: Array, g: Array, r: Array, noise: Array, substeps: int) -> Any:
    m_1, m_2, k, c, F_cp, F_cn, F_s, F_vp, F_vn = p
    k_p, k_d, k_i, tau, h, counts = g
    dt = h / substeps
    n = len(r)
    y, u = np.empty(n), np.empty(n)
    x_1 = x_2 = r[0]
    v_1 = v_2 = 0.0
    total = slope = 0.0
    last = r[0]
    for i in range(n):
        seen = x_1 + noise[i]
        if counts > 0.0:
            seen = counts * np.round(seen / counts)
        e = r[i] - seen
        if i > 0:
            slope += h / (tau + h) * ((e - last) / h - slope)
        last = e
        total += k_i * h * e
        F = k_p * e + k_d * slope + total
        y[i], u[i] = seen, F
        for _ in range(substeps):
            link = k * (x_1 - x_2) + c * (v_1 - v_2) if m_2 > 0.0 else 0.0
            drive = F - link
            if v_1 == 0.0 and abs(drive) <= F_s:
                pass
            else:
                way = 1.0 if v_1 > 0.0 or (v_1 == 0.0 and drive > 0.0) else -1.0
                friction = F_cp + F_vp * v_1 if way > 0.0 else -F_cn + F_vn * v_1
                before = v_1
                v_1 += dt * (drive - friction) / m_1
                if before * v_1 < 0.0 or (before == 0.0 and v_1 * way < 0.0):
                    v_1 = 0.0
            if m_2 > 0.0:
                v_2 += dt * link / m_2
            x_1 += dt * v_1
            x_2 += dt * v_2
    return y, u


@dataclass(frozen=True, eq=False)
class Record:
    """What is logged every h [s]: (n,) each."""

    h: float
    r: Array
    y: Array
    u: Array


def record(one: Machine, seed: int, seconds: float = 60.0, h: float = SAMPLE) -> Record:
    """A run of the machine in its loop."""
    rng = np.random.default_rng([seed, 77])
    r = reference(rng, seconds, h, one)
    noise = one.noise_y * rng.standard_normal(len(r))
    p = np.array([one.m_1, one.m_2, one.k, one.c, one.F_cp, one.F_cn, one.F_s, one.F_vp, one.F_vn])
    y, u = _run(p, gains(one, h), r, noise, SUBSTEPS)
    return Record(h, r, y, u + one.noise_F * rng.standard_normal(len(r)))
