"""An axis by its equation of motion alone, in a second: what a maintenance engineer asks of a log.

Mass, friction and breakaway of each direction, and friction along the travel, by least squares of
the equation in weak form; no free run, no search. Deviations are the jackknife's over stretches of
the log, so they hold what varies in it.
"""

from dataclasses import dataclass

import numpy as np

from identification.arrays import Array, BoolArray
from identification.errors import NotIdentifiable
from identification.estimation.regression.equation_rows import MotionLog, mechanical, motion_log
from identification.estimation.regression.standstill import breakaways
from identification.estimation.regression.weighted_rows import (
    Rows,
    solve_rows,
    spread_of_left_out,
)
from identification.log import Log

SETTLING_ROUNDS = 3  # in which the rows' noise, which depends on mass and damping, settles
FEWEST_SLIDING = 8  # windows of sliding in each direction
FEWEST_BREAKAWAYS = 3  # of a direction, from which they tell its limit
SLOW_QUARTER = 4  # a quarter of the breakaways
OF_OFF = 1.4826  # deviation of normal values, of the median of their distance from theirs
OF_MEDIAN = (np.pi / 2.0) ** 0.5  # its deviation, of the mean's


@dataclass(frozen=True, eq=False)
class AxisEquation:
    """What the equation of motion tells of one log.

    values, sd: by name, m [kg], F_cp, F_cn [N], F_vp, F_vn [N s/m], and F_sp, F_sn [N], sizes, of
    directions with enough breakaways. offset: (F_cn - F_cp)/2 [N], a constant force towards +y if
    friction is alike both ways, with its sd. breakaways: how many, up and down. relative: share of
    the force that is left while sliding. position [m], level [N] (size) and up, (r,): Coulomb
    friction of each window of sliding.
    """

    values: dict[str, float]
    sd: dict[str, float]
    offset: tuple[float, float]
    breakaways: tuple[int, int]
    relative: float
    position: Array
    level: Array
    up: BoolArray


def axis_equation(log: Log, *, held: bool) -> AxisEquation:
    """The log's equation of motion; y [m] and F [N] are needed.

    held: the force is a command held over each period. Raises NotIdentifiable where too little
    slides in a direction, BadLog where the log is too short for one window.
    """
    one = motion_log(log, held=held, by_command=False)
    up, down = int(np.count_nonzero(one.up)), int(np.count_nonzero(~one.up))
    if min(up, down) < FEWEST_SLIDING:
        raise NotIdentifiable(
            f"{log.name}: {up} windows of sliding in positive and {down} in negative direction, at"
            f" least {FEWEST_SLIDING} of each needed; log strokes in both directions"
        )
    rows, theta = _settled(one)
    each = _left_out(rows)
    spread = spread_of_left_out(each)
    offset = spread_of_left_out(0.5 * (each[:, 2] - each[:, 1])[:, np.newaxis])
    values = dict(zip(rows.names, theta.tolist(), strict=True))
    sd = dict(zip(rows.names, spread.tolist(), strict=True))
    limits, limit_sd, count = _breakaway(one, values["m"])
    left = rows.b - rows.X @ theta
    level = (rows.b - rows.X[:, [0, 3, 4]] @ theta[[0, 3, 4]]) * np.where(one.up, 1.0, -1.0)
    return AxisEquation(
        {**values, **limits}, {**sd, **limit_sd},
        (0.5 * (values["F_cn"] - values["F_cp"]), float(offset[0])), count,
        float(np.linalg.norm(left) / max(float(np.linalg.norm(rows.b)), 1e-300)),
        np.asarray(log["y"])[one.sliding.middle], level, one.up,
    )  # fmt: skip


def _settled(one: MotionLog) -> tuple[Rows, Array]:
    """The rows, and the parameters of their least squares."""
    theta = np.array([1.0, 0.0, 0.0, 0.0, 0.0])
    for _ in range(SETTLING_ROUNDS):
        theta = solve_rows(mechanical(one, np.maximum(theta, 0.0))).theta
    return mechanical(one, np.maximum(theta, 0.0)), theta


def _left_out(rows: Rows) -> Array:
    """The parameters of the rows without each stretch of the log in turn (k, p)."""
    return np.array(
        [solve_rows(rows, rows.block != block).theta for block in np.unique(rows.block)]
    )


def _breakaway(
    one: MotionLog, m: float
) -> tuple[dict[str, float], dict[str, float], tuple[int, int]]:
    """Breakaway forces as sizes [N], their deviations, and how many there were up and down.

    Of each direction the median of the quarter in which the force rose most slowly: the motion is
    seen late, and by then a fast force has gone further. The deviation holds half of what the force
    rises in a sample.
    """
    if not m > 0:
        return {}, {}, (0, 0)
    events = breakaways(one, m)
    values, sd, count = dict[str, float](), dict[str, float](), list[int]()
    for name, way in (("F_sp", 1.0), ("F_sn", -1.0)):
        own = events.direction == way
        count.append(int(np.count_nonzero(own)))
        if count[-1] >= FEWEST_BREAKAWAYS:
            order = np.argsort(np.abs(events.rate[own]), kind="stable")
            slow = order[: max(FEWEST_BREAKAWAYS, count[-1] // SLOW_QUARTER)]
            force, rate = np.abs(events.force[own])[slow], np.abs(events.rate[own])[slow]
            values[name] = float(np.median(force))
            off = float(np.median(np.abs(force - values[name])))
            late = 0.5 * one.log.h * float(np.median(rate))
            sd[name] = float(np.hypot(OF_MEDIAN * OF_OFF * off / len(force) ** 0.5, late))
    return values, sd, (count[0], count[1])
