"""What a fit states though steady sliding does not show it: no value, with the reason.

A mass whose inertia is next to nothing of the force, goes with the position as a spring or, by the
equation, shows as the body turns back alone, and Coulomb apart from viscous friction where all
sliding has one speed. How a body turns back is not in the columns of sliding, and the fit takes one
for the other.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from identification.arrays import Array, BoolArray
from identification.estimation.estimates import widened
from identification.estimation.prescribed_motion import (
    COLUMNS_OF_WAYS,
    WHY_NOT,
    together_alone,
)
from identification.estimation.recorded_logs import RecordedLogs
from identification.estimation.regression.equation_rows import FIVE
from identification.estimation.regression.force_terms import of_one_speed
from identification.estimation.regression.motion_rows import rows_and_windows
from identification.estimation.regression.weighted_rows import (
    OVERLAP,
    Rows,
    least_squares,
    solve_rows,
    stacked,
)
from identification.model.estimates import NORMAL_95, KarnoppFit
from identification.model.plant import units_of
from identification.signals.steps import MEDIAN_OF_NOISE
from identification.thresholds import FOURFOLD, HALF, MATERIAL, OF_ACCOUNT

TURNING_WHY = (
    "inertia shows where the body turns back alone, in which friction is not that of sliding: the"
    " mass is not identifiable; log gentler changes of speed"
)
SPEEDS_MORE = f"add strokes at other speeds, at least {FOURFOLD:g} times apart"
SPRING_WHY = (
    "the acceleration goes with the position, as in motion of one frequency: {:.3g} {} is the mass"
    " less what any spring takes off it (k/w^2); log motion of several frequencies"
)
# Share of a window in which a body goes one way that does not turn back.
ONE_WAY_THROUGHOUT = 1.0 - 1e-9


def as_sliding_shows(fit: KarnoppFit, recorded: RecordedLogs) -> KarnoppFit:
    """The fit without the values of mass and sliding friction that its logs' sliding does not show.

    Source: information of least squares, Aitken, Proc. R. Soc. Edinburgh 55 (1936) 42; the rules
    are ours.
    """
    if recorded.by_command and fit.adequate and not fit.prescribed:
        return fit  # its run is that of an actuator's command, and shows how the body turns back
    p = fit.friction
    theta = np.array([getattr(p, name) for name in FIVE])
    made = rows_and_windows(recorded.logs, theta)
    every = stacked([one.rows for one in made])
    if not len(every.b):
        return fit
    logged = list(zip(made, recorded.plain, strict=True))
    y = np.concatenate([one.windows.mean @ np.asarray(log["y"]) for one, log in logged])
    steady = [np.abs(every.X[:, level]) > ONE_WAY_THROUGHOUT for level, _ in COLUMNS_OF_WAYS]
    reasons = dict[str, str]()
    share = abs(p.m) * float(np.std(every.X[:, 0])) / max(float(np.std(every.b)), 1e-300)
    if fit.estimates["m"].known:
        if share < MATERIAL:
            reasons["m"] = WHY_NOT["m"].format(share=f"{share:.1%}")
        elif fit.prescribed and _by_turning(every, steady[0] | steady[1], 0):
            reasons["m"] = TURNING_WHY
        elif _is_a_springs(every, y, p.m):
            reasons["m"] = SPRING_WHY.format(p.m, units_of(recorded.rig.motion)["m"])
    by_rig = fit.prescribed and not fit.estimates["m"].known  # in strokes that are all alike
    for way, kept in zip(COLUMNS_OF_WAYS, steady, strict=True):
        stated = by_rig and fit.estimates[FIVE[way[1]]].known and _is_mostly(every, kept, way[1])
        together = stated or _by_turning(every, kept, way[1])
        if together and of_one_speed(every.at(kept), way[1]):
            reasons |= together_alone(every.at(kept), way, recorded.rig, SPEEDS_MORE)
    fit = _without(fit, {key: f"{recorded.name}: {why}" for key, why in reasons.items()})
    if recorded.by_command or (fit.prescribed and not recorded.zoh):
        return fit  # the equation of a measured force has an unknown instant beside it
    if recorded.drive == "force" and fit.adequate:
        left = (every.b - every.X @ theta) / every.sd
        fit = _as_unsure(fit, float(np.median(np.abs(left))) / MEDIAN_OF_NOISE)
    rate = np.zeros(len(FIVE))
    if recorded.zoh and not fit.whole:  # whole runs know it better than the rows do
        changes = [one.windows.first @ np.asarray(log["F"]) for one, log in logged]
        rate = solve_rows(replace(every, b=np.concatenate(changes))).theta
    return _of_any_instant(fit, rate, recorded.instant_sd)


def _as_unsure(fit: KarnoppFit, noises: float) -> KarnoppFit:
    """The fit of a run that follows by a measured force, of which the equation leaves so many times
    its noise, estimated too small as the deviations are. Source: scale by the median of what is
    left, Huber, Robust Statistics (1981), 5.1."""
    if noises <= 1.0:
        return fit
    wider = {name: widened(one, noises) for name, one in fit.estimates.items()}
    return replace(fit, estimates=wider, covariance=noises**2 * fit.covariance)


def _of_any_instant(fit: KarnoppFit, rate: Array, instant_sd: float) -> KarnoppFit:
    """The fit whose mass and sliding friction err by as much as it is unsure when the force acts,
    deviation [s]; rate (5,): the fit of the equation's rows to the force's rate of change, 0 where
    the mass alone errs. F(t - lag) = F - lag F' to first order, by which a run has F_v of a lag as
    mass; ours."""
    theta, viscous = rate.copy(), 0.5 * (fit.friction.F_vp + fit.friction.F_vn)
    theta[0] = max(theta[0], viscous)
    moved = dict(zip(FIVE, instant_sd * theta, strict=True))
    wider = {
        name: widened(one, float(np.hypot(one.sd, moved[name])) / one.sd)
        for name, one in fit.estimates.items()
        if name in moved and one.sd
    }
    errs = np.array([moved.get(name, 0.0) for name in fit.free])
    covariance = fit.covariance + np.outer(errs, errs)
    return replace(fit, estimates={**fit.estimates, **wider}, covariance=covariance)


def _by_turning(every: Rows, steady: BoolArray, column: int) -> bool:
    """Whether rows of steady sliding (r,), though they are most of those in which a column is,
    have next to nothing of the information on its coefficient."""
    if not _is_mostly(every, steady, column):
        return False
    return _information(every.at(steady), column) < OF_ACCOUNT * _information(every, column)


def _is_mostly(every: Rows, steady: BoolArray, column: int) -> bool:
    """Whether rows of steady sliding (r,) are most of those in which a column is."""
    return bool(np.count_nonzero(steady) > HALF * np.count_nonzero(every.X[:, column]))


def _is_a_springs(every: Rows, y: Array, m: float) -> bool:
    """Whether the accelerations of these rows (r,) are all but the positions y (r,), and a spring
    beside the mass m [kg] would make it another."""
    beside = replace(every, X=np.column_stack([every.X, y, np.ones(len(y))]))
    own = _information(beside, 0)
    if own >= OF_ACCOUNT * _information(every, 0):
        return False
    free = solve_rows(beside)
    sd = np.sqrt(OVERLAP * float(np.mean(free.residual**2)) / max(own, 1e-300))
    return abs(m - float(free.theta[0])) > NORMAL_95 * float(sd)


def _information(rows: Rows, column: int) -> float:
    """Information of these rows on the coefficient of a column beside those of all others."""
    A = rows.X / rows.sd[:, np.newaxis]
    others = np.delete(A, column, axis=1)
    return float(np.sum((A[:, column] - others @ least_squares(others, A[:, column])) ** 2))


def _without(fit: KarnoppFit, reasons: Mapping[str, str]) -> KarnoppFit:
    """The fit without these values, by the reason of each."""
    none = {
        name: fit.estimates[name].withheld(why, float(getattr(fit.friction, name)))
        for name, why in reasons.items()
    }
    falling = {name: one for name, one in fit.falling.items() if name not in none}
    return replace(fit, estimates={**fit.estimates, **none}, falling=falling)
