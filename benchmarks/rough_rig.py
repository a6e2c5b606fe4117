"""Rough machines of `sound_logs`: stick-slip, end stops, switched drives, by plain Euler steps."""

import numpy as np

from identification.arrays import Array
from identification.compiled import compiled
from identification.log import Log

KINDS = ("stick-slip", "stops", "switched", "servo", "pulses")
RATES = (50.0, 100.0, 200.0, 500.0, 1e3, 2e3, 5e3, 1e4)  # Hz
FINE, QUICKEST = 2e-5, 300.0  # s, m/s^2


@compiled
def run(p: Array, r: Array, F: Array, dt: float, sub: int) -> Array:
    """Position and driving force (2, n) of a body (m, Coulomb and breakaway force, speed of the
    Stribeck curve, viscous, stiffness and damping of its drive, place and bounce of its stops)."""
    m, f_c, f_s, v_s, f_v, k, c, stop, bounce = p
    out = np.zeros((2, len(r)))
    y, v = 0.0, 0.0
    for i in range(len(r)):
        out[0, i], drive = y, 0.0
        for _ in range(sub):
            drive = k * (r[i] - y) - c * v + F[i]
            if v == 0.0 and abs(drive) <= f_s:
                continue
            way = np.sign(drive) if v == 0.0 else np.sign(v)
            friction = way * (f_c + (f_s - f_c) * np.exp(-abs(v) / v_s)) + f_v * v
            after = v + dt * (drive - friction) / m
            v = 0.0 if after * v < 0.0 else after
            y += dt * v
            if abs(y) > stop and v * y > 0.0:
                y, v = np.sign(y) * stop, -bounce * v
        out[1, i] = drive
    return out


def rough(kind: str, rng: np.random.Generator) -> Log:
    """One log of a rough machine."""
    rate = float(rng.choice(RATES))
    n = int(min(max(20 * rate, 1500), 100_000))
    t = np.arange(n) / rate
    m, f_c = np.exp(rng.uniform(-3.0, 3.0)), np.exp(rng.uniform(0.0, 3.7))
    f_s = f_c * rng.uniform(1.05, 2.5)
    r, F = np.zeros(n), np.zeros(n)
    k, c, stop, bounce = 0.0, 0.0, 0.4, rng.uniform(0.0, 0.8)
    pulse = max(1, round(rate / 20))
    if kind == "stick-slip":
        k, stop = m * (2 * np.pi * rng.uniform(2, 80)) ** 2, 1e9
        r = np.exp(rng.uniform(-7.0, -2.3)) * np.abs((t + 0.25 * t[-1]) % t[-1] - 0.5 * t[-1])
        r -= r[0]  # the spring begins slack
    elif kind == "stops":
        stop = rng.uniform(0.01, 0.1)
        F = f_s * rng.uniform(1.5, 6) * np.sign(np.sin(2 * np.pi * rng.uniform(0.1, 2) * t))
    elif kind == "switched":
        F = f_s * rng.uniform(1.5, 8) * rng.choice([-1, 0, 1], n // pulse + 1).repeat(pulse)[:n]
    elif kind == "servo":
        k, stop = m * (2 * np.pi * rng.uniform(3, 25)) ** 2, 1e9
        c = 1.4 * np.sqrt(k * m)
        r = rng.uniform(-0.1, 0.1, 200)[np.minimum((t / rng.uniform(0.3, 1.5)).astype(int), 199)]
    else:
        for first in rng.integers(10, n - 10, rng.integers(1, 12)):
            last = first + max(1, int(rng.uniform(0.005, 0.05) * rate))
            F[first:last] = rng.choice([-1, 1]) * f_s * rng.uniform(2, 20)
    hardest = (np.max(np.abs(F)) + 3 * f_s + k * np.ptp(r) * (kind == "servo")) / m
    m *= max(1.0, hardest / QUICKEST)
    dt = min(FINE, 0.25 / rate)
    p = np.array(
        [m, f_c, f_s, rng.uniform(0.001, 0.05), rng.uniform(0, 50) * m, k, c, stop, bounce]
    )
    y, force = run(p, r, F, dt, round(1.0 / rate / dt))
    return recorded(f"{kind}, {rate:g} Hz", t, y, force + 1e-2 * f_s * rng.choice([0, 0.1, 1.0])
                    * rng.standard_normal(n), rng)  # fmt: skip


def recorded(name: str, t: Array, y: Array, F: Array, rng: np.random.Generator) -> Log:
    """The log behind a transducer of some noise and count."""
    noise = rng.choice([0.0, 1e-6, 1e-5, 1e-4]) * min(1.0, 20.0 * float(np.ptp(y)))
    tails = np.clip(rng.standard_t(4, len(y)), -8, 8)
    y = y + noise * (tails if rng.random() < 0.4 else rng.standard_normal(len(y)))
    count = float(rng.choice([0.0, 1e-6, 1e-5, 1e-4, 1e-3]))
    if 0.0 < 20.0 * count < np.ptp(y):
        y = count * np.round(y / count)
    return Log(f"{name}, noise {noise:.0e} m, count {count:g} m", {"t": t, "y": y, "F": F})
