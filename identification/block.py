"""Many plants at once: structure of arrays, one exact step a sample, switches one by one.

A block holds WIDTH plants in one flat work array, entry `row * WIDTH + lane`, so that the inner
loops have a constant length and vectorise. Every lane takes the affine step of its mode; lanes
that left the region of their mode are then resolved from event to event (`stepping.resolve`).
"""

import numpy as np

from identification.arrays import Array, IntArray
from identification.compiled import compiled, compiled_inline
from identification.stepping import (
    A11,
    A12,
    B1,
    COLUMNS,
    D_F,
    D_V,
    F_HI,
    F_LO,
    K1,
    K2,
    MODES,
    ORDER,
    P1,
    P2,
    P3,
    V_HI,
    V_LO,
    C,
    mode_table,
    resolve,
    settled_mode,
)

WIDTH = 16
# Rows of the work array: the mode's columns first, then state, inputs and the proposed step.
Y, V, F, G, Y_NEXT, V_NEXT, F_NEXT, COUPLING = range(COLUMNS, COLUMNS + 8)
ROWS = COLUMNS + 8


@compiled_inline
def propose(s: Array, flags: IntArray, h: float) -> int:
    """Affine step of all lanes into the NEXT rows; flags lanes that left their region."""
    flagged = 0
    for i in range(WIDTH):
        v, force, g = s[V * WIDTH + i], s[F * WIDTH + i], s[G * WIDTH + i]
        c, d_f, d_v = s[C * WIDTH + i], s[D_F * WIDTH + i], s[D_V * WIDTH + i]
        phi = force - c
        moved = s[P1 * WIDTH + i] * v + s[P2 * WIDTH + i] * phi + s[P3 * WIDTH + i] * g
        v_next = s[A11 * WIDTH + i] * v + s[A12 * WIDTH + i] * phi + s[B1 * WIDTH + i] * g
        force_next = force + g * h - s[COUPLING * WIDTH + i] * moved
        s[Y_NEXT * WIDTH + i] = s[Y * WIDTH + i] + moved
        s[V_NEXT * WIDTH + i] = v_next
        s[F_NEXT * WIDTH + i] = force_next
        out = (v_next < s[V_LO * WIDTH + i]) | (v_next > s[V_HI * WIDTH + i])
        out |= (force_next < s[F_LO * WIDTH + i]) | (force_next > s[F_HI * WIDTH + i])
        dip = (d_f * phi - d_v * v < 0.0) & (d_f * (force_next - c) - d_v * v_next > 0.0)
        flags[i] = out | dip
        flagged += flags[i]
    return flagged


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
    mode = settled_mode(p[lane], v, force)
    s[Y * WIDTH + lane] = y
    s[V * WIDTH + lane] = 0.0 if mode == 0 else v
    s[F * WIDTH + lane] = force
    modes[lane] = mode
    load_mode(s, tables, lane, mode)


@compiled
def prepare(p: Array, h: float, tables: Array, s: Array, c: Array) -> None:
    """Step tables of all lanes and their coupling k2."""
    for lane in range(WIDTH):
        mode_table(p[lane], h, c, tables[lane])
        s[COUPLING * WIDTH + lane] = p[lane, K2]


@compiled
def settle_flagged(
    s: Array, flags: IntArray, modes: IntArray, tables: Array, p: Array, h: float, c: Array
) -> None:
    """Follow the flagged lanes from switch to switch through the sample."""
    for lane in range(WIDTH):
        if flags[lane]:
            y, v, force, mode = resolve(
                p[lane],
                s[Y * WIDTH + lane],
                s[V * WIDTH + lane],
                s[F * WIDTH + lane],
                modes[lane],
                s[G * WIDTH + lane],
                h,
                c,
            )
            s[Y_NEXT * WIDTH + lane] = y
            s[V_NEXT * WIDTH + lane] = v
            s[F_NEXT * WIDTH + lane] = force
            if mode != modes[lane]:
                modes[lane] = mode
                load_mode(s, tables, lane, mode)


@compiled
def accept(s: Array) -> None:
    """Make the proposed step the state."""
    for i in range(3 * WIDTH):
        s[Y * WIDTH + i] = s[Y_NEXT * WIDTH + i]


@compiled
def march(
    p: Array,
    tables: Array,
    s: Array,
    modes: IntArray,
    flags: IntArray,
    u: Array,
    h: float,
    c: Array,
    out: Array,
) -> None:
    """Steps driven by a command: out[k, 0] positions, out[k, 1] forces before step k, per lane."""
    for k in range(len(u)):
        for i in range(WIDTH):
            out[k, 0, i] = s[Y * WIDTH + i]
            out[k, 1, i] = s[F * WIDTH + i]
            s[G * WIDTH + i] = p[i, K1] * u[k]
        if propose(s, flags, h) > 0:
            settle_flagged(s, flags, modes, tables, p, h, c)
        accept(s)


@compiled
def resettle(s: Array, modes: IntArray, tables: Array, p: Array) -> None:
    """Modes of lanes whose force was set from outside and left the region of the mode."""
    for lane in range(WIDTH):
        force = s[F * WIDTH + lane]
        if force < s[F_LO * WIDTH + lane] or force > s[F_HI * WIDTH + lane]:
            place(s, modes, tables, p, lane, s[Y * WIDTH + lane], s[V * WIDTH + lane], force)


@compiled
def march_held(
    p: Array,
    tables: Array,
    s: Array,
    modes: IntArray,
    flags: IntArray,
    y: Array,
    force: Array,
    slope_y: Array,
    slope_force: Array,
    h: float,
    c: Array,
    out: Array,
) -> None:
    """Steps driven by a measured force: F + k2 (y_m - y) at every sample; `out` as in `march`."""
    for k in range(len(y)):
        outside = 0
        for i in range(WIDTH):
            coupling = s[COUPLING * WIDTH + i]
            f = force[k] + coupling * (y[k] - s[Y * WIDTH + i])
            s[F * WIDTH + i] = f
            s[G * WIDTH + i] = slope_force[k] + coupling * slope_y[k]
            out[k, 0, i] = s[Y * WIDTH + i]
            out[k, 1, i] = f
            outside += (f < s[F_LO * WIDTH + i]) | (f > s[F_HI * WIDTH + i])
        if outside > 0:
            resettle(s, modes, tables, p)
        if propose(s, flags, h) > 0:
            settle_flagged(s, flags, modes, tables, p, h, c)
        accept(s)


@compiled
def work_space() -> tuple[Array, IntArray, IntArray, Array, Array]:
    """Fresh work arrays of a block: state, modes, flags, tables, series."""
    return (
        np.zeros(ROWS * WIDTH),
        np.zeros(WIDTH, dtype=np.int64),
        np.zeros(WIDTH, dtype=np.int64),
        np.zeros((WIDTH, MODES, COLUMNS)),
        np.zeros(ORDER + 1),
    )
