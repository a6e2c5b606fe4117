"""Steps of the Karnopp plant with effects (compiled): any effects, no new compilation.

Within a sub-step the effects' forces are those at its predicted middle, and the plant with these
forces and levels is stepped exactly, switches included (`karnopp_step`): second order in the step.
States evolve half before it and half after, both times under what holds at the middle. With a
bristle in place of sticking, mass, bristle and actuator are stepped by the trapezoidal rule, the
bristle's own law by an exponential (`bristle_step`).
"""

import numpy as np

from identification.arrays import Array, IntArray
from identification.compiled import call_evolve, call_value, compiled, compiled_inline
from identification.simulation.bristle_step import bristle_step
from identification.simulation.effect_forces import (
    STATES,
    at_hand,
    direction,
    evolve_states,
    forces_along,
    level_on_bristle,
    row_at,
    total,
    with_friction,
)
from identification.simulation.effect_table import EVOLVE, ON_ACTUATOR, ON_COMMAND, VALUE
from identification.simulation.karnopp_step import (
    DV_N,
    DV_P,
    K2,
    MAX_EVENTS,
    SLIP_N,
    SLIP_P,
    STUCK,
    Parameters,
    glided,
    mode_at,
    resolve_until,
)

AWAY = 2.0  # times the band, beyond which a body that speeds up cannot come to rest
ROUNDED = 1.0 + 1e-9  # of a sub-step, that the last one may be too long
MOST_PIECES = 100  # of a sample, after which its switches are no longer distinguished
SURE_AFTER = 1e-3  # of a sub-step, after which its acceleration is sure
# y, v, F, mode, last acceleration
State = tuple[float, float, float, int, float]


@compiled_inline
def effect_step(
    p: Parameters,
    count: int,
    codes: IntArray,
    addresses: IntArray,
    q: Array,
    s: Array,
    z: Array,
    spare: Array,
    bristle: int,
    t: float,
    state: State,
    u: float,
    g: float,
    h: float,
) -> State:
    """State after `h` [s] in `count` sub-steps and as many more as there are switches.

    g: k1 u, or the force's slope with k2 = 0; spare (k,): to work in.
    """
    y, v, F, mode, a = state
    acts = at_hand(codes, addresses)
    left, longest, pieces = h, h / count, 0
    while left > 0.0:
        dt = left if left < ROUNDED * longest else longest
        pieces += 1
        now = t + (h - left) + 0.5 * dt
        still = mode == STUCK
        rest = still and bristle < 0
        vm = 0.0 if rest else v + 0.5 * dt * a
        if vm * v < 0.0:
            vm = 0.0
        ym = y + 0.5 * dt * v
        way = direction(v, F)
        early = 0.0
        if acts & (1 << ON_ACTUATOR):
            early = total(ON_ACTUATOR, codes, addresses, q, s, z, p, now, y, v, F, u, way, rest)
        Fm = F + 0.5 * dt * (g + early - p[K2] * v)
        way = direction(v, Fm)
        if acts & STATES:
            spare[:] = z
            evolve_states(False, 0.5 * dt, codes, addresses, q, s, z, p, now, ym, vm, Fm, u, still)
        way_on = 2.0 * (ym - y)
        at_start = (now, y, vm, Fm, u)
        extra, k_e = forces_along(acts, codes, addresses, q, s, z, p, at_start, way_on, way, rest)
        g_now = g
        if acts & (1 << ON_ACTUATOR):
            g_now += total(ON_ACTUATOR, codes, addresses, q, s, z, p, now, ym, vm, Fm, u, way, rest)
        y_0, before, F_0, unused = y, v, F, 0.0
        if bristle >= 0:
            d = direction(vm, z[bristle])
            at = (now, ym, vm, Fm, u, d)
            c, viscous = level_on_bristle(acts, codes, addresses, q, s, z, p, at)
            y, v, F, z[bristle] = bristle_step(
                p, addresses[bristle, VALUE], q[bristle], s[bristle], z[bristle], c, at, y, v, F,
                g_now, viscous, extra, k_e, dt,
            )  # fmt: skip
            mode = STUCK if p[DV_N] < v < p[DV_P] else (SLIP_P if v > 0.0 else SLIP_N)
        else:
            slowest, fastest = min(v, v + 2.0 * dt * a), max(v, v + 2.0 * dt * a)
            slow = slowest < AWAY * p[DV_P], fastest > AWAY * p[DV_N]
            at_middle = (now, ym, vm, Fm, u)
            shifted = with_friction(acts, codes, addresses, q, s, z, p, at_middle, slow, k_e)
            mode = mode_at(shifted, v, F + extra)
            if still and mode != STUCK:  # what friction owes to the rest goes with the first motion
                if acts & STATES:
                    z[:] = spare
                continue
            v = 0.0 if mode == STUCK else v
            moved, after, on = glided(shifted, v, F + extra, mode, g_now, dt)
            if on:
                y, v = y + moved, after
            else:
                most = 1 if pieces < MOST_PIECES else MAX_EVENTS
                y, v, _, mode, unused = resolve_until(
                    shifted, y, v, F + extra, mode, g_now, dt, most
                )
                if unused > 0.0 and (most > 1 or not np.isfinite(y)):
                    y, unused = np.nan, 0.0  # as in `resolve`
            F += g_now * (dt - unused) - p[K2] * (y - y_0)
        dt -= unused
        left -= dt
        if mode == STUCK and bristle < 0:
            a = 0.0
        elif dt > SURE_AFTER * longest:
            a = (v - before) / dt
        if not acts & STATES:
            continue
        ym, vm, Fm = 0.5 * (y_0 + y), 0.5 * (before + v), 0.5 * (F_0 + F)
        if unused > 0.0:
            z[:] = spare
        else:
            dt, still = 0.5 * dt, mode == STUCK
        evolve_states(False, dt, codes, addresses, q, s, z, p, now, ym, vm, Fm, u, still)
    return y, v, F, mode, a


@compiled
def acting_command(
    codes: IntArray, addresses: IntArray, q: Array, s: Array, z: Array, t: float, u: float, h: float
) -> float:
    """Command that reaches the actuator in place of `u` [V], constant over h [s]; z (k,) goes
    on."""
    for i in range(len(codes)):
        if codes[i] == ON_COMMAND:
            d, given = 1.0 if u >= 0.0 else -1.0, u
            x = (t, 0.0, 0.0, 0.0, given, d, z[i], 0.0, 0.0)
            u = float(call_value(addresses[i, VALUE], x, row_at(s, i), row_at(q, i)))
            if addresses[i, EVOLVE] != 0:
                step = (h, t, 0.0, 0.0, 0.0, given, d, z[i], 0.0, 0.0)
                z[i] = call_evolve(addresses[i, EVOLVE], step, row_at(s, i), row_at(q, i))
    return u


@compiled
def delayed(history: Array, k: int, late: float) -> float:
    """Mean over sample k of the zero-order-hold command (n,) that is `late` samples old."""
    whole = int(np.floor(late))
    part = late - whole
    newer: float = history[max(k - whole, 0)]
    older: float = history[max(k - whole - 1, 0)]
    return (1.0 - part) * newer + part * older
