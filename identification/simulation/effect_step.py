"""Steps of the Karnopp plant with effects (compiled): any effects, no new compilation.

Within a sub-step the effects' forces are those at its predicted middle, and the plant with these
forces and levels is stepped exactly, switches included (`karnopp_step`): second order in the step.
States evolve half before it and half after, both times under what holds at the middle. With a
bristle in place of sticking, mass, bristle and actuator are stepped by the trapezoidal rule, the
bristle's own law by an exponential (`bristle_step`).
"""

import math

import numpy as np

from identification.arrays import Array, IntArray
from identification.compiled import call_evolve, call_value, compiled, compiled_inline
from identification.simulation.bristle_step import bristle_step
from identification.simulation.effect_table import (
    EVOLVE,
    INITIAL,
    ON_ACTUATOR,
    ON_COMMAND,
    ON_FORCE,
    ON_FRICTION,
    ON_SENSOR,
    ON_SLIP,
    ON_STICTION,
    VALUE,
)
from identification.simulation.karnopp_step import (
    DV_N,
    DV_P,
    F_CN,
    F_CP,
    F_SN,
    F_SP,
    F_VN,
    F_VP,
    K1,
    K2,
    MAX_EVENTS,
    SLIP_N,
    SLIP_P,
    STUCK,
    M,
    Parameters,
    glided,
    resolve_until,
    settled_mode,
)

SHORTEST_WAY = 1e-9  # m, over which a force's slope is still sure
AWAY = 2.0  # times the band, beyond which a body that speeds up cannot come to rest
STATES = 1 << 9  # beside the bits of the codes
ROUNDED = 1.0 + 1e-9  # of a sub-step, that the last one may be too long
MOST_PIECES = 100  # of a sample, after which its switches are no longer told from each other
SURE_AFTER = 1e-3  # of a sub-step, after which its acceleration is sure
# t, y, v, F, u
Instant = tuple[float, float, float, float, float]
# y, v, F, mode, last acceleration
State = tuple[float, float, float, int, float]


@compiled_inline
def row_at(x: Array, i: int) -> int:
    """Address of row i; a row itself would be counted in and out."""
    return x.ctypes.data + i * x.strides[0]


@compiled_inline
def level(p: Parameters, d: float, v: float, rest: bool) -> tuple[float, float]:
    """Coulomb level and whole friction in direction d [N], both the stick limit at rest."""
    if rest:
        limit = p[F_SP] if d > 0.0 else -p[F_SN]
        return limit, limit
    coulomb = p[F_CP] if d > 0.0 else p[F_CN]
    return coulomb, coulomb + (p[F_VP] if d > 0.0 else p[F_VN]) * abs(v)


@compiled_inline
def total(
    code: int,
    codes: IntArray,
    addresses: IntArray,
    q: Array,
    s: Array,
    z: Array,
    p: Parameters,
    t: float,
    y: float,
    v: float,
    F: float,
    u: float,
    d: float,
    rest: bool,
) -> float:
    """Sum of what the effects of this code give; s (k, MAX_SIGNALS), z (k,)."""
    out = 0.0
    for i in range(len(codes)):
        both = codes[i] == ON_FRICTION and code in (ON_SLIP, ON_STICTION)
        if codes[i] == code or both:
            c, f = level(p, d, v, rest)
            x = (t, y, v, F, u, d, z[i], c, f)
            out += call_value(addresses[i, VALUE], x, row_at(s, i), row_at(q, i))
    return out


@compiled_inline
def at_hand(codes: IntArray, addresses: IntArray) -> int:
    """A bit for each code among the effects, and one for states; the rest adds up to nothing."""
    out = 0
    for i in range(len(codes)):
        if codes[i] >= 0:
            out |= (1 << ON_SLIP) | (1 << ON_STICTION) if codes[i] == ON_FRICTION else 1 << codes[i]
            outside = codes[i] == ON_SENSOR or codes[i] == ON_COMMAND
            out |= STATES if addresses[i, EVOLVE] != 0 and not outside else 0
    return out


@compiled_inline
def direction(v: float, F: float) -> float:
    """+1 or -1: of the velocity, where there is none of the force."""
    return 1.0 if v > 0.0 or (v == 0.0 and F >= 0.0) else -1.0


@compiled_inline
def carried(level: float, viscous: float, speed: float) -> tuple[float, float]:
    """Level [N] and viscous coefficient, of the same sum at `speed`, that never drive."""
    if level >= 0.0 or speed <= 0.0:
        return max(level, 0.0), viscous
    return 0.0, max(viscous + level / speed, 0.0)


@compiled_inline
def evolve_states(
    sensor: bool,
    dt: float,
    codes: IntArray,
    addresses: IntArray,
    q: Array,
    s: Array,
    z: Array,
    p: Parameters,
    t: float,
    y: float,
    v: float,
    F: float,
    u: float,
    rest: bool,
) -> None:
    """States z after dt, those of the sensors or all others; d is 0 at rest."""
    for i in range(len(codes)):
        if codes[i] == ON_COMMAND:
            continue  # its state goes on with the command (`acting_command`)
        if addresses[i, EVOLVE] != 0 and (codes[i] == ON_SENSOR) == sensor:
            way = direction(v, F)
            d = 0.0 if rest else way
            c, f = level(p, way, v, rest)
            x = (dt, t, y, v, F, u, d, z[i], c, f)
            z[i] = call_evolve(addresses[i, EVOLVE], x, row_at(s, i), row_at(q, i))


@compiled_inline
def start_states(
    codes: IntArray,
    addresses: IntArray,
    q: Array,
    s: Array,
    z: Array,
    p: Parameters,
    t: float,
    y: float,
    v: float,
    F: float,
    u: float,
    again: bool,
) -> None:
    """States at the start of a run or, again, of one of its windows: those with a memory go on."""
    for i in range(len(codes)):
        if again and addresses[i, EVOLVE] != 0:
            continue
        z[i] = 0.0
        if addresses[i, INITIAL] != 0:
            rest = v == 0.0
            d = direction(v, F)
            c, f = level(p, d, v, rest)
            x = (t, y, v, F, u, d, 0.0, c, f)
            z[i] = call_value(addresses[i, INITIAL], x, row_at(s, i), row_at(q, i))


@compiled_inline
def shown_position(
    h: float,
    codes: IntArray,
    addresses: IntArray,
    q: Array,
    s: Array,
    z: Array,
    p: Parameters,
    t: float,
    y: float,
    v: float,
    F: float,
    u: float,
) -> float:
    """Position that the transducer shows; its states advance by one sample."""
    shown = y
    for i in range(len(codes)):
        if codes[i] == ON_SENSOR:
            d = 0.0 if v == 0.0 else (1.0 if v > 0.0 else -1.0)
            c, f = level(p, d, v, v == 0.0)
            if addresses[i, EVOLVE] != 0:
                step = (h, t, shown, v, F, u, d, z[i], c, f)
                z[i] = call_evolve(addresses[i, EVOLVE], step, row_at(s, i), row_at(q, i))
            x = (t, shown, v, F, u, d, z[i], c, f)
            shown = call_value(addresses[i, VALUE], x, row_at(s, i), row_at(q, i))
    return shown


@compiled_inline
def forces_along(
    acts: int,
    codes: IntArray,
    addresses: IntArray,
    q: Array,
    s: Array,
    z: Array,
    p: Parameters,
    at: Instant,
    way_on: float,
    way: float,
    rest: bool,
) -> tuple[float, float]:
    """Forces of the effects [N] and their stiffness [N/m] along a sub-step's way on [m].

    Along the way they are a straight line in position, which is stepped exactly too.
    """
    if not acts & (1 << ON_FORCE):
        return 0.0, 0.0
    t, y, v, F, u = at
    here = total(ON_FORCE, codes, addresses, q, s, z, p, t, y, v, F, u, way, rest)
    if abs(way_on) <= SHORTEST_WAY:
        return here, 0.0
    ahead = total(ON_FORCE, codes, addresses, q, s, z, p, t, y + way_on, v, F, u, way, rest)
    k_e = max((here - ahead) / way_on, -p[K2])
    return 0.5 * (here + ahead + k_e * way_on), k_e


@compiled_inline
def level_on_bristle(
    acts: int,
    codes: IntArray,
    addresses: IntArray,
    q: Array,
    s: Array,
    z: Array,
    p: Parameters,
    at: tuple[float, float, float, float, float, float],
) -> tuple[float, float]:
    """Level [N] and viscous coefficient [N s/m] where a bristle replaces sticking.

    In place of the band: a level that falls from the stick limit as LuGre's does.
    """
    t, y, v, F, u, d = at
    edge = p[DV_P] if d > 0.0 else p[DV_N]
    low, _ = level(p, d, v, False)
    high, _ = level(p, d, v, True)
    if acts & (1 << ON_STICTION):
        high += total(ON_STICTION, codes, addresses, q, s, z, p, t, y, 0.0, F, u, d, True)
    if acts & (1 << ON_SLIP):
        low += total(ON_SLIP, codes, addresses, q, s, z, p, t, y, v, F, u, d, False)
    low, viscous = carried(low, p[F_VP] if d > 0.0 else p[F_VN], abs(v))
    return max(low + (max(high, 0.0) - low) * math.exp(-((v / edge) ** 2)), 1e-9), viscous


@compiled_inline
def with_friction(
    acts: int,
    codes: IntArray,
    addresses: IntArray,
    q: Array,
    s: Array,
    z: Array,
    p: Parameters,
    at: Instant,
    slow: tuple[bool, bool],
    k_e: float,
) -> Parameters:
    """The plant with the effects' friction and stiffness in it, as it is during a sub-step.

    slow: whether the body may come to rest from positive, and from negative motion.
    """
    t, y, v, F, u = at
    slow_p, slow_n = slow
    up = down = high_p = high_n = 0.0
    wp, wn = max(v, 0.0), min(v, 0.0)
    if slow_n and acts & (1 << ON_SLIP):
        up = total(ON_SLIP, codes, addresses, q, s, z, p, t, y, wp, F, u, 1.0, False)
    if slow_p and acts & (1 << ON_SLIP):
        down = total(ON_SLIP, codes, addresses, q, s, z, p, t, y, wn, F, u, -1.0, False)
    if slow_p and slow_n and acts & (1 << ON_STICTION):
        x = (t, y, 0.0, F, u)
        high_p = total(ON_STICTION, codes, addresses, q, s, z, p, *x, 1.0, True)
        high_n = total(ON_STICTION, codes, addresses, q, s, z, p, *x, -1.0, True)
    coulomb_p, viscous_p = carried(p[F_CP] + up, p[F_VP], wp)
    coulomb_n, viscous_n = carried(p[F_CN] + down, p[F_VN], -wn)
    return (
        p[M],
        coulomb_p,
        coulomb_n,
        viscous_p,
        viscous_n,
        p[DV_P],
        p[DV_N],
        max(p[F_SP] + high_p, 0.0),
        min(p[F_SN] - high_n, 0.0),
        p[K1],
        p[K2] + k_e,
    )


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
            mode = settled_mode(shifted, v, F + extra)
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
    """Command that reaches the actuator in place of `u` [V], held for h [s]; z (k,) goes on."""
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
    """Mean over sample k of the held command (n,) that is `late` samples old."""
    whole = int(np.floor(late))
    part = late - whole
    newer: float = history[max(k - whole, 0)]
    older: float = history[max(k - whole - 1, 0)]
    return (1.0 - part) * newer + part * older
