"""Steps of the Karnopp plant with effects (compiled): any effects, no new compilation.

Within a sub-step the effects' forces are those at its predicted middle, and the plant with these
forces and levels is stepped exactly, switches included (`stepping`): second order in the step.
States evolve half before it and half after, both times under what holds at the middle. With a
bristle in place of sticking, mass, bristle and actuator are stepped by the trapezoidal rule, the
bristle's own law by an exponential.
"""

import math
from dataclasses import dataclass

import numpy as np

from identification.arrays import Array, IntArray
from identification.compiled import call_evolve, call_value, compiled, compiled_inline
from identification.effects._base import MAX_PARAMS, MAX_SIGNALS, Acting
from identification.errors import BadLog, BadModel
from identification.log import Log
from identification.stepping import (
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
    SLIP_N,
    SLIP_P,
    STUCK,
    M,
    Parameters,
    glided,
    resolve,
    settled_mode,
)

SLIP, STICTION, FRICTION, BRISTLE, FORCE, ACTUATOR, COMMAND, DELAY, SENSOR = range(9)
CODES = dict(
    zip(
        ("slip", "stiction", "friction", "bristle", "force", "actuator", "command", "delay",
         "sensor"),
        range(9), strict=True,
    )
)  # fmt: skip
OUTSIDE = (COMMAND, DELAY, SENSOR)
LONGEST = 1e-3  # s, sub-step of effects without memory
LONGEST_STATE = 2.5e-4  # s, of those with a state, in which a switch counts with its sub-step
LONGEST_BRISTLE = 1e-4  # s
SHORTEST_WAY = 1e-9  # m, over which a force's slope is still sure
VALUE, EVOLVE, INITIAL = range(3)
AWAY = 2.0  # times the band, beyond which a body that speeds up cannot come to rest
# Damping ratio of the micro-motion on a bristle: without it a body at rest would ring on. LuGre's
# sigma_1 = 2 MICRO_DAMPING sqrt(sigma_0 m) is its authors' choice (IEEE TAC 40 (1995), table I).
MICRO_DAMPING = 0.5
ITERATIONS = 8  # most, of a bristle's mean slope within a sub-step
SHARE = 1e-3  # of the level, by which the slope of a bristle is differentiated
STATES = 1 << 9  # beside the bits of the codes
# y, v, F, mode, last acceleration
State = tuple[float, float, float, int, float]


@dataclass(frozen=True, eq=False)
class EffectTable:
    """Chosen effects as the kernels take them: codes (k,), addresses (k, 3), parameters (k, P)."""

    codes: IntArray
    addresses: IntArray
    p: Array

    def longest(self, bristle: float) -> float:
        """Longest sub-step [s]; bristle: of a plant with one."""
        if np.any(self.codes == BRISTLE):
            return bristle
        states = (self.addresses[:, EVOLVE] != 0) & (self.codes != SENSOR)
        return LONGEST_STATE if np.any(states) else LONGEST


def effect_table(acting: tuple[Acting, ...]) -> EffectTable:
    """The table of these effects; raises BadModel where two of them replace sticking."""
    codes = np.array([CODES[a.effect.acts] for a in acting], dtype=np.int64)
    for code, what in ((BRISTLE, "replaces sticking"), (DELAY, "delays the command")):
        if np.count_nonzero(codes == code) > 1:
            raise BadModel(f"more than one effect {what}: a plant takes one")
    addresses = np.array([a.effect.addresses for a in acting], dtype=np.int64).reshape(-1, 3)
    p = np.array([a.array for a in acting]).reshape(-1, MAX_PARAMS)
    return EffectTable(codes, addresses, p)


def signal_table(acting: tuple[Acting, ...], log: Log) -> Array:
    """Signals of each effect along the log, (k, n, MAX_SIGNALS); those it may miss read as 0.

    Raises BadLog where the log lacks one that an effect needs.
    """
    out = np.zeros((len(acting), len(log), MAX_SIGNALS))
    for i, a in enumerate(acting):
        if a.effect.signals and not any(name in log for name in a.effect.signals):
            raise BadLog(
                f"{log.name}: the effect {a.key!r} needs a signal {' or '.join(a.effect.signals)};"
                " name its column in the card"
            )
        for j, name in enumerate(a.effect.signals):
            if name in log or name in a.effect.needs:
                out[i, :, j] = log[name]
    return out


def outside(codes: IntArray) -> bool:
    """Whether the effects change only what reaches the actuator and what the transducer shows."""
    return bool(np.all(np.isin(codes, OUTSIDE)))


def pieces(table: EffectTable, h: float, bristle: float = LONGEST_BRISTLE) -> int:
    """Number of sub-steps in a sample of `h` [s]; bristle: longest of a plant with one [s]."""
    return max(1, math.ceil(h / table.longest(bristle) - 1e-9))


def fewer(table: EffectTable, count: int, bristle: float = LONGEST_BRISTLE) -> int:
    """Of `count` sub-steps, those that a sample without a switch needs; a bristle never rests."""
    states = (table.addresses[:, EVOLVE] != 0) & ~np.isin(table.codes, (SENSOR, STICTION))
    longest = LONGEST_STATE if np.any(states) else LONGEST
    short = min(table.longest(bristle) / longest, 1.0)
    return count if np.any(table.codes == BRISTLE) else max(1, math.ceil(count * short - 1e-9))


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
        both = codes[i] == FRICTION and code in (SLIP, STICTION)
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
            out |= (1 << SLIP) | (1 << STICTION) if codes[i] == FRICTION else 1 << codes[i]
            out |= STATES if addresses[i, EVOLVE] != 0 and codes[i] != SENSOR else 0
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
        if addresses[i, EVOLVE] != 0 and (codes[i] == SENSOR) == sensor:
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
        if codes[i] == SENSOR:
            d = 0.0 if v == 0.0 else (1.0 if v > 0.0 else -1.0)
            c, f = level(p, d, v, v == 0.0)
            if addresses[i, EVOLVE] != 0:
                step = (h, t, shown, v, F, u, d, z[i], c, f)
                z[i] = call_evolve(addresses[i, EVOLVE], step, row_at(s, i), row_at(q, i))
            x = (t, shown, v, F, u, d, z[i], c, f)
            shown = call_value(addresses[i, VALUE], x, row_at(s, i), row_at(q, i))
    return shown


@compiled
def bristle_slopes(
    address: int, q: Array, s: Array, z: float, c: float, t: float, y: float, v: float, F: float,
    u: float, d: float,
) -> tuple[float, float, float]:  # fmt: skip
    """Slope dF/dy of a bristle at z, its derivative by z, and its slope without load."""
    x = (t, y, v, F, u, d, z, c, c)
    beside = (t, y, v, F, u, d, z - d * SHARE * c, c, c)
    free = (t, y, v, F, u, d, 0.0, c, c)
    slope = call_value(address, x, s.ctypes.data, q.ctypes.data)
    change = slope - call_value(address, beside, s.ctypes.data, q.ctypes.data)
    return (
        slope,
        change / (d * SHARE * c),
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
        damping = 2.0 * MICRO_DAMPING * math.sqrt(free * m) * max(slope, 0.0) / free
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


@compiled_inline
def effect_step(
    p: Parameters,
    count: int,
    codes: IntArray,
    addresses: IntArray,
    q: Array,
    s: Array,
    z: Array,
    bristle: int,
    t: float,
    state: State,
    u: float,
    g: float,
    h: float,
) -> State:
    """State after `h` [s] in `count` sub-steps; g: k1 u, or the force's slope with k2 = 0."""
    y, v, F, mode, a = state
    dt = h / count
    acts = at_hand(codes, addresses)
    for j in range(count):
        now = t + (j + 0.5) * dt
        rest = mode == STUCK and bristle < 0
        vm = 0.0 if rest else v + 0.5 * dt * a
        if vm * v < 0.0:
            vm = 0.0
        ym = y + 0.5 * dt * v
        way = direction(v, F)
        early = 0.0
        if acts & (1 << ACTUATOR):
            early = total(ACTUATOR, codes, addresses, q, s, z, p, now, y, v, F, u, way, rest)
        Fm = F + 0.5 * dt * (g + early - p[K2] * v)
        way = direction(v, Fm)
        still = mode == STUCK
        if acts & STATES:
            evolve_states(False, 0.5 * dt, codes, addresses, q, s, z, p, now, ym, vm, Fm, u, still)
        # Along the way the forces are a straight line in position, which is stepped exactly too.
        way_on = 2.0 * (ym - y)
        extra, k_e = 0.0, 0.0
        if acts & (1 << FORCE):
            extra = total(FORCE, codes, addresses, q, s, z, p, now, y, vm, Fm, u, way, rest)
        if acts & (1 << FORCE) and abs(way_on) > SHORTEST_WAY:
            end = y + way_on
            ahead = total(FORCE, codes, addresses, q, s, z, p, now, end, vm, Fm, u, way, rest)
            k_e = max((extra - ahead) / way_on, -p[K2])
            extra = 0.5 * (extra + ahead + k_e * way_on)
        g_now = g
        if acts & (1 << ACTUATOR):
            g_now += total(ACTUATOR, codes, addresses, q, s, z, p, now, ym, vm, Fm, u, way, rest)
        y_0, before, F_0 = y, v, F
        if bristle >= 0:
            # In place of the band: a level that falls from the stick limit as LuGre's does.
            d = direction(vm, z[bristle])
            edge = p[DV_P] if d > 0.0 else p[DV_N]
            low, _ = level(p, d, vm, False)
            high, _ = level(p, d, vm, True)
            if acts & (1 << STICTION):
                high += total(STICTION, codes, addresses, q, s, z, p, now, ym, 0.0, Fm, u, d, True)
            if acts & (1 << SLIP):
                low += total(SLIP, codes, addresses, q, s, z, p, now, ym, vm, Fm, u, d, False)
            low, viscous = carried(low, p[F_VP] if d > 0.0 else p[F_VN], abs(vm))
            c = max(low + (max(high, 0.0) - low) * math.exp(-((vm / edge) ** 2)), 1e-9)
            at = (now, ym, vm, Fm, u, d)
            y, v, F, z[bristle] = bristle_step(
                p, addresses[bristle, VALUE], q[bristle], s[bristle], z[bristle], c, at, y, v, F,
                g_now, viscous, extra, k_e, dt,
            )  # fmt: skip
            mode = STUCK if p[DV_N] < v < p[DV_P] else (SLIP_P if v > 0.0 else SLIP_N)
        else:
            slowest, fastest = min(v, v + 2.0 * dt * a), max(v, v + 2.0 * dt * a)
            slow_p, slow_n = slowest < AWAY * p[DV_P], fastest > AWAY * p[DV_N]
            up = down = high_p = high_n = 0.0
            wp, wn = max(vm, 0.0), min(vm, 0.0)
            if slow_n and acts & (1 << SLIP):
                up = total(SLIP, codes, addresses, q, s, z, p, now, ym, wp, Fm, u, 1.0, False)
            if slow_p and acts & (1 << SLIP):
                down = total(SLIP, codes, addresses, q, s, z, p, now, ym, wn, Fm, u, -1.0, False)
            if slow_p and slow_n and acts & (1 << STICTION):
                x = (now, ym, 0.0, Fm, u)
                high_p = total(STICTION, codes, addresses, q, s, z, p, *x, 1.0, True)
                high_n = total(STICTION, codes, addresses, q, s, z, p, *x, -1.0, True)
            coulomb_p, viscous_p = carried(p[F_CP] + up, p[F_VP], wp)
            coulomb_n, viscous_n = carried(p[F_CN] + down, p[F_VN], -wn)
            shifted = (
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
            mode = settled_mode(shifted, v, F + extra)
            v = 0.0 if mode == STUCK else v
            moved, after, on = glided(shifted, v, F + extra, mode, g_now, dt)
            if on:
                y, v = y + moved, after
            else:
                y, v, _, mode = resolve(shifted, y, v, F + extra, mode, g_now, dt)
            F += g_now * dt - p[K2] * (y - y_0)
        a = (v - before) / dt
        ym, vm, Fm, still = 0.5 * (y_0 + y), 0.5 * (before + v), 0.5 * (F_0 + F), mode == STUCK
        if acts & STATES:
            evolve_states(False, 0.5 * dt, codes, addresses, q, s, z, p, now, ym, vm, Fm, u, still)
    return y, v, F, mode, a


@compiled
def acting_command(
    codes: IntArray, addresses: IntArray, q: Array, s: Array, z: Array, t: float, u: float
) -> float:
    """Command that reaches the actuator in place of `u` [V]."""
    for i in range(len(codes)):
        if codes[i] == COMMAND:
            d = 1.0 if u >= 0.0 else -1.0
            x = (t, 0.0, 0.0, 0.0, u, d, z[i], 0.0, 0.0)
            u = float(call_value(addresses[i, VALUE], x, row_at(s, i), row_at(q, i)))
    return u


@compiled
def delayed(history: Array, k: int, late: float) -> float:
    """Mean over sample k of the held command (n,) that is `late` samples old."""
    whole = int(np.floor(late))
    part = late - whole
    newer: float = history[max(k - whole, 0)]
    older: float = history[max(k - whole - 1, 0)]
    return (1.0 - part) * newer + part * older
