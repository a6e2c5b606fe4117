"""An axis by its equation of motion alone, in a second: what a maintenance engineer asks of a log.

Mass, friction and breakaway of each direction, and friction along the travel, by least squares of
the equation in weak form, with the terms that a fit of it has; no free run, no search. Deviations
are the jackknife's over stretches of the log, so they hold what varies in it, and 0.4 % of a value
by which the equation errs itself.
"""

from dataclasses import dataclass, replace

import numpy as np

from identification.arrays import Array, BoolArray
from identification.errors import NotIdentifiable
from identification.estimation.regression.equation_rows import NOTHING_KNOWN, MotionLog, mechanical
from identification.estimation.regression.force_terms import fewest_terms
from identification.estimation.regression.motion_log import motion_log
from identification.estimation.regression.motion_rows import OF_EQUATION
from identification.estimation.regression.standstill import breakaways
from identification.estimation.regression.weighted_rows import (
    Rows,
    solve_rows,
    spread_of_left_out,
    without_each_block,
)
from identification.log import Log
from identification.thresholds import EVENTS_NEEDED, MANY_OF_A_KIND

AXIS_ROUNDS = 3  # in which the rows' noise, which depends on mass and damping, converges
SLOW_QUARTER = 4  # a quarter of the breakaways
OF_OFF = 1.4826  # deviation of normal values, of the median of their distance from theirs
OF_MEDIAN = (np.pi / 2.0) ** 0.5  # its deviation, of the mean's


@dataclass(frozen=True, eq=False)
class AxisEquation:
    """What the equation of motion identifies in one log.

    values, sd: by name, F_cp, F_cn [N], and where identifiable m [kg], F_vp, F_vn [N s/m], and the
    breakaway forces F_sp, F_sn [N], sizes. offset: (F_cn - F_cp)/2 [N], a constant force towards +y
    if friction is alike both ways, with its sd. breakaways: how many, up and down. relative: share
    of the force that is left while sliding. position [m], level [N] (size) and up, (r,): Coulomb
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

    held: the force is a zero-order hold of a command. Raises NotIdentifiable where too little
    slides in a direction, BadLog where the log is too short for one window. Sources: weak form,
    Messenger, Bortz (2021); inverse dynamic model by least squares, Gautier, Khalil, CDC 1988;
    jackknife, Tukey (1958); deviation of a median, Huber, Robust Statistics (1981).
    """
    one = motion_log(log, held=held, by_command=False)
    up, down = int(np.count_nonzero(one.up)), int(np.count_nonzero(~one.up))
    if not slides_enough(up, down):
        raise NotIdentifiable(
            f"{log.name}: {up} windows of sliding in positive and {down} in negative direction, at"
            f" least {MANY_OF_A_KIND} of each needed; log strokes in both directions"
        )
    rows = _converged(one)
    used = list(fewest_terms([rows]).used)
    some = replace(rows, X=rows.X[:, used])
    theta, each = solve_rows(some).theta, without_each_block(some)
    spread = np.hypot(spread_of_left_out(each), OF_EQUATION * np.abs(theta))
    names = [rows.names[k] for k in used]
    values = dict(zip(names, theta.tolist(), strict=True))
    sd = dict(zip(names, spread.tolist(), strict=True))
    up_at, down_at = names.index("F_cp"), names.index("F_cn")
    offset = spread_of_left_out(0.5 * (each[:, [down_at]] - each[:, [up_at]]))
    bias = 0.5 * OF_EQUATION * float(np.hypot(values["F_cp"], values["F_cn"]))
    limits, limit_sd, count = _breakaway(one, values.get("m", 0.0))
    left, levels = rows.b - some.X @ theta, [up_at, down_at]
    level = left + some.X[:, levels] @ theta[levels]
    return AxisEquation(
        {**values, **limits}, {**sd, **limit_sd},
        (0.5 * (values["F_cn"] - values["F_cp"]), float(np.hypot(offset[0], bias))), count,
        float(np.linalg.norm(left) / max(float(np.linalg.norm(rows.b)), 1e-300)),
        np.asarray(log["y"])[one.sliding.middle], level * np.where(one.up, 1.0, -1.0), one.up,
    )  # fmt: skip


def slides_enough(up: int, down: int) -> bool:
    """Whether so many windows of sliding in either direction identify its friction."""
    return min(up, down) >= MANY_OF_A_KIND


def _converged(one: MotionLog) -> Rows:
    """The rows, their noise that of the mass and damping that they show."""
    theta = NOTHING_KNOWN
    for _ in range(AXIS_ROUNDS):
        theta = solve_rows(mechanical(one, np.maximum(theta, 0.0))).theta
    return mechanical(one, np.maximum(theta, 0.0))


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
        if count[-1] >= EVENTS_NEEDED:
            order = np.argsort(np.abs(events.rate[own]), kind="stable")
            slow = order[: max(EVENTS_NEEDED, count[-1] // SLOW_QUARTER)]
            force, rate = np.abs(events.force[own])[slow], np.abs(events.rate[own])[slow]
            values[name] = float(np.median(force))
            off = float(np.median(np.abs(force - values[name])))
            late = 0.5 * one.log.h * float(np.median(rate))
            sd[name] = float(np.hypot(OF_MEDIAN * OF_OFF * off / len(force) ** 0.5, late))
    return values, sd, (count[0], count[1])
