"""A linear body in a noisy loop: what is logged of it, and its true response."""

import numpy as np
from scipy.signal import cont2discrete

from identification.arrays import Array
from identification.frequency.machine import Recording
from identification.frequency.stretches import ComplexArray

H = 1e-3
M_1, M_2, HERTZ, DAMPING, VISCOUS = 2.0, 1.5, 30.0, 0.03, 5.0
STIFFNESS = M_2 * (2.0 * np.pi * HERTZ) ** 2
DRAG = 2.0 * DAMPING * np.sqrt(STIFFNESS * M_2)
RESONANCE = HERTZ * np.sqrt(1.0 + M_2 / M_1)
GAINS = (4000.0, 120.0)  # of the loop [N/m, N s/m]


def true_position(f: Array, two: bool = True) -> ComplexArray:
    """Position over force [m/N] of the first of two masses, or of one of the weight of both."""
    s = 2j * np.pi * f
    link = DRAG * s + STIFFNESS
    load = link * M_2 * s**2 / (M_2 * s**2 + link) if two else M_2 * s**2
    return np.asarray(1.0 / (M_1 * s**2 + VISCOUS * s + load))


def controller(f: Array) -> ComplexArray:
    """From position to the force that counters it [N/m], sampled."""
    return np.asarray(GAINS[0] + GAINS[1] / H * (1.0 - np.exp(-2j * np.pi * f * H)))


def logged(
    seed: int, seconds: float = 40.0, noise: float = 1e-6, *, two: bool = True, h: float = H,
    forward: float = 1.0,
) -> Recording:  # fmt: skip
    """A run of the body under its loop's held force, noise on the position that the loop sees.

    forward: share of the reference that the loop compares the position with.
    """
    rng = np.random.default_rng(seed)
    n = round(seconds / h)
    steps = np.repeat(rng.uniform(-0.02, 0.02, n // 400 + 1), 400)[:n]
    ramp = np.convolve(steps, np.ones(150) / 150, "same")
    r = ramp + 2e-5 * rng.standard_normal(n)
    k, c = (STIFFNESS, DRAG) if two else (0.0, 0.0)
    m_1 = M_1 if two else M_1 + M_2
    a = np.array([
        [0, 1, 0, 0], [-k / m_1, -(c + VISCOUS) / m_1, k / m_1, c / m_1],
        [0, 0, 0, 1], [k / M_2, c / M_2, -k / M_2, -c / M_2],
    ])  # fmt: skip
    step, entry, *_ = cont2discrete(
        (a, np.array([[0], [1 / m_1], [0], [0]]), np.eye(4), np.zeros((4, 1))), h, "zoh"
    )
    x, y, F = np.zeros(4), np.empty(n), np.empty(n)
    before = r[0]
    for i in range(n):
        y[i] = x[0] + noise * rng.standard_normal()
        e = forward * r[i] - y[i]
        F[i] = GAINS[0] * e + GAINS[1] / H * (e - before)
        before = e
        x = step @ x + entry[:, 0] * F[i]
    return Recording(h, y, F, F, r, True)
