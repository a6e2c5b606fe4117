"""Free run of a plant along a log: positions and forces that the model would have shown."""

from dataclasses import dataclass

import numpy as np

from identification.arrays import Array, IntArray
from identification.compiled import compiled
from identification.errors import BadModel
from identification.log import Log
from identification.plant import Actuator, Motor, Plant
from identification.result import Drive
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
    STUCK,
    V_HI,
    V_LO,
    C,
    kernel_parameters,
    mode_table,
    resolve,
    settled_mode,
)


@dataclass(frozen=True)
class FreeRun:
    """Simulated position y [m], velocity v [m/s], force F [N] and mode at every sample, (n,)."""

    y: Array
    v: Array
    F: Array
    mode: IntArray


@compiled
def run_kernel(
    p: Array,
    h: float,
    held: bool,
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
    """One plant along one log into out (3, n): position, velocity, force; and its modes (n,).

    held: take the force from `force` and `slope` at every sample, corrected by k2 (y_m - y);
    at, at_y, at_v, at_f: samples at which the run restarts, and from where.
    """
    c = np.zeros(ORDER + 1)
    table = np.zeros((MODES, COLUMNS))
    mode_table(p, h, c, table)
    y, v, f = at_y[0], at_v[0], at_f[0]
    mode = settled_mode(p, v, f)
    window = 0
    for k in range(len(u)):
        if window < len(at) and k == at[window]:
            y, v, f = at_y[window], at_v[window], at_f[window]
            mode = settled_mode(p, v, f)
            v = 0.0 if mode == STUCK else v
            window += 1
        g = p[K1] * u[k]
        if held:
            f = force[k] + p[K2] * (y_m[k] - y)
            following = k + 1 if k + 1 < len(u) else k
            g = slope[k] + p[K2] * (y_m[following] - y_m[k]) / h
            if f < table[mode, F_LO] or f > table[mode, F_HI]:
                mode = settled_mode(p, v, f)
                v = 0.0 if mode == STUCK else v
        out[0, k], out[1, k], out[2, k] = y, v, f
        modes[k] = mode
        phi = f - table[mode, C]
        moved = table[mode, P1] * v + table[mode, P2] * phi + table[mode, P3] * g
        v_next = table[mode, A11] * v + table[mode, A12] * phi + table[mode, B1] * g
        f_next = f + g * h - p[K2] * moved
        inside = (v_next >= table[mode, V_LO]) & (v_next <= table[mode, V_HI])
        inside &= (f_next >= table[mode, F_LO]) & (f_next <= table[mode, F_HI])
        before = table[mode, D_F] * phi - table[mode, D_V] * v
        after = table[mode, D_F] * (f_next - table[mode, C]) - table[mode, D_V] * v_next
        if inside and not (before < 0.0 and after > 0.0):
            y, v, f = y + moved, v_next, f_next
        else:
            y, v, f, mode = resolve(p, y, v, f, mode, g, h, c)


def force_slope(force: Array, h: float, hold: bool) -> Array:
    """Slope of the force between samples [N/s]: 0 where it is held (a motor), else linear."""
    if hold:
        return np.zeros(len(force))
    return np.append(np.diff(force) / h, 0.0)


def free_run(
    plant: Plant,
    log: Log,
    start: tuple[float, float, float],
    drive: Drive,
    *,
    stiffness: float = 0.0,
    restarts: tuple[IntArray, Array, Array] | None = None,
) -> FreeRun:
    """Response of `plant` to the log's command or force; it sees the measured position only where
    it restarts and, for `stiffness` > 0, through stiffness * (y_m - y) added to the force.

    start: position [m], velocity [m/s], force [N] at the first sample; restarts: samples (k,),
    positions and velocities from which the run starts anew. The log must have an even clock.
    Raises BadModel where drive is "command" and the plant has no actuator.
    """
    if drive == "command" and not isinstance(plant.actuator, Actuator | Motor):
        raise BadModel("the model has no actuator: drive the run by force, not by the command")
    motor = isinstance(plant.actuator, Motor)
    held = drive == "force" or motor
    k1, k2 = 0.0, stiffness
    if isinstance(plant.actuator, Actuator) and not held:
        k1, k2 = plant.actuator.k1, plant.actuator.k2
    force = log["F"] if held else np.zeros(len(log))
    if isinstance(plant.actuator, Motor) and drive == "command":
        force = plant.actuator.k_a * log["u"]
    at, at_y, at_v = restarts if restarts else (np.zeros(0, dtype=np.int64), *np.zeros((2, 0)))
    keep = at > 0
    at = np.concatenate([[0], at[keep]]).astype(np.int64)
    at_f = log["F"][at] if "F" in log else force[at]
    at_f = np.concatenate([[start[2]], at_f[1:]])
    out = np.zeros((3, len(log)))
    modes = np.zeros(len(log), dtype=np.int64)
    run_kernel(
        kernel_parameters(plant.friction.array, k1, k2),
        log.h,
        held,
        log["u"] if "u" in log else np.zeros(len(log)),
        force,
        np.zeros(len(log)) if motor or not held else force_slope(force, log.h, hold=False),
        log["y"],
        at,
        np.concatenate([[start[0]], at_y[keep]]),
        np.concatenate([[start[1]], at_v[keep]]),
        at_f,
        out,
        modes,
    )
    return FreeRun(out[0], out[1], out[2], modes)
