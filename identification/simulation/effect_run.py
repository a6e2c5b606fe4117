"""Free run of a plant with effects along a log (compiled): `free_run.run_kernel` with effects."""

import numpy as np

from identification.arrays import Array, IntArray
from identification.compiled import call_value, compiled
from identification.simulation.effect_forces import shown_position, start_states
from identification.simulation.effect_step import acting_command, delayed, effect_step
from identification.simulation.effect_table import (
    INITIAL,
    ON_ACTUATOR,
    ON_BRISTLE,
    ON_COMMAND,
    ON_DELAY,
    VALUE,
)
from identification.simulation.karnopp_step import K1, K2, SLIP_N, SLIP_P, STUCK, parameters

CALM = (STUCK, SLIP_P, SLIP_N)  # modes in which a sample may pass without a switch


@compiled
def place_of(codes: IntArray, code: int) -> int:
    """Row of the first effect of this code, -1 where there is none."""
    for i in range(len(codes)):
        if codes[i] == code:
            return i
    return -1


@compiled
def effective_commands(
    codes: IntArray, addresses: IntArray, q: Array, s: Array, z: Array, t: Array, u: Array,
    h: float,
) -> Array:  # fmt: skip
    """Command that reaches the actuator [V], (n,): through dead zones, then delayed.

    z (k,): states of what acts on the command, where they are to begin; they go on.
    """
    late, out = 0.0, np.empty(len(u))
    i = place_of(codes, ON_DELAY)
    if i >= 0:
        x = (0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
        late = call_value(addresses[i, VALUE], x, s[i, 0].ctypes.data, q[i].ctypes.data) / h
    acting = np.empty(len(u))
    for i in range(len(codes)):
        if codes[i] == ON_COMMAND and addresses[i, INITIAL] != 0 and len(u) > 0:
            d = 1.0 if u[0] >= 0.0 else -1.0
            x = (0.0, 0.0, 0.0, 0.0, u[0], d, 0.0, 0.0, 0.0)
            z[i] = call_value(addresses[i, INITIAL], x, s[i, 0].ctypes.data, q[i].ctypes.data)
    for k in range(len(u)):
        acting[k] = acting_command(codes, addresses, q, s[:, k], z, t[k] - t[0], u[k], h)
    for k in range(len(u)):
        out[k] = delayed(acting, k, late)
    return out


@compiled
def shown_run(
    p: Array,
    h: float,
    codes: IntArray,
    addresses: IntArray,
    q: Array,
    s: Array,
    t: Array,
    u: Array,
    at: IntArray,
    out: Array,
) -> None:
    """Position that the transducer shows, into out[3], of a run whose y, v, F are out[:3]."""
    plant = parameters(p, 0)
    z = np.zeros(len(codes))
    window = 0
    for k in range(len(u)):
        now, s_k = t[k] - t[0], s[:, k]
        y, v, F = out[0, k], out[1, k], out[2, k]
        if window < len(at) and k == at[window]:
            start_states(codes, addresses, q, s_k, z, plant, now, y, v, F, u[k], k > 0)
            window += 1
        out[3, k] = shown_position(h, codes, addresses, q, s_k, z, plant, now, y, v, F, u[k])


@compiled
def effect_run_kernel(
    p: Array,
    h: float,
    rough: int,
    count: int,
    codes: IntArray,
    addresses: IntArray,
    q: Array,
    s: Array,
    forced: bool,
    gain: float,
    k_a: float,
    t: Array,
    u: Array,
    force: Array,
    slope: Array,
    y_m: Array,
    at: IntArray,
    at_y: Array,
    at_v: Array,
    at_f: Array,
    out: Array,
    modes: IntArray,
) -> None:
    """One plant p (1, 11) along one log: out (4, n) takes y, v, F and the position shown.

    As `free_run.run_kernel`, with effects codes (k,), addresses (k, 3), q (k, P), signals
    s (k, n, S); k_a: a motor's, whose force is k_a times the command that reaches it, or 0.
    rough, count: sub-steps of a sample without a switch (one of a body that stays at rest), and of
    one with a switch in it.
    """
    plant = parameters(p, 0)
    k1, k2 = plant[K1], plant[K2]
    z, z_0, spare = np.zeros(len(codes)), np.zeros(len(codes)), np.zeros(len(codes))
    if forced:  # a measured force has its losses in it
        codes = np.where(codes == ON_ACTUATOR, -1, codes)
    bristle = place_of(codes, ON_BRISTLE)
    acting = effective_commands(codes, addresses, q, s, z, t, u, h)
    y, v, F, mode, a = at_y[0], at_v[0], at_f[0], STUCK, 0.0
    window = 0
    for k in range(len(u)):
        now, s_k = t[k] - t[0], s[:, k]
        restart = window < len(at) and k == at[window]
        if restart:
            y, v, F, mode, a = at_y[window], at_v[window], at_f[window], STUCK, 0.0
            window += 1
        g = k1 * acting[k]
        if k_a != 0.0:
            F, g = k_a * acting[k], 0.0
        elif forced:
            F = force[k] + k2 * (y_m[k] - y)
            following = k + 1 if k + 1 < len(u) else k
            g = slope[k] + k2 * (y_m[following] - y_m[k]) / h
        if restart:
            start_states(codes, addresses, q, s_k, z, plant, now, y, v, F, u[k], k > 0)
        shown = shown_position(h, codes, addresses, q, s_k, z, plant, now, y, v, F, u[k])
        out[0, k], out[1, k], out[2, k], out[3, k] = y, v, F, shown
        if gain > 0.0 and not restart:
            F += gain * (force[k] - F)
        few = 1 if mode == STUCK and v == 0.0 and bristle < 0 else rough
        z_0[:] = z
        state = effect_step(
            plant, few, codes, addresses, q, s_k, z, spare, bristle, now, (y, v, F, mode, a), u[k],
            g, h,
        )  # fmt: skip
        if few < count and (state[3] != mode or mode not in CALM):
            z[:] = z_0
            state = effect_step(
                plant, count, codes, addresses, q, s_k, z, spare, bristle, now, (y, v, F, mode, a),
                u[k], g, h,
            )  # fmt: skip
        modes[k] = mode if v == 0.0 or mode != STUCK else state[3]
        y, v, F, mode, a = state
