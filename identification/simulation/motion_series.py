"""Motion between two switches as a power series in time, of degree 11 (compiled).

Tuples, not arrays, go to what runs in an event: arrays would be counted in and out of each call.
"""

import numpy as np

from identification.compiled import compiled, compiled_inline

Series = tuple[float, float, float, float, float, float, float, float, float, float, float, float]


@compiled_inline
def term(k: int, alpha: float, beta: float, before: float, last: float) -> float:
    """Coefficient k of the velocity's series from the two before it."""
    return -(beta * (1.0 / (k * (k - 1)))) * before - alpha * (1.0 / k) * last


@compiled_inline
def series(v: float, phi: float, g: float, alpha: float, beta: float, w: float) -> Series:
    """Power series in time of the velocity, of m v' = phi - f v, phi' = g - k2 v.

    alpha = f/m, beta = k2/m, w = 1/m.
    """
    c1 = w * phi - alpha * v
    c2 = 0.5 * (w * g - beta * v - alpha * c1)
    c3 = term(3, alpha, beta, c1, c2)
    c4 = term(4, alpha, beta, c2, c3)
    c5 = term(5, alpha, beta, c3, c4)
    c6 = term(6, alpha, beta, c4, c5)
    c7 = term(7, alpha, beta, c5, c6)
    c8 = term(8, alpha, beta, c6, c7)
    c9 = term(9, alpha, beta, c7, c8)
    c10 = term(10, alpha, beta, c8, c9)
    c11 = term(11, alpha, beta, c9, c10)
    return v, c1, c2, c3, c4, c5, c6, c7, c8, c9, c10, c11


@compiled_inline
def power_sum(c: Series, t: float) -> float:
    """Sum of c[k] t^k, by halves (Estrin), which is shorter than Horner's chain."""
    t2 = t * t
    t4 = t2 * t2
    low = (c[0] + c[1] * t) + (c[2] + c[3] * t) * t2
    middle = (c[4] + c[5] * t) + (c[6] + c[7] * t) * t2
    high = (c[8] + c[9] * t) + (c[10] + c[11] * t) * t2
    return low + (middle + high * t4) * t4


@compiled_inline
def motion(c: Series, t: float) -> tuple[float, float, float]:
    """Distance [m], velocity [m/s] and acceleration [m/s^2] of the series `c` at `t` [s]."""
    travel = (
        c[0],
        c[1] * (1.0 / 2.0),
        c[2] * (1.0 / 3.0),
        c[3] * (1.0 / 4.0),
        c[4] * (1.0 / 5.0),
        c[5] * (1.0 / 6.0),
        c[6] * (1.0 / 7.0),
        c[7] * (1.0 / 8.0),
        c[8] * (1.0 / 9.0),
        c[9] * (1.0 / 10.0),
        c[10] * (1.0 / 11.0),
        c[11] * (1.0 / 12.0),
    )
    slope = (
        c[1],
        2.0 * c[2],
        3.0 * c[3],
        4.0 * c[4],
        5.0 * c[5],
        6.0 * c[6],
        7.0 * c[7],
        8.0 * c[8],
        9.0 * c[9],
        10.0 * c[10],
        11.0 * c[11],
        0.0,
    )
    return t * power_sum(travel, t), power_sum(c, t), power_sum(slope, t)


@compiled_inline
def _quadratic_fall(value: float, slope: float, end: float, high: float) -> float:
    """Time at which the parabola of these values at 0 and `high`, slope at 0, falls through 0."""
    bend = (end - value - slope * high) / (high * high)
    root = np.sqrt(max(0.0, slope * slope - 4.0 * bend * value))
    tau = 2.0 * value / (root - slope) if slope <= 0.0 else (slope + root) / (-2.0 * bend)
    return tau if 0.0 < tau < high else 0.5 * high


@compiled
def time_of_fall(
    c: Series, at_0: float, g: float, k2: float, w: float, end: float, high: float
) -> tuple[float, float]:
    """Time in [0, high] at which at_0 + g t - k2 dy + w v falls through 0, and dy until then.

    end: the value at `high`, below 0. There is one such time: Newton within a bracket; the last
    correction is of second order.
    """
    value = at_0 + w * c[0]
    slope = g - k2 * c[0] + w * c[1]
    if value <= 0.0 and slope <= 0.0:
        return 0.0, 0.0
    tau, low, top = _quadratic_fall(value, slope, end, high), 0.0, high
    moved = 0.0
    for _ in range(80):
        moved, v, a = motion(c, tau)
        value = at_0 + g * tau - k2 * moved + w * v
        slope = g - k2 * v + w * a
        if value > 0.0:
            low = tau
        else:
            top = tau
        if slope < 0.0:
            change = -value / slope
            bend = change * (w * (c[2] + 3.0 * c[3] * tau) - 0.5 * k2 * a) / slope
            near = abs(change) <= 1e-5 * high and abs(bend) <= 1e-6
            if near or abs(change) <= 1e-15 + 1e-13 * high:
                change -= change * bend
                return tau + change, moved + change * (v + 0.5 * a * change)
            tau += change
        if slope >= 0.0 or not low < tau < top:
            tau = 0.5 * (low + top)
    return tau, moved


@compiled
def turning_point(c: Series, high: float) -> float:
    """Time in [0, high] at which the acceleration, negative at first, changes sign."""
    low = 0.0
    for _ in range(50):
        tau = 0.5 * (low + high)
        if motion(c, tau)[2] < 0.0:
            low = tau
        else:
            high = tau
    return 0.5 * (low + high)
