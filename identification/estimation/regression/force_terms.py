"""The force equation by least squares, with the fewest terms of friction that predict.

Columns are m, F_cp, F_cn, F_vp, F_vn, as `motion_rows` has them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.arrays import Array
from identification.arx.residual_tests import effective_samples
from identification.estimation.regression.equation_rows import FIVE
from identification.estimation.regression.row_fit import rms
from identification.estimation.regression.weighted_rows import (
    OF_EQUATION,
    Rows,
    inverse_of_gram,
    least_squares,
    left_unseen,
    robust,
    solve_rows,
    stacked,
    with_model_error,
)
from identification.log import Log
from identification.model.estimates import NORMAL_95
from identification.signals.weak_form import WeakWindows
from identification.thresholds import HALF, NEARLY_ALL, OF_ACCOUNT, TWICE, WORSE

# Columns of Coulomb friction with those of viscous friction that may stand beside, or these alone
LEVEL_COLUMNS, VISCOUS_COLUMNS = (1, 2), (3, 4)
OF_BOTH_WAYS = ((1, 2), (1, 2, 3), (1, 2, 4), (3, 4), (1, 2, 3, 4))
OF_ONE_WAY = {True: ((1,), (1, 3), (3,)), False: ((2,), (2, 4), (4,))}  # up alone, down alone


@dataclass(frozen=True)
class ForceFit:
    """Columns used, coefficients (k,), covariance (k, k), residuals a log, share of inertia in the
    force."""

    used: tuple[int, ...]
    theta: Array
    covariance: Array
    residuals: tuple[Array, ...]
    rms: float
    relative: float
    share: float

    def at_logged_speeds(self, rows: Rows) -> "ForceFit":
        """The fit whose levels, where friction falls with speed, are those at the mean speed of
        these rows, as unsure as it varies over them.

        Beside a slope below 0, which no body is simulated with, the coefficient is a level at rest
        that no row has shown. First-order propagation of errors; ours.
        """
        theta, change = self.theta.copy(), np.eye(len(self.used))
        varies = np.zeros(len(self.used))
        for level, slope in self.falling:
            i, k = self.used.index(level), self.used.index(slope)
            speeds = np.abs(rows.X[rows.X[:, slope] != 0.0, slope])
            change[i, k] = float(np.mean(speeds))
            theta[i] += self.theta[k] * change[i, k]
            varies[i] = self.theta[k] * float(np.std(speeds))
        covariance = change @ self.covariance @ change.T + np.diag(varies**2)
        return replace(self, theta=theta, covariance=covariance)

    @property
    def used_but_mass(self) -> tuple[int, ...]:
        """The columns of friction alone."""
        return tuple(column for column in self.used if column != 0)

    def left_of(self, rows: Rows) -> float:
        """What it leaves of the force of rows [N], root mean square."""
        return rms(rows.b - rows.X[:, self.used] @ self.theta)

    @property
    def falling(self) -> list[tuple[int, int]]:
        """Columns of level and slope of the directions in which friction falls with speed."""
        sizes = dict(zip(self.used, self.theta.tolist(), strict=True))
        ways = zip(LEVEL_COLUMNS, VISCOUS_COLUMNS, strict=True)
        return [(i, k) for i, k in ways if sizes.get(i, 0.0) > 0.0 > sizes.get(k, 0.0)]

    @property
    def sd(self) -> dict[str, float]:
        """Standard deviations of the coefficients by name."""
        spread = np.sqrt(np.diag(self.covariance)).tolist()
        return dict(zip((FIVE[i] for i in self.used), spread, strict=True))


def unseen_lag(h: float) -> float:
    """Deviation [s] of the instant at which a force measured every h [s] acts: anywhere within half
    a sample of its row. Ours."""
    return HALF * h / float(np.sqrt(3.0))


@dataclass(frozen=True, eq=False)
class Lateness:
    """How unsure the instant is at which a logged force acts: what a delay of 1 s would take from
    the rows, (r,) [N/s], and the deviation of that delay [s] before anything is fitted.

    F(t - lag) = F - lag F' to first order. A lag of part of a sample shows as damping, m w^2 lag
    in motion of w [rad/s]; as an unknown of normal prior it widens what it is confounded with, and
    no more than the rows leave it open. Source: Robinson, Statistical Science 6 (1991) 15.
    """

    rate: Array
    sd: float

    @classmethod
    def of(cls, windows: Sequence[WeakWindows], logs: Sequence[Log]) -> "Lateness":
        """Of a measured force [N] in the windows of each log. Source: as of the class."""
        pairs = zip(windows, logs, strict=True)
        return cls(
            np.concatenate([w.first @ np.asarray(log["F"]) for w, log in pairs]),
            unseen_lag(logs[0].h),
        )

    def beside(self, columns: Array, weight: Array, variance: float) -> Array:
        """Weighted columns (r, k) with that of the delay, and its prior as one more row, in units
        of the rows' variance: (r + 1, k + 1)."""
        out = np.zeros((len(columns) + 1, columns.shape[1] + 1))
        out[:-1, :-1], out[:-1, -1] = columns, weight * self.rate
        out[-1, -1] = variance**0.5 / self.sd
        return out


def column_sets(up: bool | None) -> list[tuple[int, ...]]:
    """The columns that may be fitted together, the fewest first; up: the way of motion one way
    alone, None: both ways."""
    friction = OF_BOTH_WAYS if up is None else OF_ONE_WAY[up]
    return sorted(((*mass, *some) for some in friction for mass in ((), (0,))), key=len)


def fewest_terms(
    data: Sequence[Rows], late: Lateness | None = None, every: Rows | None = None,
    up: bool | None = None,
) -> ForceFit:  # fmt: skip
    """The fewest columns that leave hardly more of the force, on blocks that the fit has not seen,
    than those that leave least; a mass that comes out below 0 is none, nor one that leaves more of
    `every` row, those with reversals too, than none does; nor is viscous friction
    that would take Coulomb friction below 0: at speeds alike it stands for anything. Source:
    cross-validation, Stone, J. R. Stat. Soc. B 36 (1974) 111; the margin is ours, and so is that
    the levels are as uncertain as beside viscous friction that is left out, where these logs
    separate the two. up: of motion one way alone, as `column_sets`."""
    data = as_they_err(data)
    rows = stacked(data)
    weight = np.median(rows.sd) / rows.sd
    alike = {column for column in VISCOUS_COLUMNS if of_one_speed(rows, column, WORSE)}
    sets = [fitted(data, used, late) for used in column_sets(up) if not alike.intersection(used)]
    rubs = _rubs(sets[-1], rows.b)
    fits = [one for one in sets if _may_be(one) and (rubs or set(one.used) & set(LEVEL_COLUMNS))]
    if every is not None:
        left_by = {one.used: one.left_of(every) for one in sets}
        fits = [one for one in fits if left_by[one.used] <= left_by[one.used_but_mass]]
    left = [rms(weight * left_unseen(replace(rows, X=rows.X[:, one.used]))) for one in fits]
    best = next(x for x, one in zip(fits, left, strict=True) if predicts_as_much(one, min(left)))
    levels, logged = np.isin(best.used, LEVEL_COLUMNS), best.at_logged_speeds(rows)
    alone = ~np.any(levels)  # friction of speed for all of it: its levels stand for anything
    beside = np.zeros(len(best.used))
    for fuller in (one.at_logged_speeds(rows) for one in sets if set(one.used) > set(best.used)):
        at = [fuller.used.index(column) for column in best.used]
        theta, square = fuller.theta[at], np.diag(fuller.covariance)[at]
        separate = NORMAL_95 * np.sqrt(square) <= HALF * np.abs(theta)
        off = np.maximum(theta, 0.0) - logged.theta  # no level is below 0
        wider = off**2 + np.maximum(square - np.diag(logged.covariance), 0.0)
        beside = np.where(separate | alone, np.maximum(beside, wider), beside)
    friction = np.isin(best.used, best.used_but_mass)
    covariance = best.covariance + np.diag(np.where(levels | (alone & friction), beside, 0.0))
    return replace(best, covariance=covariance, share=sets[-1].share)


def as_they_err(data: Sequence[Rows]) -> list[Rows]:
    """The rows of each log with the deviations by which their equation errs, `with_model_error`;
    where it explains nearly all of the force, the rest are outliers, as of `robust`."""
    rows = with_model_error(stacked(data))
    if rms(rows.b - rows.X @ solve_rows(rows).theta) <= OF_ACCOUNT * rms(rows.b):
        rows = robust(rows)
    each = np.split(rows.sd, np.cumsum([len(part.b) for part in data])[:-1])
    return [replace(part, sd=sd) for part, sd in zip(data, each, strict=True)]


def _may_be(fit: ForceFit) -> bool:
    """Whether a body can have these parameters, and each term of speed stands out of its deviation;
    a constant force alone may be confounded with F_c. A slope that may as well be none would leave
    the Coulomb level beside it open."""
    found, sd = dict(zip((FIVE[i] for i in fit.used), fit.theta, strict=True)), fit.sd
    shown = [(level, v) for level, v in (("F_cp", "F_vp"), ("F_cn", "F_vn")) if v in found]
    known = all(
        abs(found[v]) > NORMAL_95 * sd[v] and found.get(level, 0.0) >= 0.0 for level, v in shown
    )
    return known and not found.get("m", 1.0) < 0.0


def _rubs(whole: ForceFit, force: Array) -> bool:
    """Whether no Coulomb level is significantly below 0 in the fit of all columns, by more than the
    equation errs of the force (r,)."""
    found, sd = dict(zip((FIVE[i] for i in whole.used), whole.theta, strict=True)), whole.sd
    errs = OF_EQUATION * rms(force)
    return all(
        found[level] >= -float(np.hypot(NORMAL_95 * sd[level], errs))
        for level in ("F_cp", "F_cn")
        if level in found
    )


def of_one_speed(steady: Rows, column: int, apart: float = TWICE) -> bool:
    """Whether the speeds of nearly all rows of steady sliding are less than so many times apart, by
    a column of speed."""
    speed = np.abs(steady.X[steady.X[:, column] != 0.0, column])
    if not len(speed):
        return False
    low, high = np.quantile(speed, (OF_ACCOUNT, NEARLY_ALL))
    return bool(high < apart * low)


def predicts_as_much(left: float, least: float) -> bool:
    """Whether fewer columns, which leave this of a force that they have not seen, will do."""
    return left <= WORSE * least


def fitted(data: Sequence[Rows], used: tuple[int, ...], late: Lateness | None = None) -> ForceFit:
    """Weighted least squares of these columns, beside the instant of the force where it is unsure.

    Sources: Aitken, Proc. R. Soc. Edinburgh 55 (1936) 42; independent samples among correlated
    ones, Bayley, Hammersley, J. R. Stat. Soc. Suppl. 8 (1946) 184.
    """
    noise = np.concatenate([part.sd for part in data])
    columns = np.concatenate([part.X for part in data])[:, used]
    force = np.concatenate([part.b for part in data])
    weight = np.median(noise) / noise
    chosen = columns * weight[:, np.newaxis]
    theta = least_squares(chosen, weight * force)
    residual = force - columns @ theta
    parts = tuple(np.split(residual, np.cumsum([len(part.b) for part in data])[:-1]))
    independent = effective_samples([part for part in parts if len(part) > 8])
    square = float(np.mean((weight * residual) ** 2))
    variance = square * len(residual) / max(independent - len(used), 1.0)
    if late is not None:
        chosen = late.beside(chosen, weight, variance)
        theta = least_squares(chosen, np.append(weight * force, 0.0))[: len(used)]
        residual = force - columns @ theta
    inertia = abs(float(theta[0])) * float(np.std(columns[:, 0])) / max(np.std(force), 1e-300)
    return ForceFit(
        used=used,
        theta=theta,
        covariance=inverse_of_gram(chosen)[: len(used), : len(used)] * variance
        + np.diag((OF_EQUATION * theta) ** 2),
        residuals=parts,
        rms=rms(residual),
        relative=float(np.linalg.norm(residual) / max(float(np.linalg.norm(force)), 1e-300)),
        share=float(inertia),
    )
