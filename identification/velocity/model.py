"""Velocity that follows the command: a dead zone and a gain each way, a delay and a lag."""

from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np
from scipy.signal import lfilter

from identification.arrays import Array

NUMBERS = ("g_p", "g_n", "d_p", "d_n", "delay", "lag")  # of the plain model
SHORTEST_LAG = 1e-6  # s; below every sampling period, and exp(-h/lag) is 0


@dataclass(frozen=True)
class Valve:
    """lag v' + v = w(t - delay), w = g_p max(u - d_p, 0) - g_n max(-u - d_n, 0).

    g_p, g_n [m/s (rad/s) per unit of u]; d_p, d_n [unit of u]; delay, lag [s]. What a richer
    structure adds, each 0 here: curve_p, curve_n: w of each way times 1 + curve (|u| - d)/u_max;
    lag_other: the lag of the negative way over that of the positive, less 1; second_lag: a second
    lag in series, over the first, below 1; creep: velocity that no command gives [m/s]; place: w
    times 1 + place z, z the place in the travel from -0.5 to 0.5.
    """

    g_p: float
    g_n: float
    d_p: float
    d_n: float
    delay: float
    lag: float
    curve_p: float = 0.0
    curve_n: float = 0.0
    lag_other: float = 0.0
    second_lag: float = 0.0
    creep: float = 0.0
    place: float = 0.0


NAMES_OF_VALVE = tuple(one.name for one in fields(Valve))


class Motion(NamedTuple):
    """Position, from 0 at the first sample, and velocity of a run, each (n,) at its samples."""

    y: Array
    v: Array


def flows(u: Array, valve: Valve, u_max: float, z: Array | None = None) -> tuple[Array, Array]:
    """The velocity [m/s] that each way of the valve gives under u (n,), both from 0 up.

    u_max: what curves are relative to, in the unit of u; z: place in the travel (n,).
    """
    x_p = np.maximum(u - valve.d_p, 0.0)
    x_n = np.maximum(-u - valve.d_n, 0.0)
    w_p = valve.g_p * x_p * (1.0 + valve.curve_p * x_p / u_max)
    w_n = valve.g_n * x_n * (1.0 + valve.curve_n * x_n / u_max)
    if z is None or valve.place == 0.0:
        return w_p, w_n
    factor = 1.0 + valve.place * z
    return w_p * factor, w_n * factor


def lagged(w: Array, h: float, delay: float, lag: float) -> Motion:
    """Position and velocity behind a delay and a lag [s], exact for w (n,) constant over h [s].

    Before the first sample w is what it is there, and the velocity follows it.
    """
    whole = int(np.floor(delay / h))
    early = delay - whole * h  # of each period, under the sample before
    late = h - early
    lag = max(lag, SHORTEST_LAG)
    w_late = np.concatenate([np.full(min(whole, len(w)), w[0]), w[: max(len(w) - whole, 0)]])
    w_early = np.concatenate([[w[0]], w_late[:-1]])
    decay = np.exp(-h / lag)
    kept = np.exp(-late / lag)
    gain_early, gain_late = kept - decay, 1.0 - kept
    drive = gain_early * w_early[:-1] + gain_late * w_late[:-1]
    rest = lfilter([1.0], [1.0, -decay], drive, zi=np.array([decay * w[0]]))[0]
    v = np.concatenate([[w[0]], rest])
    flow = np.concatenate([[0.0], np.cumsum(early * w_early[:-1] + late * w_late[:-1])])
    # lag v' + v = w, integrated: what the lag holds back is lag (v - v_0).
    return Motion(flow - lag * (v - v[0]), v)


def _through(w: Array, h: float, valve: Valve, lag: float) -> Motion:
    """As `lagged`, through the second lag too: two lags in series are a sum of both."""
    first, share = lagged(w, h, valve.delay, lag), valve.second_lag
    if share == 0.0:
        return first
    second = lagged(w, h, valve.delay, share * lag)
    return Motion(*((a - share * b) / (1.0 - share) for a, b in zip(first, second, strict=True)))


def moved(u: Array, h: float, valve: Valve, u_max: float, z: Array | None = None) -> Motion:
    """The motion under u (n,) constant over each period h [s]; u_max, z: as in `flows`."""
    w_p, w_n = flows(u, valve, u_max, z)
    if valve.lag_other == 0.0:
        y, v = _through(w_p - w_n, h, valve, valve.lag)
    else:
        p = _through(w_p, h, valve, valve.lag)
        n = _through(w_n, h, valve, valve.lag * (1.0 + valve.lag_other))
        y, v = p.y - n.y, p.v - n.v
    return Motion(y + valve.creep * h * np.arange(len(u)), v + valve.creep)
