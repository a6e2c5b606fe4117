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

STUCK, SLIP_P, SLIP_N, BAND_P, BAND_N, EDGE_P, EDGE_N = range(7)
MODES = 7
# Plant parameters as rows of the kernels: the nine in the order of karnopp.NAMES, then k1, k2.
M, F_CP, F_CN, F_VP, F_VN, DV_P, DV_N, F_SP, F_SN, K1, K2 = range(11)
PARAMETERS = 11
# Columns of a mode's row: v+ = a11 v + a12 (F-c) + b1 g, dy = p1 v + p2 (F-c) + p3 g, then the
# region in which the step holds and the signed acceleration whose change of sign hides a dip.
A11, A12, B1, P1, P2, P3, C, V_LO, V_HI, F_LO, F_HI, D_F, D_V = range(13)
COLUMNS = 13
ORDER = 14  # terms of the power series; with RATE_STEP the remainder is below 1e-12
RATE_STEP = 0.7  # longest stretch of one series, in units of the fastest rate
SMALLEST_BAND = 1e-9  # m/s; a band of zero width would leave rest undefined
RECIPROCALS = tuple(1.0 / (k + 1) for k in range(ORDER + 1))
MAX_EVENTS = 200  # switches within one sample


@compiled
def terms(x: float) -> int:
    """Terms after which the series of exp(x), x <= RATE_STEP, is exact to about 1e-14."""
    if x < 0.02:
        return 6
    if x < 0.1:
        return 8
    return 11 if x < 0.35 else ORDER


@compiled
def series(v: float, phi: float, g: float, m: float, f: float, k2: float, n: int, c: Array) -> None:
    """Power series in time of velocity, c[0:n+1], of m v' = phi - f v, phi' = g - k2 v."""
    per_mass = 1.0 / m
    c[0] = v
    drive = g
    for k in range(n):
        over = RECIPROCALS[k]
        c[k + 1] = (phi - f * c[k]) * per_mass * over
        phi = (drive - k2 * c[k]) * over
        drive = 0.0


@compiled
def speed(c: Array, n: int, tau: float) -> float:
    """Velocity [m/s] of the series `c` at time `tau` [s]."""
    value = c[n]
    for k in range(n - 1, -1, -1):
        value = value * tau + c[k]
    return value


@compiled
def travel(c: Array, n: int, tau: float) -> float:
    """Distance [m] covered by the series `c` until `tau` [s]."""
    value = c[n] * RECIPROCALS[n]
    for k in range(n - 1, -1, -1):
        value = value * tau + c[k] * RECIPROCALS[k]
    return value * tau


@compiled
def acceleration(c: Array, n: int, tau: float) -> float:
    """Acceleration [m/s^2] of the series `c` at time `tau` [s]."""
    value = n * c[n]
    for k in range(n - 1, 0, -1):
        value = value * tau + k * c[k]
    return value


@compiled
def speed_root(c: Array, n: int, level: float, low: float, high: float) -> float:
    """Time in [low, high] at which the series passes `level`; one crossing is assumed."""
    f_low = speed(c, n, low) - level
    rising = f_low < 0.0
    tau = 0.5 * (low + high)
    for _ in range(60):
        value = speed(c, n, tau) - level
        if (value < 0.0) == rising:
            low = tau
        else:
            high = tau
        slope = acceleration(c, n, tau)
        change = value / slope if slope != 0.0 else high
        if abs(change) <= 1e-15 + 1e-12 * high:
            return tau - change
        tau -= change
        if not low < tau < high:
            tau = 0.5 * (low + high)
    return tau


@compiled
def turning_point(c: Array, n: int, low: float, high: float) -> float:
    """Time in [low, high] at which the acceleration changes sign."""
    rising = acceleration(c, n, low) < 0.0
    for _ in range(50):
        tau = 0.5 * (low + high)
        if (acceleration(c, n, tau) < 0.0) == rising:
            low = tau
        else:
            high = tau
    return 0.5 * (low + high)


@compiled
def force_root(
    c: Array, n: int, force: float, g: float, k2: float, level: float, high: float
) -> float:
    """Last time in (0, high] at which force + g t - k2 dy(t) falls through `level`.

    In the band the force is concave in time, so Newton from the right end stays on the right.
    """
    tau = high
    for _ in range(60):
        value = force + g * tau - k2 * travel(c, n, tau) - level
        slope = g - k2 * speed(c, n, tau)
        if slope >= 0.0:
            return tau
        step = value / slope
        tau -= step
        if tau <= 0.0:
            return 0.0
        if abs(step) <= 1e-15 + 1e-12 * tau:
            return tau
    return tau


@compiled
def settled_mode(p: Array, v: float, force: float) -> int:
    """Mode of a body at velocity `v` under `force`: eq. (1), with the edge of the band."""
    slip_p = p[F_CP] + p[F_VP] * p[DV_P]
    slip_n = -p[F_CN] + p[F_VN] * p[DV_N]
    mode = STUCK
    if v > p[DV_P] or (v == p[DV_P] and force >= slip_p and force > p[F_SP]):
        mode = SLIP_P
    elif v < p[DV_N] or (v == p[DV_N] and force <= slip_n and force < p[F_SN]):
        mode = SLIP_N
    elif force > p[F_SP]:
        mode = EDGE_P if v == p[DV_P] else BAND_P
    elif force < p[F_SN]:
        mode = EDGE_N if v == p[DV_N] else BAND_N
    return mode


@compiled
def _first_exit(
    mode: int, p: Array, v: float, force: float, g: float, left: float, c: Array
) -> tuple[float, int, int]:
    """Time until the mode ends and 1 (2: force limit), or time looked ahead and 0; series terms.

    Positive and negative direction are one case: mirrored by `side`.
    """
    side = 1.0 if mode in (SLIP_P, BAND_P) else -1.0
    slip = mode in (SLIP_P, SLIP_N)
    k2 = p[K2]
    if side > 0:
        coulomb, viscous, edge, stick = p[F_CP], p[F_VP], p[DV_P], p[F_SP]
    else:
        coulomb, viscous, edge, stick = p[F_CN], p[F_VN], -p[DV_N], -p[F_SN]
    f = viscous if slip else 0.0
    rate = max(f / p[M], np.sqrt(k2 / p[M]))
    span = min(left, RATE_STEP / rate) if rate > 0.0 else left
    phi = side * force - (coulomb if slip else stick)
    n = terms(rate * span)
    series(side * v, phi, side * g, p[M], f, k2, n, c)
    if slip:
        start, end = acceleration(c, n, 0.0), acceleration(c, n, span)
        low = 0.0
        if start > 0.0 and end < 0.0:
            low = turning_point(c, n, 0.0, span)
        elif start < 0.0 and end > 0.0:
            dip = turning_point(c, n, 0.0, span)
            if speed(c, n, dip) < edge:
                return speed_root(c, n, edge, 0.0, dip), 1, n
            return span, 0, n
        if speed(c, n, span) < edge:
            if c[0] <= edge and start <= 0.0:
                return 0.0, 1, n
            return speed_root(c, n, edge, low, span), 1, n
        return span, 0, n
    tau, found = span, 0
    if speed(c, n, span) > edge:
        tau, found = speed_root(c, n, edge, 0.0, span), 1
    if side * force + side * g * tau - k2 * travel(c, n, tau) < stick:
        tau, found = force_root(c, n, side * force, side * g, k2, stick, tau), 2
    return tau, found, n


@compiled
def _after_exit(mode: int, p: Array, force: float, found: int) -> tuple[float, int]:
    """Velocity and mode after a sliding or band mode has ended at the edge or at the limit."""
    if found == 2:
        return 0.0, STUCK
    if mode in (SLIP_P, BAND_P):
        edge, slip = p[DV_P], p[F_CP] + p[F_VP] * p[DV_P]
        if force > p[F_SP]:
            return edge, (SLIP_P if mode == BAND_P and force >= slip else EDGE_P)
        return (0.0, STUCK) if force >= p[F_SN] else (edge, BAND_N)
    edge, slip = p[DV_N], -p[F_CN] + p[F_VN] * p[DV_N]
    if force < p[F_SN]:
        return edge, (SLIP_N if mode == BAND_N and force <= slip else EDGE_N)
    return (0.0, STUCK) if force <= p[F_SP] else (edge, BAND_P)


@compiled
def _held_exit(mode: int, p: Array, force: float, slope: float, left: float) -> tuple[float, int]:
    """Time and next mode of a body at constant velocity (stuck, or along an edge)."""
    if mode == STUCK:
        low, high, below, above = p[F_SN], p[F_SP], BAND_N, BAND_P
    elif mode == EDGE_P:
        low, high, below, above = p[F_SP], p[F_CP] + p[F_VP] * p[DV_P], STUCK, SLIP_P
    else:
        low, high, below, above = -p[F_CN] + p[F_VN] * p[DV_N], p[F_SN], SLIP_N, STUCK
    tau, following = left, mode
    if force + slope * left > high:
        tau, following = max(0.0, (high - force) / slope), above
    elif force + slope * left < low:
        tau, following = max(0.0, (low - force) / slope), below
    return tau, following


@compiled
def resolve(
    p: Array, y: float, v: float, force: float, mode: int, g: float, h: float, c: Array
) -> tuple[float, float, float, int]:
    """Position, velocity, force and mode after `h` [s], every switch on the way located.

    p: parameters (11,); g: k1 u, or the slope of the force [N/s]; c: work space (ORDER + 1,).
    """
    left, k2 = h, p[K2]
    for _ in range(MAX_EVENTS):
        if left <= 0.0:
            break
        if mode in (STUCK, EDGE_P, EDGE_N):
            slope = g - k2 * v
            tau, following = _held_exit(mode, p, force, slope, left)
            y += v * tau
            force += slope * tau
            left -= tau
            if following == STUCK:
                v = 0.0
            mode = following
            continue
        tau, found, n = _first_exit(mode, p, v, force, g, left, c)
        side = 1.0 if mode in (SLIP_P, BAND_P) else -1.0
        moved = side * travel(c, n, tau)
        y += moved
        force += g * tau - k2 * moved
        v = side * speed(c, n, tau)
        left -= tau
        if found > 0:
            v, mode = _after_exit(mode, p, force, found)
    return y, v, force, mode


@compiled
def _free_response(m: float, f: float, k2: float, h: float, c: Array, row: Array) -> None:
    """Exact affine step over `h` of v and dy, from three basis responses, into `row`."""
    rate = max(f / m, np.sqrt(k2 / m))
    pieces = int(np.ceil(rate * h / RATE_STEP)) if rate > 0.0 else 1
    piece = h / max(1, pieces)
    for basis in range(3):
        v, phi, g, y = 0.0, 0.0, 0.0, 0.0
        if basis == 0:
            v = 1.0
        elif basis == 1:
            phi = 1.0
        else:
            g = 1.0
        for _ in range(max(1, pieces)):
            series(v, phi, g, m, f, k2, ORDER, c)
            moved = travel(c, ORDER, piece)
            y += moved
            phi += g * piece - k2 * moved
            v = speed(c, ORDER, piece)
        row[A11 + basis] = v
        row[P1 + basis] = y


@compiled
def mode_table(p: Array, h: float, c: Array, table: Array) -> None:
    """Fill `table` (MODES, COLUMNS) with the exact step of every mode over `h` [s]."""
    table[:, :] = 0.0
    table[:, V_LO] = -np.inf
    table[:, V_HI] = np.inf
    table[:, F_LO] = -np.inf
    table[:, F_HI] = np.inf
    slip_p = p[F_CP] + p[F_VP] * p[DV_P]
    slip_n = -p[F_CN] + p[F_VN] * p[DV_N]
    table[STUCK, F_LO], table[STUCK, F_HI] = p[F_SN], p[F_SP]
    for mode in (EDGE_P, EDGE_N):
        table[mode, A11], table[mode, P1] = 1.0, h
    table[EDGE_P, F_LO], table[EDGE_P, F_HI] = p[F_SP], slip_p
    table[EDGE_N, F_LO], table[EDGE_N, F_HI] = slip_n, p[F_SN]
    for mode in (SLIP_P, SLIP_N, BAND_P, BAND_N):
        f = 0.0
        if mode == SLIP_P:
            f, table[mode, C] = p[F_VP], p[F_CP]
            table[mode, V_LO], table[mode, D_F], table[mode, D_V] = p[DV_P], 1.0, f
        elif mode == SLIP_N:
            f, table[mode, C] = p[F_VN], -p[F_CN]
            table[mode, V_HI], table[mode, D_F], table[mode, D_V] = p[DV_N], -1.0, -f
        elif mode == BAND_P:
            table[mode, C], table[mode, V_HI], table[mode, F_LO] = p[F_SP], p[DV_P], p[F_SP]
        else:
            table[mode, C], table[mode, V_LO], table[mode, F_HI] = p[F_SN], p[DV_N], p[F_SN]
        _free_response(p[M], f, p[K2], h, c, table[mode])
        # With more than a third of an oscillation in a sample a dip could hide: always resolve.
        if np.sqrt(p[K2] / p[M]) * h > 2.0 and mode in (SLIP_P, SLIP_N):
            table[mode, V_LO], table[mode, V_HI] = np.inf, -np.inf


@compiled_inline
def holds(row: Array, v: float, force: float, v_next: float, force_next: float) -> bool:
    """Whether a step of the mode `row` stayed in its region, no dip within the sample."""
    inside = v_next >= row[V_LO] and v_next <= row[V_HI]
    inside = inside and force_next >= row[F_LO] and force_next <= row[F_HI]
    before = row[D_F] * (force - row[C]) - row[D_V] * v
    after = row[D_F] * (force_next - row[C]) - row[D_V] * v_next
    return inside and not (before < 0.0 and after > 0.0)


@compiled
def step(
    p: Array,
    table: Array,
    y: float,
    v: float,
    force: float,
    mode: int,
    g: float,
    h: float,
    c: Array,
) -> tuple[float, float, float, int]:
    """One sample: the exact step where the mode holds, else from event to event."""
    row = table[mode]
    phi = force - row[C]
    moved = row[P1] * v + row[P2] * phi + row[P3] * g
    v_next = row[A11] * v + row[A12] * phi + row[B1] * g
    force_next = force + g * h - p[K2] * moved
    if holds(row, v, force, v_next, force_next):
        return y + moved, v_next, force_next, mode
    return resolve(p, y, v, force, mode, g, h, c)


def kernel_parameters(nine: Array, k1: float, k2: float) -> Array:
    """Row of kernel parameters (11,) of the nine, k1 and k2; the band is kept open."""
    row = np.concatenate([nine, [k1, k2]])
    row[DV_P] = max(row[DV_P], SMALLEST_BAND)
    row[DV_N] = min(row[DV_N], -SMALLEST_BAND)
    return row
