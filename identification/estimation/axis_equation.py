"""An axis by its equation of motion alone, in a second: what a maintenance engineer asks of a log.

Mass, friction and breakaway of each direction, and friction along the travel, by the force
equation that `identify` has where no run is followed; no free run, no search.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from identification.arrays import Array, BoolArray
from identification.errors import NotIdentifiable
from identification.estimation.prescribed_motion import force_fit
from identification.estimation.recorded_logs import RecordedLogs
from identification.estimation.regression.breakaway import (
    breakaway_limits,
    usual_limits,
    with_shown_band,
)
from identification.estimation.regression.equation_rows import FIVE, MotionLog
from identification.estimation.regression.force_terms import LEVEL_COLUMNS
from identification.log import Log, Rig
from identification.model.estimates import Drive
from identification.model.karnopp import Karnopp
from identification.model.plant import Plant
from identification.thresholds import MANY_OF_A_KIND

LEAST = 1e-9  # of a parameter that the equation has not


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
    drive: Drive = "command" if rig.kind == "motor" else "force"
    recorded = RecordedLogs((), rig, drive).of([log])
    fit, (made,) = force_fit(recorded)
    up, down = int(np.count_nonzero(made.up)), int(np.count_nonzero(~made.up))
    if not slides_enough(up, down):
        raise NotIdentifiable(
            f"{log.name}: {up} windows of sliding in positive and {down} in negative direction, at"
            f" least {MANY_OF_A_KIND} of each needed; log strokes in both directions"
        )
    # Friction that falls with speed has the level of the speeds logged, as of `identify`.
    logged, names = fit.at_logged_speeds(made.rows), [FIVE[k] for k in fit.used]
    values = dict(zip(names, logged.theta.tolist(), strict=True))
    levels = np.array([values.get(name, 0.0) for name in ("F_cp", "F_cn")])
    half = np.array([{"F_cp": -0.5, "F_cn": 0.5}.get(name, 0.0) for name in names])
    limits, limit_sd, count = _breakaway(recorded.logs[0], values)
    falling = {slope for _, slope in fit.falling}
    beside = [i for i, k in enumerate(fit.used) if k not in (*LEVEL_COLUMNS, *falling)]
    level = made.rows.b - made.rows.X[:, np.array(fit.used)[beside]] @ fit.theta[beside]
    return AxisEquation(
        {**values, **limits}, {**logged.sd, **limit_sd},
        (0.5 * float(levels[1] - levels[0]), float(np.sqrt(half @ logged.covariance @ half))),
        count, fit.relative,
        np.asarray(log["y"])[made.windows.middle], level * np.where(made.up, 1.0, -1.0), made.up,
    )  # fmt: skip


def slides_enough(up: int, down: int) -> bool:
    """Whether so many windows of sliding in either direction identify its friction."""
    return min(up, down) >= MANY_OF_A_KIND


def _breakaway(
    one: MotionLog, values: Mapping[str, float]
) -> tuple[dict[str, float], dict[str, float], tuple[int, int]]:
    """Breakaway forces as sizes [N], their deviations, and how many there were up and down, by
    sliding friction; the deviation holds half of what the force rises in a sample."""
    if not values.get("m", 0.0) > 0:
        return {}, {}, (0, 0)
    m, F_cp, F_cn, F_vp, F_vn = (max(values.get(name, 0.0), LEAST) for name in FIVE)
    sliding = Karnopp(m, F_cp, F_cn, F_vp, F_vn, 0.0, 0.0, F_cp, -F_cn)
    friction = with_shown_band(one, sliding)
    direction = breakaway_limits(one, friction).direction
    count = int(np.count_nonzero(direction > 0)), int(np.count_nonzero(direction < 0))
    limits, rise = usual_limits([one], Plant(friction))
    known = {name: size for name, size in limits.items() if np.isfinite(size.sd)}
    sizes = {name: abs(size.value) for name, size in known.items()}
    sd = {name: float(np.hypot(size.sd, 0.5 * rise)) for name, size in known.items()}
    return sizes, sd, count
