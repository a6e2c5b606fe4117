"""One plant in its servo, sample by sample (compiled)."""

import numpy as np

from design.servo_kernels import ADDED, RAW, SPEED, WANTED, Law, Memory, servo_step
from identification.arrays import Array, IntArray
from identification.compiled import compiled
from identification.simulation.effect_forces import shown_position, start_states
from identification.simulation.effect_run import place_of
from identification.simulation.effect_step import acting_command, delayed, effect_step
from identification.simulation.effect_table import ON_BRISTLE
from identification.simulation.karnopp_step import (
    COLUMNS,
    F_HI,
    F_LO,
    K1,
    K2,
    MODES,
    STUCK,
    exact_step,
    mode_row,
    mode_table,
    parameters,
    resolve,
    settled_mode,
)

SERVO_ROWS = 9


@compiled
def servo_kernel(
    p: Array,
    h: float,
    count: int,
    codes: IntArray,
    addresses: IntArray,
    q: Array,
    base: Array,
    gain: Array,
    history: Array,
    late: float,
    law: Law,
    memory: Memory,
    reference: Array,
    shake: Array,
    noise_y: Array,
    noise_f: Array,
    start: tuple[float, float, float],
    out: Array,
    modes: IntArray,
) -> None:
    """One plant p (1, 11) with effects in its servo; out (9, n), modes (n,).

    Rows of out: y, v, F, u, position measured, then the position controller's force reference,
    F_comp, F_compf and its velocity. codes (k,), addresses (k, 3), q (k, P): the effects; signals
    base (k, n, S) + gain (k, S) F; history: the command after the dead zone, preceded by what it
    was before the start; late: delay in samples; the rest as in `servo_step`.
    """
    plant = parameters(p, 0)
    y, v, F = start
    z, spare = np.zeros(len(codes)), np.zeros(len(codes))
    past = len(history) - len(modes)
    bristle = place_of(codes, ON_BRISTLE)
    motor = law.k_a != 0.0
    mode = STUCK if motor and v == 0.0 else settled_mode(plant, v, F)
    a, u = 0.0, 0.0
    for k in range(len(modes)):
        now, s = k * h, base[:, k] + gain * F
        if k == 0:
            start_states(codes, addresses, q, s, z, plant, now, y, v, F, u, False)
        shown = shown_position(h, codes, addresses, q, s, z, plant, now, y, v, F, u)
        measured, felt = shown + noise_y[k], F + noise_f[k]
        u = servo_step(law, memory, reference[k], measured, felt, shake[k])
        history[past + k] = acting_command(codes, addresses, q, s, z, now, u, h)
        g = plant[K1] * delayed(history, past + k, late)
        if motor:
            F, g = g, 0.0
            s = base[:, k] + gain * F
        out[0, k], out[1, k], out[2, k], out[3, k], out[4, k] = y, v, F, u, measured
        out[5, k], out[6, k] = memory.last[WANTED], memory.last[RAW]
        out[7, k], out[8, k] = memory.last[ADDED], memory.last[SPEED]
        state = effect_step(
            plant, count, codes, addresses, q, s, z, spare, bristle, now, (y, v, F, mode, a), u, g,
            h,
        )  # fmt: skip
        # A body at rest that the new force moves has left at once.
        modes[k] = mode if v == 0.0 or mode != STUCK else state[3]
        y, v, F, mode, a = state


@compiled
def plain_servo_kernel(
    p: Array,
    h: float,
    law: Law,
    memory: Memory,
    reference: Array,
    shake: Array,
    noise_y: Array,
    noise_f: Array,
    start: tuple[float, float, float],
    out: Array,
    modes: IntArray,
) -> None:
    """`servo_kernel` of a plant without effects, whose steps of h [s] are known beforehand."""
    table = np.zeros((MODES, COLUMNS))
    plant = parameters(p, 0)
    mode_table(plant, h, table)
    k1, k2 = plant[K1], plant[K2]
    motor = law.k_a != 0.0
    y, v, F = start
    mode = STUCK if motor and v == 0.0 else settled_mode(plant, v, F)
    v = 0.0 if mode == STUCK else v
    row = mode_row(table, mode)
    for k in range(len(modes)):
        measured, felt = y + noise_y[k], F + noise_f[k]
        u = servo_step(law, memory, reference[k], measured, felt, shake[k])
        g = k1 * u
        if motor:
            F, g = g, 0.0
            if row[F_LO] > F or row[F_HI] < F:
                mode = settled_mode(plant, v, F)
                v = 0.0 if mode == STUCK else v
                row = mode_row(table, mode)
        out[0, k], out[1, k], out[2, k], out[3, k], out[4, k] = y, v, F, u, measured
        out[5, k], out[6, k] = memory.last[WANTED], memory.last[RAW]
        out[7, k], out[8, k] = memory.last[ADDED], memory.last[SPEED]
        modes[k] = mode
        slope = 0.0 if motor else k2
        moved, v_next, F_next, left = exact_step(row, slope, h, v, F, g)
        if left:
            y, v, F_next, mode = resolve(plant, y, v, F, mode, g, h)
            row = mode_row(table, mode)
        else:
            y, v = y + moved, v_next
        F = F if motor else F_next
