"""What a servo computes in one sample, compiled: position law, friction force, force loop.

The same functions run inside the simulation (`design.servo`), behind `step` of the sampled objects,
and are read by `design.program` for the code of a machine's controller: each operation is rounded
by itself, in the written order. Values that do not change are in `Law`, the rest in `Memory`.
"""

import math
from typing import NamedTuple

import numpy as np

from design.compensator import compensation_force
from design.feed_forward import feed_forward_force
from design.filters import filtered
from design.loop_kernels import force_command, shift
from identification.arrays import Array, IntArray
from identification.compiled import compiled, compiled_exact

RST_LAW, PID_LAW, SCHEDULED_LAW = range(3)
NO_COUNTERMEASURE, COMPENSATOR, DISTURBANCE, KALMAN, FEED_FORWARD = range(5)
PLAIN_INTEGRAL, DEAD_ZONE, RESET = range(3)
# A PID's constants, and its memory.
K_R, PER_SUM, PER_DIFFERENCE, POLE, ZONE, RULE = range(6)
SUM, SLOPE, ERROR = range(3)
# A scheduled law's memory in the place of a PID's, and over what it is scheduled.
BASE, R_LAST, Y_LAST = range(3)
OVER_PLACE, OVER_LOAD, OVER_DIRECTION = range(3)
# Constants of the Kalman filter, and its memory: y, v, F_f, then the covariance by rows.
K_M, K_FVP, K_FVN, K_QV, K_QF, K_R_Y = range(6)
# What one sample leaves besides the command, then what the next one needs.
WANTED, RAW, ADDED, SPEED = range(4)
PATH_ACCELERATION = 4.0  # times the acceleration, up to which a reference is a path and no step,
PATH_TURN = 0.5  # and by which times that may change from sample to sample
LEAST_CHASE = 0.25  # of the acceleration, that is left for catching up with one that turns hard
R_MOVED, INTEGRAL_SUM, U_BEFORE, R_STEP, R_BEFORE, R_PACE, R_TURN, R_GOES = range(8)


class Law(NamedTuple):
    """A servo's constants.

    position: RST_LAW with R, S and W, or PID_LAW with pid (6,). W, of the length of S: how what a
    clipped command did not carry out is forgotten, W u = T r - R y + (W - S) taken. b_r, a_r: the
    filter T B_m/A_m of the reference. friction: NO_COUNTERMEASURE, COMPENSATOR with law (14,),
    DISTURBANCE, KALMAN with kalman (6,), or FEED_FORWARD with law (7,); period h [s]; b_v ... a_c:
    the filters of velocity (of the force, DISTURBANCE; of the reference, FEED_FORWARD), error (of
    the position, DISTURBANCE; acceleration of the reference, FEED_FORWARD) and C.

    k_i, k_int: gains of the force error [V/N] and of its sum; k_a: of a motor, whose position
    controller wants volts, or 0; limit: of the command [V]; force_limit: of the force reference
    [N]; rate: what the reference may move in a sample [m], acceleration: by how much that may
    change from one to the next, with which goes a finite rate; each may be infinite. ratio: samples
    of the force loop in one of the position controller.

    SCHEDULED_LAW: knots (k,) of what it is scheduled over, rows (k n,) of its table, see
    `design.schedule`; decay: of what was not carried out, span: step of the reference [m] from
    which its direction is known.
    """

    position: int
    R: Array
    S: Array
    W: Array
    b_r: Array
    a_r: Array
    pid: Array
    friction: int
    law: Array
    b_v: Array
    a_v: Array
    b_e: Array
    a_e: Array
    b_c: Array
    a_c: Array
    kalman: Array
    h: float
    k_i: float
    k_int: float
    k_a: float
    limit: float
    force_limit: float
    rate: float
    acceleration: float
    ratio: int
    over: int
    knots: Array
    rows: Array
    decay: float
    span: float


class Memory(NamedTuple):
    """A servo's state: controller, PID (3,), filters of reference, velocity, error and C, Kalman
    filter (12,), what the last sample left (4,), reference moved, sum of the force error, a motor's
    command, the reference's last step, the reference itself, its own last step, by how much that
    changed, and its step where it was smooth (8,), the force loop's samples since the position
    controller's turn (1,). now: the active row of a schedule (n,)."""

    x: Array
    pid: Array
    z_r: Array
    z_v: Array
    z_e: Array
    z_c: Array
    kalman: Array
    last: Array
    past: Array
    turn: IntArray
    now: Array


@compiled
def kalman_step(c: Array, s: Array, h: float, y: float, F: float) -> None:
    """One sample of the friction observer `c` (6,), its memory s (12,): predict by F, correct by y.

    The velocity is stepped exactly under a zero-order-hold force: v+ = e v + (1 - e)/F_v (F - F_f).
    """
    f = c[K_FVP] if s[1] >= 0.0 else c[K_FVN]
    e = np.exp(-f * h / c[K_M])
    gain = (1.0 - e) / f if f * h > 1e-9 * c[K_M] else h / c[K_M]
    s[0], s[1] = s[0] + h * s[1], e * s[1] + gain * (F - s[2])
    # P = A P A' + Q, row by row in s[3:]: numpy's matrix products compile for ten seconds.
    for j in range(3):
        s[3 + j] += h * s[6 + j]
        s[6 + j] = e * s[6 + j] - gain * s[9 + j]
    for i in range(3, 12, 3):
        s[i] += h * s[i + 1]
        s[i + 1] = e * s[i + 1] - gain * s[i + 2]
    s[7] += c[K_QV] ** 2 * h
    s[11] += c[K_QF] ** 2 * h
    off, variance = y - s[0], s[3] + c[K_R_Y] ** 2
    p_0, p_1, p_2 = s[3], s[4], s[5]
    for i in range(3):
        k = s[3 + 3 * i] / variance
        s[i] += k * off
        s[3 + 3 * i] -= k * p_0
        s[4 + 3 * i] -= k * p_1
        s[5 + 3 * i] -= k * p_2
    for i, j in ((4, 6), (5, 9), (8, 10)):
        s[i] = s[j] = 0.5 * (s[i] + s[j])


@compiled_exact
def friction_force(c: Law, s: Memory, r: float, y: float, F: float) -> float:
    """F_compf [N]: what is added to the force reference at reference r, position y [m], force F."""
    last = s.last
    if c.friction == COMPENSATOR:
        last[SPEED] = filtered(c.b_v, c.a_v, s.z_v, y)
        e_y = r - filtered(c.b_e, c.a_e, s.z_e, y)
        last[RAW] = compensation_force(c.law, last[SPEED], e_y, F)
        last[ADDED] = filtered(c.b_c, c.a_c, s.z_c, last[RAW])
    elif c.friction == DISTURBANCE:
        force = filtered(c.b_v, c.a_v, s.z_v, F)
        last[RAW] = force - filtered(c.b_e, c.a_e, s.z_e, y)
        last[ADDED] = last[RAW]
    elif c.friction == KALMAN:
        kalman_step(c.kalman, s.kalman, c.h, y, F)
        last[SPEED], last[RAW], last[ADDED] = s.kalman[1], s.kalman[2], s.kalman[2]
    elif c.friction == FEED_FORWARD:
        last[SPEED] = filtered(c.b_v, c.a_v, s.z_v, r)
        last[RAW] = filtered(c.b_e, c.a_e, s.z_e, r)
        friction = s.now if c.position == SCHEDULED_LAW else c.law
        last[ADDED] = feed_forward_force(c.law, friction, last[SPEED], last[RAW])
    return float(last[ADDED])


@compiled_exact
def profiled(rate: float, acceleration: float, past: Array, r: float) -> float:
    """The reference [m] moved towards r within its speed and acceleration, so that it stops there.

    One whose acceleration does not leap is a path and taken as it is, however fast; after a step
    or a kink it is caught up with, speed and acceleration being relative to what it goes on with.
    From a speed v the way to a stop is v^2/(2 a) at most.
    """
    left, step = r - past[R_MOVED], past[R_STEP]
    behind, pace = past[R_BEFORE] - past[R_MOVED], r - past[R_BEFORE]
    turn = pace - past[R_PACE]
    smooth = abs(turn - past[R_TURN]) <= PATH_TURN * acceleration
    smooth = smooth and abs(turn) <= PATH_ACCELERATION * acceleration
    past[R_BEFORE], past[R_PACE], past[R_TURN] = r, pace, turn
    change = acceleration
    if smooth:
        past[R_GOES] = pace
        step += turn  # it turns with the path
        change = max(acceleration - abs(turn), LEAST_CHASE * acceleration)
    goes = past[R_GOES]
    most = abs(goes) + rate
    path = smooth and behind == 0.0
    gap = left - goes  # to where the reference goes on, at what it goes on with
    near = abs(left - step) <= change and abs(gap) <= change
    if path or (near and abs(left) <= most):
        past[R_STEP] = left
        past[R_MOVED] = r
    else:
        way = 1.0 if gap >= 0.0 else -1.0
        ahead, speed = abs(gap), way * (step - goes)
        faster = speed + change
        if faster > 0.0 and ahead - faster < faster * (faster - change) / (2.0 * change):
            faster = speed
            if speed > 0.0 and ahead - speed < speed * (speed - change) / (2.0 * change):
                faster = speed - change
        past[R_STEP] = min(max(goes + way * faster, -most), most)
        past[R_MOVED] += past[R_STEP]
    return float(past[R_MOVED])


@compiled_exact
def look_up(c: Law, s: Memory, aim: float, force: float) -> None:
    """Makes the row of the schedule active: straight between its knots, constant beyond them."""
    at = aim
    if c.over == OVER_LOAD:
        at = abs(force)
    elif c.over == OVER_DIRECTION:
        at = (aim - s.pid[R_LAST]) / c.span
    for j in range(len(s.now)):
        s.now[j] = c.rows[j]
    for k in range(len(c.knots) - 1):
        share = min(max((at - c.knots[k]) / (c.knots[k + 1] - c.knots[k]), 0.0), 1.0)
        for j in range(len(s.now)):
            s.now[j] += share * (c.rows[(k + 1) * len(s.now) + j] - c.rows[k * len(s.now) + j])


@compiled_exact
def scheduled_force(s: Memory, r: float, y: float) -> float:
    """What the active row asks for at r and y: nothing of it depends on where they are from."""
    n, now = len(s.x), s.now
    dr, dy = r - s.pid[R_LAST], y - s.pid[Y_LAST]
    change = now[4] * (r - y) + now[5] * dr - now[5 + n] * dy + s.x[0]
    for j in range(n - 1):
        s.x[j] = s.x[j + 1] + now[6 + j] * dr - now[6 + n + j] * dy - now[5 + 2 * n + j] * change
    s.pid[R_LAST] = r
    s.pid[Y_LAST] = y
    return float(s.pid[BASE] + change)


@compiled_exact
def position_force(c: Law, s: Memory, r: float, y: float) -> float:
    """What the position controller asks for at reference r and position y [m]."""
    if c.position == RST_LAW:
        fed = filtered(c.b_r, c.a_r, s.z_r, r)
        return float(fed - c.R[0] * y + s.x[0])
    if c.position == SCHEDULED_LAW:
        return scheduled_force(s, r, y)
    e = r - y
    s.pid[SLOPE] = c.pid[POLE] * s.pid[SLOPE] + c.pid[PER_DIFFERENCE] * (e - s.pid[ERROR])
    if c.pid[RULE] == RESET and e * s.pid[ERROR] < 0.0:
        s.pid[SUM] = 0.0
    s.pid[ERROR] = e
    return float(c.pid[K_R] * (e + s.pid[SUM] + s.pid[SLOPE]))


@compiled_exact
def position_moved(c: Law, s: Memory, y: float, asked: float, taken: float) -> None:
    """The position controller's next state, after `taken` of the `asked` was carried out."""
    if c.position == RST_LAW:
        shift(s.x, c.R, c.S, y, taken)
        for j in range(len(s.x) - 1):
            s.x[j] -= c.W[j + 1] * (asked - taken)
        return
    if c.position == SCHEDULED_LAW:
        s.pid[BASE] = taken + c.decay * (asked - taken)
        return
    e = s.pid[ERROR]
    outward = (asked - taken) * e * c.pid[K_R] > 0.0
    inside = c.pid[RULE] == DEAD_ZONE and abs(e) <= c.pid[ZONE]
    if not (outward or inside):
        s.pid[SUM] += c.pid[PER_SUM] * e


@compiled_exact
def servo_step(c: Law, s: Memory, r: float, y: float, F: float, shake: float) -> float:
    """Command [V] of one sample at reference r, position y [m] and force F [N]; shake: the dither.

    Without a force loop, k_i = 0, the position controller gives the command. A motor's force is not
    measured: it is that of the command before. Where the command is clipped, what was carried out
    is the force reference that gives it.
    """
    aim = r
    if c.acceleration < math.inf:
        aim = profiled(c.rate, c.acceleration, s.past, r)
    elif c.rate < math.inf:
        aim = s.past[R_MOVED] + min(max(r - s.past[R_MOVED], -c.rate), c.rate)
        s.past[R_MOVED] = aim
    acts = c.ratio == 1 or s.turn[0] == 0
    if c.position == SCHEDULED_LAW and acts:
        if c.friction == FEED_FORWARD:
            look_up(c, s, aim, s.last[ADDED])
        else:
            look_up(c, s, aim, c.k_a * s.past[U_BEFORE] if c.k_a != 0.0 else F)
    asked = position_force(c, s, aim, y) if acts else s.last[WANTED]
    added = 0.0
    if c.friction == FEED_FORWARD:
        added = friction_force(c, s, aim, y, 0.0) if acts else s.last[ADDED]
    elif c.friction != NO_COUNTERMEASURE:
        force = c.k_a * s.past[U_BEFORE] if c.k_a != 0.0 else F
        added = friction_force(c, s, aim, y, force) if acts else s.last[ADDED]
    if c.k_a != 0.0 or c.k_i == 0.0:
        free = asked + added / c.k_a if c.k_a != 0.0 and c.friction != NO_COUNTERMEASURE else asked
        u = min(max(free, -c.limit), c.limit)
        taken = asked + (u - free)
        s.last[WANTED] = asked
    else:
        wanted = asked + added if c.friction != NO_COUNTERMEASURE else asked
        total = min(max(wanted, -c.force_limit), c.force_limit)
        before = s.past[INTEGRAL_SUM]
        u, free, s.past[INTEGRAL_SUM] = force_command(total, F, before, c.k_i, c.k_int, c.limit)
        s.last[WANTED] = total - added if c.friction != NO_COUNTERMEASURE else total
        taken = s.last[WANTED]
        if u != free and c.k_i > 0.0:
            taken = F + (u - before) / c.k_i - added
    if shake != 0.0:
        u = min(max(u + shake, -c.limit), c.limit)
    if acts:
        position_moved(c, s, y, asked, taken)
    by_friction = c.friction != NO_COUNTERMEASURE and c.friction != FEED_FORWARD
    by_load = c.position == SCHEDULED_LAW and c.over == OVER_LOAD
    by_load = by_load and c.friction != FEED_FORWARD
    if c.k_a != 0.0 and (by_friction or by_load):
        s.past[U_BEFORE] = u
    if c.ratio > 1:
        s.turn[0] = s.turn[0] + 1 if s.turn[0] + 1 < c.ratio else 0
    return float(u)
