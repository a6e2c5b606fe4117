"""Forces, levels and states of the effects at an instant (compiled): what a step is made of."""

import math

from identification.arrays import Array, IntArray
from identification.compiled import call_evolve, call_value, compiled_inline
from identification.simulation.effect_table import (
    EVOLVE,
    INITIAL,
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
    M,
    Parameters,
)

SHORTEST_WAY = 1e-9  # m, over which a force's slope is still sure
STATES = 1 << 9  # beside the bits of the codes
# t, y, v, F, u
Instant = tuple[float, float, float, float, float]


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
