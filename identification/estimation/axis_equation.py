"""An axis by its equation of motion alone, in a second: what a maintenance engineer asks of a log.

Mass, friction and breakaway of each direction, and friction along the travel, by the force
equation that `identify` has where no run is followed; no free run, no search.
"""

from dataclasses import dataclass

import numpy as np

from identification.arrays import Array, BoolArray
from identification.errors import NotIdentifiable
from identification.estimation.regression.equation_rows import (
    FIVE,
    NOTHING_KNOWN,
    MotionLog,
    mechanical,
)
from identification.estimation.regression.force_terms import Lateness, fewest_terms
from identification.estimation.regression.motion_log import motion_log
from identification.estimation.regression.motion_rows import NOISE_ROUNDS
from identification.estimation.regression.standstill import breakaways
from identification.estimation.regression.weighted_rows import Rows, solve_rows
from identification.log import Log, Rig
from identification.thresholds import EVENTS_NEEDED, MANY_OF_A_KIND

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


def axis_equation(log: Log, rig: Rig) -> AxisEquation:
    """The log's equation of motion; y [m] and F [N] are needed.

    Raises NotIdentifiable where too little slides in a direction. Sources: weak form, Messenger,
    Bortz (2021); inverse dynamic model by least squares, Gautier, Khalil, CDC 1988; deviation of a
    median, Huber, Robust Statistics (1981).
    """
    one = motion_log(log, zoh=rig.kind == "motor", by_command=False)
    up, down = int(np.count_nonzero(one.up)), int(np.count_nonzero(~one.up))
    if not slides_enough(up, down):
        raise NotIdentifiable(
            f"{log.name}: {up} windows of sliding in positive and {down} in negative direction, at"
            f" least {MANY_OF_A_KIND} of each needed; log strokes in both directions"
        )
    rows = _converged(one)
    fit = fewest_terms([rows], None if one.zoh else Lateness.of([one.sliding], [log]))
    names = [FIVE[k] for k in fit.used]
    values = dict(zip(names, fit.theta.tolist(), strict=True))
    levels = np.array([values.get(name, 0.0) for name in ("F_cp", "F_cn")])
    half = np.array([{"F_cp": -0.5, "F_cn": 0.5}.get(name, 0.0) for name in names])
    limits, limit_sd, count = _breakaway(one, values.get("m", 0.0))
    level = fit.residuals[0] + rows.X[:, (1, 2)] @ levels
    return AxisEquation(
        {**values, **limits}, {**fit.sd, **limit_sd},
        (0.5 * float(levels[1] - levels[0]), float(np.sqrt(half @ fit.covariance @ half))),
        count, fit.relative,
        np.asarray(log["y"])[one.sliding.middle], level * np.where(one.up, 1.0, -1.0), one.up,
    )  # fmt: skip


def slides_enough(up: int, down: int) -> bool:
    """Whether so many windows of sliding in either direction identify its friction."""
    return min(up, down) >= MANY_OF_A_KIND


def _converged(one: MotionLog) -> Rows:
    """The rows, their noise that of the mass and damping that they show."""
    theta = NOTHING_KNOWN
    for _ in range(NOISE_ROUNDS):
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
