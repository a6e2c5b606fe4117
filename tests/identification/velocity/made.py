"""Logs of a valve and cylinder whose truth is known, made without the package's own model."""

import numpy as np

from identification.arrays import Array
from identification.log import Log
from identification.velocity.model import Valve

TRUE = Valve(g_p=0.06, g_n=0.045, d_p=0.8, d_n=1.1, delay=0.06, lag=0.08)
FINE = 20  # steps of the truth in a period


def command(rng: np.random.Generator, h: float, duration: float, size: float = 5.0) -> Array:
    """What a driver gives: smooth both ways, with rests and steps, held over h [s]."""
    n = round(duration / h)
    t = h * np.arange(n)
    u = np.zeros(n)
    for _ in range(6):
        f = rng.uniform(0.05, 0.6)
        u += np.sin(2.0 * np.pi * (f * t + rng.uniform()))
    u *= size / 3.0
    for start in rng.uniform(0.0, duration - 1.5, round(duration / 8.0)):
        at = (t >= start) & (t < start + rng.uniform(0.5, 1.5))
        u[at] = rng.choice([0.0, 0.6 * size, -0.6 * size])
    return np.clip(u, -size, size)


def moved_finely(u: Array, h: float, valve: Valve, travel: float = 0.3) -> Array:
    """The position (n,) by steps of h/FINE: Euler's, of the equation as it is written.

    travel [m]: over which `valve.place` changes the gain.
    """
    step, most = h / FINE, float(np.max(np.abs(u)))
    fine = np.repeat(u, FINE)
    x_p, x_n = np.maximum(fine - valve.d_p, 0.0), np.maximum(-fine - valve.d_n, 0.0)
    ways = (
        valve.g_p * x_p * (1.0 + valve.curve_p * x_p / most),
        valve.g_n * x_n * (1.0 + valve.curve_n * x_n / most),
    )
    late = round(valve.delay / step)
    w_p, w_n = (np.concatenate([np.full(late, w[0]), w])[: len(w)] for w in ways)
    share = [1.0 - np.exp(-step / (valve.lag * k)) for k in (1.0, 1.0 + valve.lag_other)]
    second = 1.0 - np.exp(-step / max(valve.lag * valve.second_lag, 1e-9))
    y = np.empty_like(w_p)
    place, p, n, p2, n2 = 0.0, w_p[0], w_n[0], w_p[0], w_n[0]
    for k in range(len(y)):
        y[k], old = place, p2 - n2
        p, n = p + share[0] * (w_p[k] - p), n + share[1] * (w_n[k] - n)
        p2, n2 = p2 + second * (p - p2), n2 + second * (n - n2)
        speed = 0.5 * (old + p2 - n2) * (1.0 + valve.place * place / travel)
        place += step * (speed + valve.creep)
    return y[::FINE]


def made(
    seed: int, valve: Valve = TRUE, *, h: float = 0.01, duration: float = 40.0,
    noise: float = 0.2e-3, step: float = 0.0, zoh: int = 1, u: Array | None = None,
) -> Log:  # fmt: skip
    """A log; noise [m] white, step [m] of an encoder, held: samples for which y is held."""
    rng = np.random.default_rng(seed)
    u = command(rng, h, duration) if u is None else u
    y = moved_finely(u, h, valve)
    y = y + noise * rng.standard_normal(len(y))
    if step:
        y = step * np.round(y / step)
    y = y[zoh * (np.arange(len(y)) // zoh)]
    y = np.asarray(y, dtype=np.float64)
    return Log(f"valve_{seed}", {"t": h * np.arange(len(y), dtype=np.float64), "u": u, "y": y})
