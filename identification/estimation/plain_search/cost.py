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


@dataclass(frozen=True)
class RestartWindows:
    """Where the model starts: samples `at` (k,), 0 first, with position `y` [m], velocity `v` [m/s]
    there."""

    at: IntArray
    y: Array
    v: Array


@dataclass(frozen=True)
class Measured:
    """One log as the kernels take it.

    y [m], force [N], u [V], `impulse` = h * sum of u before each sample [V s], `constant` [N] that
    the actuator's equation adds to F = k1 impulse - k2 y; slopes of force and
    position between samples for LOGGED_FORCE; weights 1/sigma_y, 1/sigma_F (0: not compared).
    """

    h: float
    drive: int
    y: Array
    force: Array
    u: Array
    impulse: Array
    constant: float
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
def cost_kernel(
    p: Array,
    drive: int,
    h: float,
    y: Array,
    force: Array,
    u: Array,
    impulse: Array,
    constant: float,
    slope_y: Array,
    slope_force: Array,
    w_y: float,
    w_f: float,
    at: IntArray,
    at_y: Array,
    at_v: Array,
    cap: float,
    cost: Array,
) -> None:
    """Cost of WIDTH parameter sets.

    Sources: friction, the paper's eq. (1) (Karnopp 1985); actuator, its dF/dt = k1 u - k2 v; bound
    of a square, Geman, McClure, Bull. Int. Stat. Inst. 52 (1987) 5.

    p: (WIDTH, 11) rows of kernel parameters; at, at_y, at_v (windows,): where the run begins and
    begins anew; constant [N]: F + k2 y - k1 * impulse. cost: (WIDTH,).
    """
    s, modes, tables = work_space()
    out = np.zeros((CHUNK, 2, WIDTH))
    prepare_lanes(p, h, tables, s)
    cost[:] = 0.0
    n = len(y)
    for window in range(len(at)):
        first = at[window]
        last = at[window + 1] if window + 1 < len(at) else n
        for i in range(WIDTH):
            here, v = at_y[window], at_v[window]
            f = constant + p[i, K1] * impulse[first] - p[i, K2] * here
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
            _chunk_cost(out, y[low:high], force[low:high], w_y, w_f, cap, cost)


def cost_of_lanes(p: Array, log: Measured, windows: RestartWindows, cap: float) -> Array:
    """`cost_kernel` (the paper's plant) over a log: costs (WIDTH,)."""
    cost = np.zeros(WIDTH)
    cost_kernel(
        p,
        log.drive,
        log.h,
        log.y,
        log.force,
        log.u,
        log.impulse,
        log.constant,
        log.slope_y,
        log.slope_force,
        log.weight_y,
        log.weight_force,
        windows.at,
        windows.y,
        windows.v,
        cap,
        cost,
    )
    return cost
