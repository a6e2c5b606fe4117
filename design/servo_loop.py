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
    mode_at,
    mode_row,
    mode_table,
    parameters,
    resolve,
)

SERVO_ROWS = 9
# A load behind a spring: its mass [kg] (0: none), stiffness [N/m], damping [N s/m], sub-steps.
LOAD_MASS, LOAD_STIFFNESS, LOAD_DAMPING, LOAD_STEPS = range(4)


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
    load: Array,
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
    was before the start; late: delay in samples; the rest as in `servo_step`. load (4,): a second
    mass that the body, of its own mass alone, takes along by a spring (leapfrog steps).
    """
    plant = parameters(p, 0)
    y, v, F = start
    steps = int(load[LOAD_STEPS]) if load[LOAD_MASS] > 0.0 else 1
    dt = h / steps
    z, spare = np.zeros(len(codes)), np.zeros(len(codes))
    past = len(history) - len(modes)
    bristle = place_of(codes, ON_BRISTLE)
    motor = law.k_a != 0.0
    mode = STUCK if motor and v == 0.0 else mode_at(plant, v, F)
    a, u = 0.0, 0.0
    y_load, v_load = start[0], start[1]
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
        state = (y, v, F, mode, a)
        for j in range(steps):
            pull = 0.0
            if load[LOAD_MASS] > 0.0:
                apart = state[0] - y_load + 0.5 * dt * (state[1] - v_load)
                pull = load[LOAD_STIFFNESS] * apart + load[LOAD_DAMPING] * (state[1] - v_load)
                gained = dt * pull / load[LOAD_MASS]
                y_load += dt * (v_load + 0.5 * gained)
                v_load += gained
            pulled = (state[0], state[1], state[2] - pull, state[3], state[4])
            moved = effect_step(
                plant, count, codes, addresses, q, s, z, spare, bristle, now + j * dt, pulled, u, g,
                dt,
            )  # fmt: skip
            state = (moved[0], moved[1], moved[2] + pull, moved[3], moved[4])
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
    mode = STUCK if motor and v == 0.0 else mode_at(plant, v, F)
    v = 0.0 if mode == STUCK else v
    row = mode_row(table, mode)
    for k in range(len(modes)):
        measured, felt = y + noise_y[k], F + noise_f[k]
        u = servo_step(law, memory, reference[k], measured, felt, shake[k])
        g = k1 * u
        if motor:
            F, g = g, 0.0
            if row[F_LO] > F or row[F_HI] < F:
                mode = mode_at(plant, v, F)
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
