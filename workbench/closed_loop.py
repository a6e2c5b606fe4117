"""The loop in simulation: RST position controller, PI force loop, plant; at one or two rates.

The position controller may run once in `ratio` samples of the force loop. A motor takes the
force reference as it is, held over the sample.
"""

from dataclasses import dataclass

import numpy as np

from design.rst import RST
from identification.arrays import Array
from identification.compiled import compiled
from identification.errors import BadModel
from identification.plant import Actuator, Motor, Plant
from identification.stepping import (
    COLUMNS,
    F_HI,
    F_LO,
    K1,
    MODES,
    ORDER,
    STUCK,
    kernel_parameters,
    mode_table,
    settled_mode,
    step,
)


@dataclass(frozen=True)
class ForcePI:
    """C_F = k_i (1 + h z^-1/(T_i (1 - z^-1))); k_i [V/N], T_i [s]."""

    k_i: float
    T_i: float


@dataclass(frozen=True)
class Noise:
    """Standard deviations of the measured position [m] and force [N]."""

    y: float = 0.0
    F: float = 0.0


@dataclass(frozen=True)
class Trace:
    """A simulated loop, each (n,): time [s], reference [m], true position y [m] and force F [N],
    what the sensors showed of them (y_m, F_m), and the command u [V]."""

    t: Array
    r: Array
    y: Array
    F: Array
    y_m: Array
    F_m: Array
    u: Array


@compiled
def loop_kernel(
    p: Array,
    h: float,
    ratio: int,
    R: Array,
    S: Array,
    T: Array,
    pi: Array,
    k_a: float,
    limit: float,
    r: Array,
    noise: Array,
    out: Array,
) -> None:
    """One loop from rest at r[0] into out (3, n): position, force, command.

    pi: k_i and h/T_i; k_a: of a motor, 0 for an actuator; limit: of the command, 0 for none;
    noise: (2, n) of position and force.
    """
    c = np.zeros(ORDER + 1)
    table = np.zeros((MODES, COLUMNS))
    mode_table(p, h, c, table)
    y_old, u_old, r_old = np.full(len(R), r[0]), np.zeros(len(S)), np.full(len(T), r[0])
    y, v, f, mode, integral, wanted = r[0], 0.0, 0.0, STUCK, 0.0, 0.0
    for k in range(len(r)):
        if k % ratio == 0:
            y_old[1:] = y_old[:-1].copy()
            u_old[1:] = u_old[:-1].copy()
            r_old[1:] = r_old[:-1].copy()
            y_old[0], r_old[0] = y + noise[0, k], r[k]
            total = np.sum(T * r_old) - np.sum(R * y_old) - np.sum(S[1:] * u_old[1:])
            wanted = total / S[0]
            if k_a != 0.0 and limit > 0.0:
                wanted = min(max(wanted, -abs(k_a) * limit), abs(k_a) * limit)
            u_old[0] = wanted
        if k_a != 0.0:
            u = wanted / k_a
            f = wanted
            if f < table[mode, F_LO] or f > table[mode, F_HI]:
                mode = settled_mode(p, v, f)
                v = 0.0 if mode == STUCK else v
            g = 0.0
        else:
            error = wanted - f - noise[1, k]
            u = pi[0] * (error + integral)
            if limit > 0.0 and abs(u) > limit:
                u = limit if u > 0.0 else -limit
            else:
                integral += pi[1] * error
            g = p[K1] * u
        out[0, k], out[1, k], out[2, k] = y, f, u
        y, v, f, mode = step(p, table, y, v, f, mode, g, h, c)


def simulate_loop(
    plant: Plant,
    controller: RST,
    force: ForcePI | None,
    r: Array,
    h: float,
    rng: np.random.Generator,
    *,
    noise: Noise | None = None,
    limit: float | None = None,
) -> Trace:
    """The loop along the reference r [m], (n,), from rest at r[0]; h [s] of the force loop.

    controller.h must be h or a multiple of it. limit: of the command [V]. Raises BadModel where
    force loop and actuator do not go together, or the periods do not.
    """
    noise = noise or Noise()
    ratio = round(controller.h / h)
    if ratio < 1 or abs(ratio * h - controller.h) > 1e-6 * h:
        raise BadModel(f"position loop every {controller.h:g} s, force loop every {h:g} s: the "
                       "first must be a multiple of the second")  # fmt: skip
    if plant.effects:
        raise BadModel(f"effects {', '.join(plant.effects)}: the loop cannot simulate them")
    match plant.actuator, force:
        case Actuator(k1, k2), ForcePI(k_i, T_i):
            row, k_a = kernel_parameters(plant.friction.array, k1, k2), 0.0
            pi = np.array([k_i, h / T_i])
        case (Motor() | None) as motor, None:
            k_a = motor.k_a if isinstance(motor, Motor) else 1.0
            row, pi = kernel_parameters(plant.friction.array, 0.0, 0.0), np.zeros(2)
        case Actuator(), None:
            raise BadModel("the plant has an actuator, the loop no force controller for it")
        case _:
            raise BadModel("the loop has a force controller, the plant no actuator for it")
    r = np.ascontiguousarray(r, dtype=np.float64)
    drawn = rng.standard_normal((2, len(r))) * np.array([[noise.y], [noise.F]])
    out = np.zeros((3, len(r)))
    R, S, T = (np.array(values) for values in (controller.R, controller.S, controller.T))
    loop_kernel(row, h, ratio, R, S, T, pi, k_a, limit or 0.0, r, drawn, out)
    t = h * np.arange(len(r), dtype=np.float64)
    return Trace(t, r, out[0], out[1], out[0] + drawn[0], out[1] + drawn[1], out[2])
