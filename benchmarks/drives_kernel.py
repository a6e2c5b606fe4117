"""Machines of `drives` in fixed steps of 1/64000 s, Runge-Kutta of fourth order, with the instants
of sticking and breaking away found inside a step; no line is shared with the package's simulator.

A first-order step would do harm here: at F_v/m = 100 1/s and 20 us it shows a viscous coefficient
that is 0.1 % off, which is more than the intervals that are to be judged.
"""

import numpy as np

from identification.arrays import Array, IntArray
from identification.compiled import compiled, compiled_inline

RATE = 64000  # steps a second
STUCK, SLIDE_P, SLIDE_N, BAND_P, BAND_N, BRISTLE = range(6)
ALGEBRAIC, LAGGING, PNEUMATIC = range(3)
MOST_SWITCHES = 8  # in a step; a body that chatters at the band's edge is held there for the rest
ACCELERATION_LAG = 5e-3  # s, of the acceleration that friction feels
LONGEST_MEMORY = 2.0  # s, of friction that grows since the last reversal
# Sizes of the effects, in the order of `e`; all of them 0 in a plain machine.
SIZES = (
    "k", "cog", "cog_period", "slope", "mu", "warm", "warm_tau", "dip", "dip_speed", "play",
    "dead", "late", "leak", "sigma_0", "sigma_1", "by_acceleration", "second_mass", "second_k",
    "second_c", "bouc", "bouc_length", "since_reversal", "shake", "shake_rate", "cable",
)  # fmt: skip
(
    K, COG, COG_PERIOD, SLOPE, MU, WARM, WARM_TAU, DIP, DIP_SPEED, PLAY,
    DEAD, LATE, LEAK, SIGMA_0, SIGMA_1, BY_ACCELERATION, SECOND_MASS, SECOND_K,
    SECOND_C, BOUC, BOUC_LENGTH, SINCE_REVERSAL, SHAKE, SHAKE_RATE, CABLE,
) = range(25)  # fmt: skip
State = tuple[float, float, float, float, float, float, float, float]
# y, v, F; bristle z; Bouc-Wen force; second mass's place and speed; slowed speed.
Y, V, FORCE, BRISTLES, HYSTERETIC, PLACE, SPEED, SLOWED = range(8)


@compiled_inline
def applied(x: State, u: float, act: Array) -> float:
    """Force of the actuator [N]; act: kind, k_a or k1, k2, lag."""
    return float(act[1] * u if act[0] == ALGEBRAIC else x[FORCE])


@compiled_inline
def driving(x: State, u: float, t: float, act: Array, e: Array) -> float:
    """What drives the body [N], friction apart."""
    force = applied(x, u, act)
    y = x[Y]
    if e[COG] != 0.0:
        force += e[COG] * np.sin(2.0 * np.pi * y / e[COG_PERIOD])
    if e[SHAKE] != 0.0:
        force += e[SHAKE] * np.sin(2.0 * np.pi * e[SHAKE_RATE] * t)
    force -= e[K] * y + e[CABLE] * y * y + x[HYSTERETIC]
    if e[SECOND_MASS] > 0.0:
        force += e[SECOND_K] * (x[PLACE] - y) + e[SECOND_C] * (x[SPEED] - x[V])
    return float(force)


@compiled_inline
def raised(x: State, u: float, t: float, turned: float, level: float, act: Array, p: Array,
           e: Array) -> float:  # fmt: skip
    """What effects add to this level of friction, sliding or stuck [N]."""
    more = e[SLOPE] * x[Y] + e[MU] * abs(applied(x, u, act))
    if e[WARM] != 0.0:
        more += level * e[WARM] * (1.0 - np.exp(-t / e[WARM_TAU]))
    if e[BY_ACCELERATION] != 0.0:
        more += level * e[BY_ACCELERATION] * abs(x[V] - x[SLOWED]) / ACCELERATION_LAG
    if e[SINCE_REVERSAL] != 0.0:
        more += e[SINCE_REVERSAL] * np.sqrt(min(t - turned, LONGEST_MEMORY))
    return float(more)


@compiled_inline
def slopes(x: State, u: float, t: float, turned: float, mode: int, act: Array, p: Array,
           e: Array) -> State:  # fmt: skip
    """Time derivative of the state in a mode."""
    v = x[V]
    way = -1.0 if mode in (SLIDE_N, BAND_N) else 1.0
    dv = dz = 0.0
    if mode == BRISTLE:
        way = 1.0 if v >= 0.0 else -1.0
    if mode != STUCK:
        in_band = mode in (BAND_P, BAND_N)
        level = (p[7] if way > 0.0 else -p[8]) if in_band else (p[1] if way > 0.0 else p[2])
        level += raised(x, u, t, turned, level, act, p, e)
        drive = driving(x, u, t, act, e)
        friction = way * level
        if not in_band:
            if e[DIP] != 0.0:
                level += e[DIP] * np.exp(-((v / e[DIP_SPEED]) ** 2))
            friction = way * level
            if mode == BRISTLE:  # LuGre: the stick limit at rest, the band as Stribeck's velocity
                band, stick = (p[5], p[7]) if way > 0.0 else (p[6], -p[8])
                level += (stick - (p[1] if way > 0.0 else p[2])) * np.exp(-((v / band) ** 2))
                dz = v - abs(v) * e[SIGMA_0] * x[BRISTLES] / level
                friction = e[SIGMA_0] * x[BRISTLES] + e[SIGMA_1] * dz
            friction += (p[3] if way > 0.0 else p[4]) * v
        dv = (drive - friction) / (p[0] - e[SECOND_MASS])
    moving = 0.0 if mode == STUCK else v
    force = 0.0
    if act[0] == PNEUMATIC:
        force = act[1] * u - act[2] * moving - e[LEAK] * x[FORCE]
    elif act[0] == LAGGING:
        force = (act[1] * u - x[FORCE]) / act[3]
    hysteretic_rate = (
        (e[BOUC] * moving - abs(moving) * x[HYSTERETIC]) / e[BOUC_LENGTH] if e[BOUC] > 0.0 else 0.0
    )
    swing = 0.0
    if e[SECOND_MASS] > 0.0:
        pull = e[SECOND_K] * (x[PLACE] - x[Y]) + e[SECOND_C] * (x[SPEED] - moving)
        swing = -pull / e[SECOND_MASS]
    return (
        moving,
        dv,
        force,
        dz,
        hysteretic_rate,
        x[SPEED],
        swing,
        (moving - x[SLOWED]) / ACCELERATION_LAG,
    )


@compiled_inline
def moved(x: State, d: State, dt: float) -> State:
    """The state so much later along these slopes."""
    return (
        x[0] + dt * d[0], x[1] + dt * d[1], x[2] + dt * d[2], x[3] + dt * d[3],
        x[4] + dt * d[4], x[5] + dt * d[5], x[6] + dt * d[6], x[7] + dt * d[7],
    )  # fmt: skip


@compiled_inline
def with_speed(x: State, v: float) -> State:
    """The state at another speed."""
    return (x[0], v, x[2], x[3], x[4], x[5], x[6], x[7])


@compiled
def stepped(x: State, u: float, t: float, turned: float, mode: int, act: Array, p: Array,
            e: Array, dt: float) -> State:  # fmt: skip
    """One Runge-Kutta step in a mode."""
    half = 0.5 * dt
    a = slopes(x, u, t, turned, mode, act, p, e)
    b = slopes(moved(x, a, half), u, t + half, turned, mode, act, p, e)
    c = slopes(moved(x, b, half), u, t + half, turned, mode, act, p, e)
    d = slopes(moved(x, c, dt), u, t + dt, turned, mode, act, p, e)
    return moved(moved(moved(x, a, dt / 6.0), moved(b, c, 1.0), dt / 3.0), d, dt / 6.0)


@compiled_inline
def excess(x: State, u: float, t: float, turned: float, act: Array, p: Array,
           e: Array) -> float:  # fmt: skip
    """How far the driving force is beyond the stick limit [N], with its sign; 0 within."""
    drive = driving(x, u, t, act, e)
    above = drive - p[7] - raised(x, u, t, turned, p[7], act, p, e)
    below = drive - p[8] + raised(x, u, t, turned, -p[8], act, p, e)
    return float(max(above, 0.0) + min(below, 0.0))


@compiled_inline
def mode_of(x: State, beyond: float, p: Array) -> int:
    """Mode of a body at this speed, inside the band by the force beyond the stick limits."""
    if x[V] > p[5]:
        return SLIDE_P
    if x[V] < p[6]:
        return SLIDE_N
    if beyond == 0.0:
        return STUCK
    return BAND_P if beyond > 0.0 else BAND_N


@compiled
def left_at(x: State, after: State, u: float, t: float, turned: float, mode: int, act: Array,
            p: Array, e: Array, dt: float) -> float:  # fmt: skip
    """Share of the step after which its mode ends; 2 where it does not."""
    v, w = x[V], after[V]
    if mode == SLIDE_P:
        return (v - p[5]) / (v - w) if w < p[5] else 2.0
    if mode == SLIDE_N:
        return (v - p[6]) / (v - w) if w > p[6] else 2.0
    beyond = excess(after, u, t + dt, turned, act, p, e)
    if mode == STUCK:
        if beyond == 0.0:
            return 2.0
        change = driving(after, u, t + dt, act, e) - driving(x, u, t, act, e)
        return 1.0 - beyond / change if abs(change) > abs(beyond) else 1e-3
    first = 2.0
    if w > p[5]:
        first = (p[5] - v) / (w - v)
    elif w < p[6]:
        first = (p[6] - v) / (w - v)
    if (mode == BAND_P) != (beyond > 0.0) or beyond == 0.0:
        before = abs(excess(x, u, t, turned, act, p, e))
        change = abs(driving(after, u, t + dt, act, e) - driving(x, u, t, act, e))
        first = min(first, before / change if change > before else 1.0)
    return first


@compiled
def through(x: State, u: float, t: float, turned: float, mode: int, act: Array, p: Array,
            e: Array, dt: float) -> tuple[State, int]:  # fmt: skip
    """State and mode after one step, from switch to switch."""
    if mode == BRISTLE:
        return stepped(x, u, t, turned, mode, act, p, e, dt), mode
    left = dt
    for _ in range(MOST_SWITCHES):
        if mode not in (SLIDE_P, SLIDE_N):  # the command may have changed since
            mode = mode_of(x, excess(x, u, t, turned, act, p, e), p)
            if mode == STUCK:
                x = with_speed(x, 0.0)
        after = stepped(x, u, t, turned, mode, act, p, e, left)
        share = left_at(x, after, u, t, turned, mode, act, p, e, left)
        if share > 1.0:
            return after, mode
        share = max(share, 0.0)
        x = stepped(x, u, t, turned, mode, act, p, e, share * left)
        t += share * left
        left *= 1.0 - share
        if mode == SLIDE_P or (mode in (BAND_P, BAND_N) and x[V] >= p[5] - 1e-9):
            x = with_speed(x, p[5])
        elif mode == SLIDE_N or (mode in (BAND_P, BAND_N) and x[V] <= p[6] + 1e-9):
            x = with_speed(x, p[6])
        beyond = excess(x, u, t, turned, act, p, e)
        if mode == STUCK:
            surplus = driving(after, u, t + left, act, e)
            mode = BAND_P if surplus > 0.0 else BAND_N
            x = stepped(x, u, t, turned, mode, act, p, e, left)
            return x, mode
        if mode in (BAND_P, BAND_N) and x[V] == p[5]:
            mode = SLIDE_P
        elif mode in (BAND_P, BAND_N) and x[V] == p[6]:
            mode = SLIDE_N
        else:
            mode = STUCK if beyond == 0.0 else (BAND_P if beyond > 0.0 else BAND_N)
        if mode == STUCK:
            x = with_speed(x, 0.0)
    rates = slopes(x, u, t, turned, mode, act, p, e)
    return moved(x, with_speed(rates, 0.0), left), mode


@compiled
def run(p: Array, act: Array, e: Array, loop: Array, r: Array, dr: Array, noise: Array,
        tick: int, at: IntArray, share: Array, every: int) -> Array:  # fmt: skip
    """Position shown, speed, force and command (4, n) at every sample, from rest.

    loop: gain of position and speed, their integrals, speed filter's share, limit, force loop's
    bandwidth, encoder's count, largest force. r, dr, noise (2, ticks): reference, its rate and the
    controller's own sensors, every `tick` steps. at, share: step and part of it at which y and F
    are read; every: steps between samples, whose commands are the active ones.
    """
    n = len(at)
    out = np.zeros((4, n))
    dt, period = 1.0 / RATE, tick / RATE
    sent = np.zeros(len(r))
    x = (r[0], 0.0, 0.0, 0.0, 0.0, r[0], 0.0, 0.0)
    mode = BRISTLE if e[SIGMA_0] > 0.0 else STUCK
    shown, before, speed, total, turned, way = r[0], r[0], 0.0, 0.0, 0.0, 0.0
    gain, limit, count = act[1], loop[5], loop[7]
    late, sample = round(e[LATE] * RATE), 0
    for j in range(n * every):
        if j % tick == 0:
            i = j // tick
            seen = shown + noise[0, i]
            if count > 0.0:
                seen = count * np.round(seen / count)
            speed += loop[4] * ((seen - before) / period - speed) if i > 0 else 0.0
            before = seen
            off, slow = r[i] - seen, dr[i] - speed
            most = limit * gain if act[0] != PNEUMATIC else loop[8]
            total = min(max(total + period * (loop[2] * off + loop[3] * slow), -most), most)
            wanted = min(max(loop[0] * off + loop[1] * slow + total, -most), most)
            if act[0] == PNEUMATIC:
                wanted = loop[6] * (wanted - x[FORCE] - noise[1, i]) + act[2] * speed
            sent[i] = min(max(wanted / gain, -limit), limit)
        u = sent[max(j - late, 0) // tick] if j >= late else 0.0
        if e[DEAD] > 0.0:
            u = np.sign(u) * max(abs(u) - e[DEAD], 0.0)
        if j % every == 0:
            out[3, j // every] = sent[j // tick]
        was, old = shown, x
        x, mode = through(x, u, j * dt, turned, mode, act, p, e, dt)
        if x[V] * way < 0.0 or (way == 0.0 and x[V] != 0.0):
            turned = j * dt
        way = np.sign(x[V]) if x[V] != 0.0 else way
        shown = min(max(shown, x[Y] - 0.5 * e[PLAY]), x[Y] + 0.5 * e[PLAY])
        while sample < n and at[sample] == j:
            part = share[sample]
            out[0, sample] = was + part * (shown - was)
            out[1, sample] = old[V]
            if act[0] == ALGEBRAIC:
                out[2, sample] = act[1] * u
            else:
                out[2, sample] = old[FORCE] + part * (x[FORCE] - old[FORCE])
            sample += 1
    return out
