"""A sub-step of a body held by a bristle in place of sticking (compiled)."""

import math

from identification.arrays import Array
from identification.compiled import call_value, compiled, compiled_inline
from identification.simulation.karnopp_step import K2, M, Parameters

# Damping ratio of the micro-motion on a bristle: without it a body at rest would ring on. LuGre's
# sigma_1 = 2 MICRO_DAMPING sqrt(sigma_0 m) is its authors' choice (IEEE TAC 40 (1995), table I).
MICRO_DAMPING = 0.5
ITERATIONS = 8  # most, of a bristle's mean slope within a sub-step
SLOPE_SHARE = 1e-3  # of the level, by which the slope of a bristle is differentiated


@compiled
def bristle_slopes(
    address: int, q: Array, s: Array, z: float, c: float, t: float, y: float, v: float, F: float,
    u: float, d: float,
) -> tuple[float, float, float]:  # fmt: skip
    """Slope dF/dy of a bristle at z, its derivative by z, and its slope without load."""
    x = (t, y, v, F, u, d, z, c, c)
    beside = (t, y, v, F, u, d, z - d * SLOPE_SHARE * c, c, c)
    free = (t, y, v, F, u, d, 0.0, c, c)
    slope = call_value(address, x, s.ctypes.data, q.ctypes.data)
    change = slope - call_value(address, beside, s.ctypes.data, q.ctypes.data)
    return (
        slope,
        change / (d * SLOPE_SHARE * c),
        max(call_value(address, free, s.ctypes.data, q.ctypes.data), 1e-300),
    )


@compiled_inline
def mean_slope(slope: float, bend: float, moved: float) -> float:
    """Mean of the slope over a way `moved`: exact where it is linear in z, as Dahl's."""
    x = min(bend * moved, 1.0)
    return slope * (1.0 + 0.5 * x if abs(x) < 1e-6 else math.expm1(x) / x)


@compiled
def bristle_step(
    p: Parameters, address: int, q: Array, s: Array, z: float, c: float,
    at: tuple[float, float, float, float, float, float], y: float, v: float, F: float, g: float,
    viscous: float, extra: float, k_e: float, dt: float,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Position, velocity, force and elastic friction after dt, by the trapezoidal rule.

    m v' = F + extra - k_e dy - (viscous + damping) v - z, z' = slope(z) v, F' = g - k2 v; `at`: t,
    y, v, F, u and direction at which the bristle's law is taken. Over a cycle it only takes energy.
    """
    m, k2, half = p[M], p[K2], 0.5 * dt
    t, ym, vm, Fm, u, d = at
    slope, bend, free = bristle_slopes(address, q, s, z, c, t, ym, vm, Fm, u, d)
    stiffness, v_next, moved = slope, v, 0.0
    for i in range(ITERATIONS):
        damping = 2.0 * MICRO_DAMPING * math.sqrt(free * m) * max(stiffness, 0.0) / free
        resisting = viscous + damping
        drive = F + extra - z - resisting * v
        # v1 = v + half (drive + drive1)/m with F1 - z1 = F - z + dt g - half (k2 + k_e + K)(v + v1)
        elastic = half * (k2 + k_e + stiffness)
        top = m * v + half * (drive + F + extra - z + dt * g - elastic * v)
        before = moved
        v_next = top / (m + half * (resisting + elastic))
        moved = half * (v + v_next)
        if moved * d < 0.0 and i == 0:
            d = -d
            slope, bend, free = bristle_slopes(address, q, s, z, c, t, ym, vm, Fm, u, d)
        stiffness = mean_slope(slope, bend, moved)
        if i > 0 and abs(moved - before) <= 1e-9 * abs(moved):
            break
    return y + moved, v_next, F + g * dt - k2 * moved, z + stiffness * moved
