"""Distance between a log and the simulated response, for many parameter sets at once (compiled).

The run is cut into windows: one window is the free run over the whole log, many windows restart the
model from the measured state, which keeps a wrong parameter from spoiling all that follows.
Residuals are (y - y_m)/sigma_y and (F - F_m)/sigma_F. `drive` COMMAND integrates dF/dt = k1 u - k2
v; LOGGED_FORCE takes F from the log at every sample, with its slope in between and, where k2 > 0,
corrected by k2 (y_m - y): the force that the actuator's stiffness gives to a body elsewhere.
"""

from dataclasses import dataclass

import numpy as np

from identification.arrays import Array, IntArray
from identification.compiled import compiled, compiled_fast
from identification.simulation.karnopp_lanes import (
    WIDTH,
    march,
    march_held,
    place,
    prepare_lanes,
    work_space,
)
from identification.simulation.karnopp_step import K1, K2

COMMAND, LOGGED_FORCE = 0, 1
CHUNK = 128
START_Y, START_V, START_G = range(3)


@dataclass(frozen=True)
class RestartWindows:
    """Where the model restarts: sample `at` (k,), with position `y` [m] and velocity `v` [m/s]."""

    at: IntArray
    y: Array
    v: Array


@dataclass(frozen=True)
class Measured:
    """One log as the kernels take it.

    y [m], force [N], u [V], `impulse` = h * sum of u before each sample [V s]; slopes of force and
    position between samples for LOGGED_FORCE; weights 1/sigma_y, 1/sigma_F (0: not compared).
    """

    h: float
    drive: int
    y: Array
    force: Array
    u: Array
    impulse: Array
    slope_y: Array
    slope_force: Array
    weight_y: float
    weight_force: float

    @property
    def count(self) -> int:
        """Number of compared values."""
        return len(self.y) * (int(self.weight_y > 0) + int(self.weight_force > 0))


@compiled_fast
def _chunk_cost(
    out: Array, y: Array, force: Array, w_y: float, w_f: float, cap: float, cost: Array
) -> None:
    """Add the squared residuals, bent to stay below `cap` where that is positive, to `cost`."""
    for k in range(len(y)):
        for i in range(WIDTH):
            r_y = (out[k, 0, i] - y[k]) * w_y
            r_f = (out[k, 1, i] - force[k]) * w_f
            square = r_y * r_y + r_f * r_f
            cost[i] += square if cap <= 0.0 else cap * square / (cap + square)


@compiled
def _chunk_rows(
    out: Array, y: Array, force: Array, w_y: float, w_f: float, cap: float, rows: Array
) -> None:
    """Residual rows (2 n, WIDTH): lane 0 as it is, the others less lane 0, robustly weighted."""
    for k in range(len(y)):
        r_y = (out[k, 0, 0] - y[k]) * w_y
        r_f = (out[k, 1, 0] - force[k]) * w_f
        weight = 1.0
        if cap > 0.0:
            weight = cap / (cap + r_y * r_y + r_f * r_f)
        for i in range(WIDTH):
            rows[2 * k, i] = weight * w_y * (out[k, 0, i] - out[k, 0, 0])
            rows[2 * k + 1, i] = weight * w_f * (out[k, 1, i] - out[k, 1, 0])
        rows[2 * k, 0] = weight * r_y
        rows[2 * k + 1, 0] = weight * r_f


@compiled
def cost_kernel(
    p: Array,
    start: Array,
    drive: int,
    h: float,
    y: Array,
    force: Array,
    u: Array,
    impulse: Array,
    slope_y: Array,
    slope_force: Array,
    w_y: float,
    w_f: float,
    at: IntArray,
    at_y: Array,
    at_v: Array,
    cap: float,
    cost: Array,
    gram: Array,
    stretch: int,
) -> None:
    """Cost of WIDTH parameter sets and, where `gram` is not empty, its local quadratic form.

    Sources: friction, the paper's eq. (1) (Karnopp 1985); actuator, its dF/dt = k1 u - k2 v; bound
    of a square, Geman, McClure, Bull. Int. Stat. Inst. 52 (1987) 5.

    p: (WIDTH, 11) rows of kernel parameters; start: (WIDTH, 3) first position, first velocity and
    the constant F + k2 y - k1 * impulse; at, at_y, at_v: the windows, the first of which starts
    from `start`. cost: (WIDTH,). gram (stretches, WIDTH, WIDTH), one a stretch of `stretch`
    samples: [0, 0] is r'r of lane 0, [0, i] is d_i' r, [i, j] d_i' d_j with
    d_i the change of the residual from lane 0 to lane i.
    """
    s, modes, tables = work_space()
    out = np.zeros((CHUNK, 2, WIDTH))
    rows = np.zeros((2 * CHUNK, WIDTH))
    prepare_lanes(p, h, tables, s)
    cost[:] = 0.0
    gram[:, :, :] = 0.0
    n = len(y)
    for window in range(len(at)):
        first = at[window]
        last = at[window + 1] if window + 1 < len(at) else n
        for i in range(WIDTH):
            here, v = at_y[window], at_v[window]
            if window == 0:
                here, v = start[i, START_Y], start[i, START_V]
            f = start[i, START_G] + p[i, K1] * impulse[first] - p[i, K2] * here
            if drive == LOGGED_FORCE:
                f = force[first] + p[i, K2] * (y[first] - here)
            place(s, modes, tables, p, i, here, v, f)
        for low in range(first, last, CHUNK):
            high = min(low + CHUNK, last)
            if drive == COMMAND:
                march(p, tables, s, modes, u[low:high], h, out)
            else:
                march_held(
                    p,
                    tables,
                    s,
                    modes,
                    y[low:high],
                    force[low:high],
                    slope_y[low:high],
                    slope_force[low:high],
                    h,
                    out,
                )
            if len(gram) > 0:
                _chunk_rows(out, y[low:high], force[low:high], w_y, w_f, cap, rows)
                used = rows[: 2 * (high - low)]
                part = min(low // stretch, len(gram) - 1)
                gram[part] += np.dot(used.T, used)
            else:
                _chunk_cost(out, y[low:high], force[low:high], w_y, w_f, cap, cost)


def cost_of_lanes(
    p: Array,
    start: Array,
    log: Measured,
    windows: RestartWindows,
    cap: float,
    stretches: int,
) -> tuple[Array, Array]:
    """`cost_kernel` (the paper's plant) over a log: costs (WIDTH,), and Gram matrices (stretches,
    WIDTH, WIDTH).

    stretches: parts of the log, each with its own matrix; 0 for costs alone.
    """
    cost = np.zeros(WIDTH)
    gram = np.zeros((stretches, WIDTH, WIDTH))
    stretch = len(log.y) // max(stretches, 1) + 1
    cost_kernel(
        p,
        start,
        log.drive,
        log.h,
        log.y,
        log.force,
        log.u,
        log.impulse,
        log.slope_y,
        log.slope_force,
        log.weight_y,
        log.weight_force,
        windows.at,
        windows.y,
        windows.v,
        cap,
        cost,
        gram,
        stretch,
    )
    return cost, gram
