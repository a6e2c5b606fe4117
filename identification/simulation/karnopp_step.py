"""Exact steps of the Karnopp plant with located mode switches (compiled).

Between two samples the sliding and the stuck body are linear systems, so a sample without a
switch is one exact affine step; a sample with a switch is followed from event to event. There is
no internal step whose size could show in the result. Equations: paper, eq. (1), with
m dv/dt = F - F_f, dF/dt = g - k2 v, where g = k1 u, or the slope of a measured force with k2 = 0.

Modes. At the edge of the band a body whose slip friction exceeds the driving force, while the
driving force exceeds the stick limit, can neither leave the band nor stop: it slides along the
edge (the limit of ever finer steps of eq. (1)), which is a mode of its own.
"""

import numpy as np

from identification.arrays import Array
from identification.compiled import compiled, compiled_inline
from identification.simulation.motion_series import (
    motion,
    power_sum,
    series,
    term,
    time_of_fall,
    turning_point,
)

STUCK, SLIP_P, SLIP_N, BAND_P, BAND_N, EDGE_P, EDGE_N = range(7)
MODES = 7
# Plant parameters as rows of the kernels: the nine in the order of karnopp.NAMES, then k1, k2.
M, F_CP, F_CN, F_VP, F_VN, DV_P, DV_N, F_SP, F_SN, K1, K2 = range(11)
PARAMETERS = 11
# Columns of a mode's row: v+ = a11 v + a12 (F-c) + b1 g, dy = p1 v + p2 (F-c) + p3 g, then the
# region in which the step holds; l1 v + l2 (F-c) is a velocity that the sample cannot dip below.
A11, A12, B1, P1, P2, P3, C, V_LO, V_HI, F_LO, F_HI, L1, L2 = range(13)
COLUMNS = 13
Row = tuple[
    float, float, float, float, float, float, float, float, float, float, float, float, float
]
RATE_STEP = 0.35  # longest stretch of one series, in units of the fastest rate: its rest is 1e-14
SHORT_STEP = 0.1  # the same, of a shorter series
# Within a quarter of an oscillation acceleration rises while it is negative, and the force in the
# band does not fall below its limit and come back; in longer samples every step is followed.
QUARTER = 1.5
SMALLEST_BAND = 1e-9  # m/s; a band of zero width would leave rest undefined
MAX_EVENTS = 200  # switches within one sample
MAX_PIECES = 5_000  # series of one sample
# Tuples, not arrays, go to what runs in an event: arrays would be counted in and out of each call.
Parameters = tuple[float, float, float, float, float, float, float, float, float, float, float]


@compiled_inline
def parameters(p: Array, lane: int) -> Parameters:
    """The kernel parameters of a lane of p (lanes, 11), in the order M ... K2."""
    return (
        p[lane, M],
        p[lane, F_CP],
        p[lane, F_CN],
        p[lane, F_VP],
        p[lane, F_VN],
        p[lane, DV_P],
        p[lane, DV_N],
        p[lane, F_SP],
        p[lane, F_SN],
        p[lane, K1],
        p[lane, K2],
    )


@compiled
def mode_at(p: Parameters, v: float, force: float) -> int:
    """Mode of a body at velocity `v` under `force`: eq. (1), with the edge of the band."""
    dv_p, dv_n, f_sp, f_sn = p[DV_P], p[DV_N], p[F_SP], p[F_SN]
    slip_p = p[F_CP] + p[F_VP] * dv_p
    slip_n = -p[F_CN] + p[F_VN] * dv_n
    mode = STUCK
    if v > dv_p or (v == dv_p and force >= slip_p and force > f_sp):
        mode = SLIP_P
    elif v < dv_n or (v == dv_n and force <= slip_n and force < f_sn):
        mode = SLIP_N
    elif force > f_sp:
        mode = EDGE_P if v == dv_p else BAND_P
    elif force < f_sn:
        mode = EDGE_N if v == dv_n else BAND_N
    return mode


@compiled
def _sliding_exit(
    slip: bool,
    v: float,
    force: float,
    g: float,
    left: float,
    m: float,
    coulomb: float,
    viscous: float,
    edge: float,
    stick: float,
    k2: float,
) -> tuple[float, float, float, int]:
    """Time, distance, velocity until a sliding (or band) mode in positive direction ends, and why.

    Why: 1 at the edge of the band, 2 at the limit of the force, 0 where it lasts (the time is
    then `left`, or less where one series does not reach that far).
    """
    w = 1.0 / m
    alpha, beta = (viscous * w if slip else 0.0), k2 * w
    span = left
    if alpha * left > RATE_STEP or beta * left * left > RATE_STEP * RATE_STEP:
        span = min(left, RATE_STEP / max(alpha, np.sqrt(beta)))
    c = series(v, force - (coulomb if slip else stick), g, alpha, beta, w)
    moved, v_end, a_end = motion(c, span)
    if slip:
        high = span
        end = v_end
        if end >= edge and c[1] < 0.0 < a_end and v + c[1] * span < edge:
            high = turning_point(c, span)
            end = motion(c, high)[1]
        if end >= edge:
            return span, moved, v_end, 0
        tau, moved = time_of_fall(c, -edge, 0.0, 0.0, 1.0, end - edge, high)
        return tau, moved, edge, 1
    # Force first: in the band velocity rises as long as the force is above the limit, no longer.
    tau, found = span, 0
    excess = force - stick
    end = excess + g * span - k2 * moved
    if end < 0.0:
        tau, moved = time_of_fall(c, excess, g, k2, 0.0, end, span)
        v_end, found = power_sum(c, tau), 2
    if v_end > edge:
        tau, moved = time_of_fall(c, edge, 0.0, 0.0, -1.0, edge - v_end, tau)
        v_end, found = edge, 1
    return tau, moved, v_end, found


@compiled_inline
def _after_exit(mode: int, p: Parameters, force: float, found: int) -> tuple[float, int]:
    """Velocity and mode after a sliding or band mode has ended at the edge or at the limit."""
    if found == 2:
        return 0.0, STUCK
    f_sp, f_sn = p[F_SP], p[F_SN]
    if mode in (SLIP_P, BAND_P):
        edge = p[DV_P]
        if force > f_sp:
            slips = mode == BAND_P and force >= p[F_CP] + p[F_VP] * edge
            return edge, (SLIP_P if slips else EDGE_P)
        return (0.0, STUCK) if force >= f_sn else (edge, BAND_N)
    edge = p[DV_N]
    if force < f_sn:
        slips = mode == BAND_N and force <= -p[F_CN] + p[F_VN] * edge
        return edge, (SLIP_N if slips else EDGE_N)
    return (0.0, STUCK) if force <= f_sp else (edge, BAND_P)


@compiled_inline
def _constant_speed_exit(
    mode: int, p: Parameters, force: float, slope: float, left: float
) -> tuple[float, int]:
    """Time and next mode of a body at constant velocity (stuck, or along an edge)."""
    if mode == STUCK:
        low, high, below, above = p[F_SN], p[F_SP], BAND_N, BAND_P
    elif mode == EDGE_P:
        low, below, above = p[F_SP], STUCK, SLIP_P
        high = p[F_CP] + p[F_VP] * p[DV_P]
    else:
        high, below, above = p[F_SN], SLIP_N, STUCK
        low = -p[F_CN] + p[F_VN] * p[DV_N]
    tau, following = left, mode
    if force + slope * left > high:
        tau, following = max(0.0, (high - force) / slope), above
    elif force + slope * left < low:
        tau, following = max(0.0, (low - force) / slope), below
    return tau, following


@compiled
def resolve(
    p: Parameters, y: float, v: float, force: float, mode: int, g: float, h: float
) -> tuple[float, float, float, int]:
    """Position, velocity, force and mode after `h` [s], every switch on the way located.

    p: from `parameters`; g: k1 u, or the slope of the force [N/s].
    """
    y, v, force, mode, left = resolve_until(p, y, v, force, mode, g, h, MAX_EVENTS)
    # More switches, or a body lighter, than any machine's: no answer is better than one with time
    # missing.
    return (y if left <= 0.0 else np.nan), v, force, mode


@compiled
def resolve_until(
    p: Parameters, y: float, v: float, force: float, mode: int, g: float, h: float, most: int
) -> tuple[float, float, float, int, float]:
    """As `resolve`, after so many switches at most, and what is then left of `h` [s]."""
    left, k2, switches = h, p[K2], 0
    pieces = 0 if np.isfinite(y) else MAX_PIECES  # a run that was lost stays so
    while left > 0.0 and switches < most and pieces < MAX_PIECES:
        pieces += 1
        if mode in (STUCK, EDGE_P, EDGE_N):
            slope = g - k2 * v
            tau, following = _constant_speed_exit(mode, p, force, slope, left)
            y += v * tau
            force += slope * tau
            left -= tau
            switches += 1
            if following == STUCK:
                v = 0.0
            mode = following
            continue
        if mode in (SLIP_P, BAND_P):
            side, coulomb, viscous = 1.0, p[F_CP], p[F_VP]
            edge, stick = p[DV_P], p[F_SP]
        else:
            side, coulomb, viscous = -1.0, p[F_CN], p[F_VN]
            edge, stick = -p[DV_N], -p[F_SN]
        tau, moved, v, found = _sliding_exit(
            mode in (SLIP_P, SLIP_N),
            side * v,
            side * force,
            side * g,
            left,
            p[M],
            coulomb,
            viscous,
            edge,
            stick,
            k2,
        )
        v *= side
        moved *= side
        y += moved
        force += g * tau - k2 * moved
        left -= tau
        if found > 0:
            switches += 1
            v, mode = _after_exit(mode, p, force, found)
    return y, v, force, mode, left


@compiled_inline
def glided(
    p: Parameters, v: float, force: float, mode: int, g: float, h: float
) -> tuple[float, float, bool]:
    """Distance and velocity after a short `h` [s] of sliding, and whether that is what happens.

    A shorter series than `resolve` takes, where it errs by less than 1e-10 and v stays beyond the
    band: v + h v'(0) bounds a dip in between (see QUARTER).
    """
    side, coulomb, viscous, edge = 1.0, p[F_CP], p[F_VP], p[DV_P]
    if mode == SLIP_N:
        side, coulomb, viscous, edge = -1.0, p[F_CN], p[F_VN], -p[DV_N]
    w = 1.0 / p[M]
    alpha, beta, speed = viscous * w, p[K2] * w, side * v
    c1 = w * (side * force - coulomb) - alpha * speed
    c2 = 0.5 * (w * side * g - beta * speed - alpha * c1)
    c3 = term(3, alpha, beta, c1, c2)
    c4 = term(4, alpha, beta, c2, c3)
    c5 = term(5, alpha, beta, c3, c4)
    c6 = term(6, alpha, beta, c4, c5)
    after = speed + h * (c1 + h * (c2 + h * (c3 + h * (c4 + h * (c5 + h * c6)))))
    moved = h * (c1 / 2 + h * (c2 / 3 + h * (c3 / 4 + h * (c4 / 5 + h * (c5 / 6 + h * c6 / 7)))))
    moved = h * (speed + moved)
    short = alpha * h < SHORT_STEP and abs(beta) * h * h < SHORT_STEP * SHORT_STEP
    on = min(speed, speed + c1 * h, after) > edge and mode in (SLIP_P, SLIP_N)
    return side * moved, side * after, short and on


@compiled
def _free_response(m: float, f: float, k2: float, h: float, row: Array) -> None:
    """Exact affine step over `h` of v and dy, from three basis responses, into `row`."""
    rate = max(f / m, np.sqrt(k2 / m))
    # Lighter than any machine's body: a run that cannot be followed.
    if rate * h > MAX_PIECES * RATE_STEP:
        row[:] = np.nan
        return
    pieces = max(1, int(np.ceil(rate * h / RATE_STEP)))
    piece = h / pieces
    for basis in range(3):
        v, phi, g, y = 0.0, 0.0, 0.0, 0.0
        if basis == 0:
            v = 1.0
        elif basis == 1:
            phi = 1.0
        else:
            g = 1.0
        for _ in range(pieces):
            moved, v, _ = motion(series(v, phi, g, f / m, k2 / m, 1.0 / m), piece)
            y += moved
            phi += g * piece - k2 * moved
        row[A11 + basis] = v
        row[P1 + basis] = y


@compiled
def mode_table(p: Parameters, h: float, table: Array) -> None:
    """Fill `table` (MODES, COLUMNS) with the exact step of every mode over `h` [s]."""
    m, f_sp, f_sn, k2 = p[M], p[F_SP], p[F_SN], p[K2]
    table[:, :] = 0.0
    table[:, V_LO] = -np.inf
    table[:, V_HI] = np.inf
    table[:, F_LO] = -np.inf
    table[:, F_HI] = np.inf
    table[STUCK, F_LO], table[STUCK, F_HI] = f_sn, f_sp
    for mode in (EDGE_P, EDGE_N):
        table[mode, A11], table[mode, P1] = 1.0, h
    table[EDGE_P, F_LO] = f_sp
    table[EDGE_P, F_HI] = p[F_CP] + p[F_VP] * p[DV_P]
    table[EDGE_N, F_LO] = -p[F_CN] + p[F_VN] * p[DV_N]
    table[EDGE_N, F_HI] = f_sn
    table[SLIP_P, C], table[SLIP_P, V_LO] = p[F_CP], p[DV_P]
    table[SLIP_N, C], table[SLIP_N, V_HI] = -p[F_CN], p[DV_N]
    table[BAND_P, C], table[BAND_P, V_HI], table[BAND_P, F_LO] = f_sp, p[DV_P], f_sp
    table[BAND_N, C], table[BAND_N, V_LO], table[BAND_N, F_HI] = f_sn, p[DV_N], f_sn
    for mode in (SLIP_P, SLIP_N, BAND_P, BAND_N):
        slip = mode in (SLIP_P, SLIP_N)
        f = 0.0
        if slip:
            f = p[F_VP] if mode == SLIP_P else p[F_VN]
            table[mode, L1], table[mode, L2] = 1.0 - h * f / m, h / m
        _free_response(m, f, k2, h, table[mode])
        if np.sqrt(k2 / m) * h > QUARTER:  # an excursion could hide: always resolve
            table[mode, V_LO], table[mode, V_HI] = np.inf, -np.inf


@compiled_inline
def mode_row(table: Array, mode: int) -> Row:
    """The step of `mode` as local values, which the compiler keeps in registers."""
    return (
        table[mode, A11],
        table[mode, A12],
        table[mode, B1],
        table[mode, P1],
        table[mode, P2],
        table[mode, P3],
        table[mode, C],
        table[mode, V_LO],
        table[mode, V_HI],
        table[mode, F_LO],
        table[mode, F_HI],
        table[mode, L1],
        table[mode, L2],
    )


@compiled_inline
def exact_step(
    row: Row, k2: float, h: float, v: float, force: float, g: float
) -> tuple[float, float, float, bool]:
    """Distance, velocity and force after one sample in the mode `row`, and whether it left it.

    In a sample that begins with negative acceleration and ends with positive, v + h v'(0) bounds
    the dip in between (see QUARTER); in the modes other than sliding the bound is 0.
    """
    phi = force - row[C]
    moved = row[P1] * v + row[P2] * phi + row[P3] * g
    v_next = row[A11] * v + row[A12] * phi + row[B1] * g
    force_next = force + g * h - k2 * moved
    bound = row[L1] * v + row[L2] * phi
    out = (v_next < row[V_LO]) | (v_next > row[V_HI])
    out |= (bound < row[V_LO]) | (bound > row[V_HI])
    out |= (force_next < row[F_LO]) | (force_next > row[F_HI])
    return moved, v_next, force_next, out


def kernel_parameters(nine: Array, k1: float, k2: float) -> Array:
    """Row of kernel parameters (11,) of the nine, k1 and k2; the band is kept open."""
    row = np.concatenate([nine, [k1, k2]])
    row[DV_P] = max(row[DV_P], SMALLEST_BAND)
    row[DV_N] = min(row[DV_N], -SMALLEST_BAND)
    return row
