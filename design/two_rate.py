"""The loop of figure 5 with its position controller run once in `ratio` samples of the force loop.

A force loop at the logger's rate hides the actuator from a position controller at 10 ms; at one
rate either the force loop is too slow or the position controller's poles crowd at z = 1.
"""

import math

import numpy as np
from numpy.typing import ArrayLike

from design.loop import ForcePI, LoopNoise, LoopRun, checked_noise, prepared_loop
from design.loop_kernels import force_command, shift
from design.rst import RST
from identification.arrays import Array, IntArray, frozen
from identification.compiled import compiled
from identification.errors import BadModel
from identification.plant import Plant
from identification.stepping import (
    COLUMNS,
    K1,
    K2,
    MODES,
    exact_step,
    mode_row,
    mode_table,
    parameters,
    resolve,
    settled_mode,
)


@compiled
def two_rate_kernel(
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
    """One plant p (1, 11): out (4, n) takes y, v, F, u; modes (n,).

    feed: T r at the position controller's samples (n/ratio,); the rest as in `loop_kernel`.
    """
    table = np.zeros((MODES, COLUMNS))
    plant = parameters(p, 0)
    mode_table(plant, h, table)
    k1, k2 = plant[K1], plant[K2]
    y, v, force = start
    mode = settled_mode(plant, v, force)
    row = mode_row(table, mode)
    wanted, integral = 0.0, 0.0
    for k in range(len(modes)):
        if k % ratio == 0:
            measured = y + noise_y[k]
            wanted = feed[k // ratio] - R[0] * measured + x[0]
            shift(x, R, S, measured, wanted)
        u, integral = force_command(wanted, force + noise_f[k], integral, pi[0], pi[1], limit)
        out[0, k], out[1, k], out[2, k], out[3, k] = y, v, force, u
        modes[k] = mode
        g = k1 * u
        moved, v_next, force_next, left = exact_step(row, k2, h, v, force, g)
        if left:
            y, v, force, mode = resolve(plant, y, v, force, mode, g, h)
            row = mode_row(table, mode)
        else:
            y, v, force = y + moved, v_next, force_next


def simulate_two_rate(
    plant: Plant,
    controller: RST,
    force_controller: ForcePI,
    reference: ArrayLike,
    h: float,
    *,
    noise: LoopNoise | None = None,
    control_limit: float | None = None,
    y_0: float = 0.0,
) -> LoopRun:
    """The loop of a plant with an Actuator, from rest at y_0 [m]; see `loop.simulate_loop`.

    h [s]: of the force loop, `reference` and `noise`; controller.h is a multiple of it. Raises
    BadModel where it is not, or where the parts do not fit together.
    """
    r = frozen(reference)
    ratio = round(controller.h / h)
    if ratio < 1 or abs(ratio * h - controller.h) > 1e-6 * h:
        raise BadModel(
            f"position loop every {controller.h:g} s, force loop every {h:g} s: the first must be"
            " a multiple of the second"
        )
    loop, p = prepared_loop(
        [plant],
        controller,
        force_controller,
        r[::ratio],
        controller.h,
        control_limit=control_limit,
        start=(y_0, 0.0, 0.0),
    )
    n = len(r)
    checked = checked_noise(noise, n, 1, motor=False)
    noise = LoopNoise(checked.y[:, 0], checked.F[:, 0])
    pi = (force_controller.k_i, force_controller.k_i * h / force_controller.T_i)
    limit = math.inf if control_limit is None else control_limit
    out, modes = np.empty((4, n)), np.empty(n, dtype=np.int64)
    two_rate_kernel(
        p, h, ratio, loop.feed, loop.R, loop.S, loop.x.copy(), pi, limit,
        noise.y, noise.F, loop.start, out, modes,
    )  # fmt: skip
    y, v, F, u = out
    t = h * np.arange(n, dtype=np.float64)
    return LoopRun(t, r, y, v, F, y + noise.y, F + noise.F, u, modes)
