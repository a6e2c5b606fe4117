"""Many plants at once: structure of arrays, one exact step a sample, switches one by one.

A block holds WIDTH plants in one flat work array, entry `row * WIDTH + lane`, so that the inner
loops have a constant length and vectorise. Every lane takes the affine step of its mode; lanes
that left the region of their mode are then resolved from event to event (`karnopp_step.resolve`).
"""

import numpy as np

from identification.arrays import Array, IntArray
from identification.compiled import compiled, compiled_inline
from identification.simulation.karnopp_step import (
    A11,
    A12,
    B1,
    COLUMNS,
    F_HI,
    F_LO,
    K1,
    K2,
    L1,
    L2,
    MODES,
    P1,
    P2,
    P3,
    STUCK,
    V_HI,
    V_LO,
    C,
    Row,
    exact_step,
    mode_at,
    mode_table,
    parameters,
    resolve,
)

WIDTH = 16
# Rows of the work array: the mode's columns first, then state, input, k1, k2 and the last velocity,
# position and force, of which the latter two are kept by who does not put them out.
Y, V, F, G, GAIN, COUPLING, V_OLD, BEFORE_Y, BEFORE_F = range(COLUMNS, COLUMNS + 9)
WORK_ROWS = COLUMNS + 9


@compiled_inline
def lane_row(s: Array, i: int) -> Row:
    """The step of a lane's mode."""
    return (
        s[A11 * WIDTH + i],
        s[A12 * WIDTH + i],
        s[B1 * WIDTH + i],
        s[P1 * WIDTH + i],
        s[P2 * WIDTH + i],
        s[P3 * WIDTH + i],
        s[C * WIDTH + i],
        s[V_LO * WIDTH + i],
        s[V_HI * WIDTH + i],
        s[F_LO * WIDTH + i],
        s[F_HI * WIDTH + i],
        s[L1 * WIDTH + i],
        s[L2 * WIDTH + i],
    )


@compiled_inline
def advance(s: Array, i: int, h: float, force: float, g: float) -> int:
    """Affine step of lane `i`; its bit where it left its region and must be resolved.

    The old velocity is kept in V_OLD. The new state is stored in any case: a masked store would
    stall the next step's loads.
    """
    v = s[V * WIDTH + i]
    moved, v_next, force_next, left = exact_step(
        lane_row(s, i), s[COUPLING * WIDTH + i], h, v, force, g
    )
    s[G * WIDTH + i] = g
    s[V_OLD * WIDTH + i] = v
    s[Y * WIDTH + i] += moved
    s[V * WIDTH + i] = v_next
    s[F * WIDTH + i] = force_next
    return int(left) << i


@compiled
def load_mode(s: Array, tables: Array, lane: int, mode: int) -> None:
    """Put the step of `mode` into a lane."""
    for column in range(COLUMNS):
        s[column * WIDTH + lane] = tables[lane, mode, column]


@compiled
def place(
    s: Array, modes: IntArray, tables: Array, p: Array, lane: int, y: float, v: float, force: float
) -> None:
    """Set a lane's state; a body inside the band with too little force is at rest."""
    mode = mode_at(parameters(p, lane), v, force)
    s[Y * WIDTH + lane] = y
    s[V * WIDTH + lane] = 0.0 if mode == STUCK else v
    s[F * WIDTH + lane] = force
    modes[lane] = mode
    load_mode(s, tables, lane, mode)


@compiled
def prepare_lanes(p: Array, h: float, tables: Array, s: Array) -> None:
    """Step tables of all lanes, their k1 and k2."""
    for lane in range(WIDTH):
        mode_table(parameters(p, lane), h, tables[lane])
        s[GAIN * WIDTH + lane] = p[lane, K1]
        s[COUPLING * WIDTH + lane] = p[lane, K2]


@compiled
def resolve_flagged(
    flagged: int,
    s: Array,
    modes: IntArray,
    tables: Array,
    p: Array,
    h: float,
    out: Array,
    at: int,
) -> None:
    """Follow the flagged lanes from switch to switch through the sample.

    Their positions and forces before it are out[at:at + 2 * WIDTH]. A force that was set from
    outside, beyond the region of the mode, changes the mode first.
    """
    for lane in range(WIDTH):
        if flagged >> lane & 1:
            v, force = s[V_OLD * WIDTH + lane], out[at + WIDTH + lane]
            mode, plant = modes[lane], parameters(p, lane)
            if force < s[F_LO * WIDTH + lane] or force > s[F_HI * WIDTH + lane]:
                mode = mode_at(plant, v, force)
                v = 0.0 if mode == STUCK else v
            y, v, force, mode = resolve(
                plant, out[at + lane], v, force, mode, s[G * WIDTH + lane], h
            )
            s[Y * WIDTH + lane] = y
            s[V * WIDTH + lane] = v
            s[F * WIDTH + lane] = force
            if mode != modes[lane]:
                modes[lane] = mode
                load_mode(s, tables, lane, mode)


@compiled
def march(
    p: Array,
    tables: Array,
    s: Array,
    modes: IntArray,
    u: Array,
    h: float,
    out: Array,
) -> None:
    """Steps driven by a command: out[k, 0] positions, out[k, 1] forces before step k, per lane."""
    flat = out.reshape(-1)
    for k in range(len(u)):
        command, at, flagged = u[k], 2 * WIDTH * k, 0
        for i in range(WIDTH):
            force = s[F * WIDTH + i]
            flat[at + i] = s[Y * WIDTH + i]
            flat[at + WIDTH + i] = force
            flagged |= advance(s, i, h, force, s[GAIN * WIDTH + i] * command)
        if flagged:
            resolve_flagged(flagged, s, modes, tables, p, h, flat, at)


@compiled
def march_corrected(
    p: Array,
    tables: Array,
    s: Array,
    modes: IntArray,
    u: Array,
    force: Array,
    gain: float,
    h: float,
    out: Array,
) -> None:
    """As `march`, the run's force corrected by `gain` of its distance to the measured one at every
    sample; in `out` as it was before. Source: steady gain of a local level, Harvey (1989)."""
    flat = out.reshape(-1)
    for k in range(len(u)):
        command, measured, at, flagged = u[k], force[k], 2 * WIDTH * k, 0
        for i in range(WIDTH):
            here, before = s[Y * WIDTH + i], s[F * WIDTH + i]
            f = before + gain * (measured - before)
            flat[at + i] = here
            flat[at + WIDTH + i] = before
            s[BEFORE_Y * WIDTH + i] = here
            s[BEFORE_F * WIDTH + i] = f
            outside = (f < s[F_LO * WIDTH + i]) | (f > s[F_HI * WIDTH + i])
            flagged |= int(outside) << i
            flagged |= advance(s, i, h, f, s[GAIN * WIDTH + i] * command)
        if flagged:
            resolve_flagged(flagged, s, modes, tables, p, h, s, BEFORE_Y * WIDTH)


@compiled
def march_forced(
    p: Array,
    tables: Array,
    s: Array,
    modes: IntArray,
    y: Array,
    force: Array,
    slope_y: Array,
    slope_force: Array,
    h: float,
    out: Array,
) -> None:
    """Steps driven by a measured force: F + k2 (y_m - y) at every sample; `out` as in `march`."""
    flat = out.reshape(-1)
    for k in range(len(y)):
        y_k, force_k, slope_y_k, slope_k = y[k], force[k], slope_y[k], slope_force[k]
        at, flagged = 2 * WIDTH * k, 0
        for i in range(WIDTH):
            here, coupling = s[Y * WIDTH + i], s[COUPLING * WIDTH + i]
            f = force_k + coupling * (y_k - here)
            flat[at + i] = here
            flat[at + WIDTH + i] = f
            outside = (f < s[F_LO * WIDTH + i]) | (f > s[F_HI * WIDTH + i])
            flagged |= int(outside) << i
            flagged |= advance(s, i, h, f, slope_k + coupling * slope_y_k)
        if flagged:
            resolve_flagged(flagged, s, modes, tables, p, h, flat, at)


@compiled
def work_space() -> tuple[Array, IntArray, Array]:
    """Fresh work arrays of a block: state, modes, step tables."""
    return (
        np.zeros(WORK_ROWS * WIDTH),
        np.zeros(WIDTH, dtype=np.int64),
        np.zeros((WIDTH, MODES, COLUMNS)),
    )
