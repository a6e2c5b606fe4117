"""The sampled closed loop, compiled: one plant, or WIDTH plants as a structure of arrays.

Sample k: y and F are measured, u follows from them, and is constant over [k, k+1), which the plant
covers in one exact step (`identification.simulation.karnopp_step`). Paper, figures 5 and 10;
figure 1, upper.
"""

import numpy as np

from identification.arrays import Array, IntArray
from identification.compiled import compiled, compiled_exact, compiled_inline
from identification.simulation.karnopp_lanes import (
    GAIN,
    V_OLD,
    WIDTH,
    WORK_ROWS,
    F,
    V,
    Y,
    advance,
    place,
    prepare_lanes,
    resolve_flagged,
    work_space,
)
from identification.simulation.karnopp_step import (
    COLUMNS,
    F_HI,
    F_LO,
    K1,
    K2,
    MODES,
    STUCK,
    exact_step,
    mode_at,
    mode_row,
    mode_table,
    parameters,
    resolve,
)

Leading = tuple[float, float, float, float, float]
# Rows that a loop adds to the work array of a block, the last being the controller's state.
(
    Y_MEASURED, RST_OUTPUT, INTEGRAL, Y_NOISE, F_NOISE, SQUARED_ERROR, SQUARED_COMMAND,
    U_OLD, Y_OLD, F_OLD, RST_STATE,
) = range(WORK_ROWS, WORK_ROWS + 11)  # fmt: skip
# What a block records.
RECORD_Y, RECORD_F, RECORD_V, RECORD_U, RECORD_MODE = range(5)
RECORDS = 5


@compiled_exact
def force_command(
    wanted: float, force: float, integral: float, k_p: float, k_int: float, limit: float
) -> tuple[float, float, float]:
    """Command [V] of the PI force controller, clipped and not, and its next integral.

    The integral rests while the command is clipped and the error would drive it further out.
    """
    error = wanted - force
    free = k_p * error + integral
    u = min(max(free, -limit), limit)
    driving = 0.0 if (free - u) * error > 0.0 else error
    return u, free, integral + k_int * driving


@compiled_exact
def shift(x: Array, R: Array, S: Array, y: float, u: float) -> None:
    """Next state x (deg+1,), last entry 0, of S u = T r - R y in observer form."""
    for j in range(len(x) - 1):
        x[j] = x[j + 1] - R[j + 1] * y - S[j + 1] * u


@compiled
def loop_kernel(
    p: Array,
    h: float,
    ratio: int,
    feed: Array,
    R: Array,
    S: Array,
    x: Array,
    pi: tuple[float, float],
    limit: float,
    noise_y: Array,
    noise_f: Array,
    start: tuple[float, float, float],
    out: Array,
    modes: IntArray,
) -> None:
    """One plant p (1, 11) with actuator and force loop: out (4, n) takes y, v, F, u; modes (n,).

    The position controller runs at every `ratio`-th sample and its force reference is a zero-order
    hold. feed: T r at those samples; x: state of the position controller (deg+1,); pi: gains of the
    force error and of its sum; limit: of the command [V], or infinite; noise (n,) on y and F.
    """
    table = np.zeros((MODES, COLUMNS))
    plant = parameters(p, 0)
    mode_table(plant, h, table)
    k1, k2 = plant[K1], plant[K2]
    k_p, k_int = pi
    y, v, force = start
    mode = mode_at(plant, v, force)
    v = 0.0 if mode == STUCK else v
    row = mode_row(table, mode)
    r_0, integral, wanted = R[0], 0.0, 0.0
    due, turn = 0, 0
    for k in range(len(modes)):
        if k == due:
            measured = y + noise_y[k]
            wanted = feed[turn] - r_0 * measured + x[0]
            shift(x, R, S, measured, wanted)
            due, turn = due + ratio, turn + 1
        u, _, integral = force_command(wanted, force + noise_f[k], integral, k_p, k_int, limit)
        out[0, k], out[1, k], out[2, k], out[3, k] = y, v, force, u
        modes[k] = mode
        g = k1 * u
        moved, v_next, force_next, left = exact_step(row, k2, h, v, force, g)
        if left:
            y, v, force, mode = resolve(plant, y, v, force, mode, g, h)
            row = mode_row(table, mode)
        else:
            y, v, force = y + moved, v_next, force_next


@compiled
def motor_kernel(
    p: Array,
    h: float,
    feed: Array,
    R: Array,
    S: Array,
    x: Array,
    limit: float,
    noise_y: Array,
    start: tuple[float, float, float],
    out: Array,
    modes: IntArray,
) -> None:
    """One plant with a motor, F = k1 u constant over the sample; arguments as in `loop_kernel`.

    The recursion of the controller takes the command as clipped: its anti-windup.
    """
    table = np.zeros((MODES, COLUMNS))
    plant = parameters(p, 0)
    mode_table(plant, h, table)
    k_a = plant[K1]
    y, v, _ = start
    mode = STUCK if v == 0.0 else mode_at(plant, v, 0.0)
    row = mode_row(table, mode)
    for k in range(len(feed)):
        measured = y + noise_y[k]
        u = min(max(feed[k] - R[0] * measured + x[0], -limit), limit)
        shift(x, R, S, measured, u)
        force = k_a * u
        if force < row[F_LO] or force > row[F_HI]:
            mode = mode_at(plant, v, force)
            v = 0.0 if mode == STUCK else v
            row = mode_row(table, mode)
        out[0, k], out[1, k], out[2, k], out[3, k] = y, v, force, u
        modes[k] = mode
        moved, v_next, _, left = exact_step(row, 0.0, h, v, force, 0.0)
        if left:
            y, v, _, mode = resolve(plant, y, v, force, mode, 0.0, h)
            row = mode_row(table, mode)
        else:
            y, v = y + moved, v_next


@compiled_inline
def shift_lane(s: Array, i: int, leading: Leading, y: float, u: float) -> None:
    """`shift` of lane `i`, the first two entries; a PID has no more."""
    _, r_1, r_2, s_1, s_2 = leading
    at = RST_STATE * WIDTH + i
    s[at] = s[at + WIDTH] - r_1 * y - s_1 * u
    s[at + WIDTH] = s[at + 2 * WIDTH] - r_2 * y - s_2 * u
    s[Y_MEASURED * WIDTH + i] = y
    s[RST_OUTPUT * WIDTH + i] = u


@compiled_inline
def shift_rest(s: Array, R: Array, S: Array, lanes: int) -> None:
    """`shift` of all lanes, the entries from the third on."""
    for j in range(2, len(R) - 1):
        r_j, s_j, x = R[j + 1], S[j + 1], (RST_STATE + j) * WIDTH
        for i in range(lanes):
            y, u = s[Y_MEASURED * WIDTH + i], s[RST_OUTPUT * WIDTH + i]
            s[x + i] = s[x + WIDTH + i] - r_j * y - s_j * u


@compiled_inline
def draw_noise(s: Array, row: int, noise: Array, k: int, lanes: int) -> None:
    """Noise of sample `k` for every lane, into `row`."""
    for i in range(lanes):
        s[row * WIDTH + i] = noise[k, i]


@compiled
def record_sample(s: Array, modes: IntArray, base: int, k: int, traces: Array) -> None:
    """Sample `k` of a block, before its switches, into traces (RECORDS, n, plants)."""
    for i in range(WIDTH):
        traces[RECORD_Y, k, base + i] = s[Y_OLD * WIDTH + i]
        traces[RECORD_V, k, base + i] = s[V_OLD * WIDTH + i]
        traces[RECORD_F, k, base + i] = s[F_OLD * WIDTH + i]
        traces[RECORD_U, k, base + i] = s[U_OLD * WIDTH + i]
        traces[RECORD_MODE, k, base + i] = modes[i]


@compiled_inline
def count(s: Array, i: int, error: float, u: float, weight: float) -> None:
    """Add the squares to the sums of lane `i`."""
    s[SQUARED_ERROR * WIDTH + i] += weight * (error * error)
    s[SQUARED_COMMAND * WIDTH + i] += weight * (u * u)


@compiled
def march_loop(
    p: Array,
    tables: Array,
    s: Array,
    modes: IntArray,
    h: float,
    reference: Array,
    weights: Array,
    feed: Array,
    R: Array,
    S: Array,
    pi: tuple[float, float],
    limit: float,
    noise_y: Array,
    noise_f: Array,
    base: int,
    traces: Array,
) -> None:
    """A block's loops, noise (n, WIDTH) or (n, 1), into traces (RECORDS, n, plants) from `base` on.

    Nothing is recorded where `traces` has no samples.
    """
    lanes, (k_p, k_int) = len(modes), pi
    common_y, common_f = noise_y.shape[1] == 1, noise_f.shape[1] == 1
    keep = traces.shape[1] > 0
    leading = R[0], R[1], R[2], S[1], S[2]  # local: a load from an array could follow a store
    for k in range(len(feed)):
        fed, r, weight, flagged = feed[k], reference[k], weights[k], 0
        n_y = noise_y[k, 0] if common_y else 0.0
        n_f = noise_f[k, 0] if common_f else 0.0
        if not common_y:
            draw_noise(s, Y_NOISE, noise_y, k, lanes)
        if not common_f:
            draw_noise(s, F_NOISE, noise_f, k, lanes)
        for i in range(WIDTH):
            y, force = s[Y * WIDTH + i], s[F * WIDTH + i]
            measured = y + (n_y + s[Y_NOISE * WIDTH + i])
            wanted = fed - leading[0] * measured + s[RST_STATE * WIDTH + i]
            felt = force + (n_f + s[F_NOISE * WIDTH + i])
            u, _, s[INTEGRAL * WIDTH + i] = force_command(
                wanted, felt, s[INTEGRAL * WIDTH + i], k_p, k_int, limit
            )
            shift_lane(s, i, leading, measured, wanted)
            s[Y_OLD * WIDTH + i], s[F_OLD * WIDTH + i], s[U_OLD * WIDTH + i] = y, force, u
            count(s, i, r - y, u, weight)
            flagged |= advance(s, i, h, force, s[GAIN * WIDTH + i] * u)
        shift_rest(s, R, S, lanes)
        if keep:
            record_sample(s, modes, base, k, traces)
        if flagged:
            resolve_flagged(flagged, s, modes, tables, p, h, s, Y_OLD * WIDTH)


@compiled
def march_motor(
    p: Array,
    tables: Array,
    s: Array,
    modes: IntArray,
    h: float,
    reference: Array,
    weights: Array,
    feed: Array,
    R: Array,
    S: Array,
    limit: float,
    noise_y: Array,
    base: int,
    traces: Array,
) -> None:
    """As `march_loop`, for plants with a motor."""
    lanes, common_y = len(modes), noise_y.shape[1] == 1
    keep = traces.shape[1] > 0
    leading = R[0], R[1], R[2], S[1], S[2]
    for k in range(len(feed)):
        fed, r, weight, flagged = feed[k], reference[k], weights[k], 0
        n_y = noise_y[k, 0] if common_y else 0.0
        if not common_y:
            draw_noise(s, Y_NOISE, noise_y, k, lanes)
        for i in range(WIDTH):
            y = s[Y * WIDTH + i]
            measured = y + (n_y + s[Y_NOISE * WIDTH + i])
            u = min(max(fed - leading[0] * measured + s[RST_STATE * WIDTH + i], -limit), limit)
            force = s[GAIN * WIDTH + i] * u
            shift_lane(s, i, leading, measured, u)
            s[Y_OLD * WIDTH + i], s[F_OLD * WIDTH + i], s[U_OLD * WIDTH + i] = y, force, u
            s[F * WIDTH + i] = force
            count(s, i, r - y, u, weight)
            outside = (force < s[F_LO * WIDTH + i]) | (force > s[F_HI * WIDTH + i])
            flagged |= int(outside) << i
        if flagged:
            for i in range(WIDTH):
                if flagged >> i & 1:
                    y, v, force = s[Y * WIDTH + i], s[V * WIDTH + i], s[F * WIDTH + i]
                    place(s, modes, tables, p, i, y, v, force)
            flagged = 0
        for i in range(WIDTH):
            flagged |= advance(s, i, h, s[F * WIDTH + i], 0.0)
        shift_rest(s, R, S, lanes)
        if keep:
            record_sample(s, modes, base, k, traces)
        if flagged:
            resolve_flagged(flagged, s, modes, tables, p, h, s, Y_OLD * WIDTH)


@compiled
def loops_kernel(
    p: Array,
    h: float,
    motor: bool,
    reference: Array,
    feed: Array,
    R: Array,
    S: Array,
    x: Array,
    pi: tuple[float, float],
    limit: float,
    noise_y: Array,
    noise_f: Array,
    start: tuple[float, float, float],
    weights: Array,
    traces: Array,
    costs: Array,
) -> None:
    """Loops of many plants p (plants, 11), plants a multiple of WIDTH, block by block.

    noise: (blocks, n, WIDTH), or (1, n, 1) for all; R, S: (deg+1,) with deg >= 2; traces:
    (RECORDS, n, plants), or (RECORDS, 0, plants) for none; costs: (2, plants) takes the sums of
    the squared error and command, weighted by weights (n,).
    """
    _, modes, tables = work_space()
    s = np.zeros((RST_STATE + len(x)) * WIDTH)
    for base in range(0, len(p), WIDTH):
        plants = p[base : base + WIDTH]
        s[:] = 0.0
        prepare_lanes(plants, h, tables, s)
        for i in range(WIDTH):
            place(s, modes, tables, plants, i, start[0], start[1], start[2])
            for j in range(len(x)):
                s[(RST_STATE + j) * WIDTH + i] = x[j]
        block = (plants, tables, s, modes, h, reference, weights, feed, R, S)
        n_y = noise_y[min(base // WIDTH, len(noise_y) - 1)]
        n_f = noise_f[min(base // WIDTH, len(noise_f) - 1)]
        if motor:
            march_motor(*block, limit, n_y, base, traces)
        else:
            march_loop(*block, pi, limit, n_y, n_f, base, traces)
        costs[0, base : base + WIDTH] = s[SQUARED_ERROR * WIDTH : (SQUARED_ERROR + 1) * WIDTH]
        costs[1, base : base + WIDTH] = s[SQUARED_COMMAND * WIDTH : (SQUARED_COMMAND + 1) * WIDTH]
