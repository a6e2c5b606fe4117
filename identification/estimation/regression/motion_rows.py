"""The equation of motion over windows of sliding whose width the logs themselves choose.

    mean F = m second y + F_cp share up - F_cn share down + F_vp mean v+ + F_vn mean v-   (N)

in weak form (`signals/weak_form`). Wide windows average noise away, narrow ones keep up with quick
motion: taken is the narrowest that leaves hardly more of the force than the best one does, and in
which the position's noise costs the mass next to nothing. A window may hold reversals, since its
columns hold how long the body went each way.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.arrays import Array, BoolArray
from identification.estimation.regression.equation_rows import (
    FIVE,
    NOTHING_KNOWN,
    MotionLog,
    blocks_of,
    sliding_sd,
)
from identification.estimation.regression.motion_log import SURE_OF_DIRECTION
from identification.estimation.regression.weighted_rows import (
    OF_EQUATION,
    Rows,
    solve_rows,
    stacked,
)
from identification.model.karnopp import Karnopp
from identification.signals.weak_form import WeakWindows, all_windows, noise_gain, weights
from identification.thresholds import ADEQUATE, HALF

HALF_WIDTHS = (5, 8, 16, 32, 64)  # samples, half of a window
FINEST_WINDOW = 4  # samples, of the window that shows direction and speed
FINER_WINDOW = 4  # times narrower than the rows' windows it is
SHORTEST_LOGS = 20  # half-widths, that the shortest log is long at least
NEARLY_LEAST, AS_WELL_LEFT = (
    1.1,
    0.005,
)  # times the least share left, or more than it, that a window may leave
SLOWEST_SLIDING = 0.02  # of the quick speeds, below which a body may as well be at rest
FAST_SPEEDS = 0.95  # quantile of speed
WITHIN_BAND = 1e-3  # share of a window, in which it may be within the band of a plant
UNSURE_IN_WINDOW = 0.02  # share of a window in which the body may be at rest
FEWEST_IN_MOTION = 30
NOISE_ROUNDS = 2  # in which the rows' noise, which depends on mass and damping, converges


@dataclass(frozen=True, eq=False)
class MotionRows:
    """The equation's rows of one log, the windows that they are of, and the speed, (n,)."""

    rows: Rows
    windows: WeakWindows
    v: Array

    @property
    def up(self) -> BoolArray:
        """Rows (r,) in which the body moves up for most of the window."""
        return np.asarray(self.rows.X[:, 1] > HALF)

    def at(self, kept: BoolArray) -> "MotionRows":
        """The rows of a mask (r,), with their windows."""
        return replace(self, rows=self.rows.at(kept), windows=self.windows.at(np.flatnonzero(kept)))

    def outside(self, p: Karnopp) -> BoolArray:
        """Rows (r,) in which the body is faster than the band of a plant, which says something else
        of friction within it."""
        within = (self.v < p.dv_p) & (self.v > p.dv_n)
        return np.asarray(self.windows.mean @ (1.0 * within) < WITHIN_BAND)


def rows_and_windows(
    logs: Sequence[MotionLog], theta: Array, *, gravity: bool = False
) -> list[MotionRows]:
    """The equation's rows of each log, in the windows that suit all of them best.

    theta: a first estimate of m, F_cp, F_cn, F_vp, F_vn, for the rows' noise. None of them where
    too little slides. Sources: weak form, Messenger, Bortz (2021); what a width costs the mass,
    Fuller (1987), 1.1.1; the choice is ours.
    """
    shortest = min(len(one.log) for one in logs)
    tried = [
        [rows_of_width(one, half, theta, gravity=gravity) for one in logs]
        for half in HALF_WIDTHS
        if SHORTEST_LOGS * half < shortest or half == HALF_WIDTHS[0]
    ]
    found = [made for made in tried if are_enough(made)]
    if not found:
        return tried[0]
    fits = [_WidthFit.of(made, logs) for made in found]
    fits = [one for one in fits if one.bent < OF_EQUATION] or fits
    least = min(one.share for one in fits)
    enough = max(NEARLY_LEAST * least, least + AS_WELL_LEFT)
    return next(one.made for one in fits if one.share <= enough)


def are_enough(made: Sequence[MotionRows]) -> bool:
    """Whether the rows of all logs are enough to fit the equation."""
    return sum(len(one.rows.b) for one in made) >= FEWEST_IN_MOTION


def converged_rows(logs: Sequence[MotionLog], *, gravity: bool = False) -> list[MotionRows]:
    """The same, their noise that of the mass and damping that they show themselves.

    Source: iterated weighted least squares (Aitken 1936).
    """
    theta = NOTHING_KNOWN
    for _ in range(NOISE_ROUNDS):
        made = rows_and_windows(logs, theta, gravity=gravity)
        rows = stacked([one.rows for one in made])
        if not len(rows.b):
            return made
        theta = solve_rows(rows).theta[: len(FIVE)]
    return rows_and_windows(logs, theta, gravity=gravity)


def without_reversals(made: Sequence[MotionRows]) -> list[MotionRows]:
    """The rows but for windows that hold reversals, where others are most and leave clearly less:
    the body comes through rest there, held by more than the friction of sliding that the equation
    has. Ours."""
    one_way = [np.minimum(one.rows.X[:, 1], -one.rows.X[:, 2]) <= 0.0 for one in made]
    every, kept = stacked([one.rows for one in made]), np.concatenate(one_way)
    if np.count_nonzero(kept) <= max(HALF * len(kept), FEWEST_IN_MOTION) or np.all(kept):
        return list(made)
    theta = solve_rows(every.at(kept)).theta
    square = ((every.b - every.X @ theta) / every.sd) ** 2
    if np.mean(square[~kept]) <= ADEQUATE * np.mean(square[kept]):
        return list(made)
    return [one.at(keep) for one, keep in zip(made, one_way, strict=True)]


def rows_of_width(one: MotionLog, half: int, theta: Array, *, gravity: bool = False) -> MotionRows:
    """The rows of one log in windows of twice `half` samples; speed (r,): the mean in each.

    gravity: with the sine and cosine of the angle as columns beside.

    Source: weak form, Messenger, Bortz, J. Comput. Phys. 443 (2021) 110525; `README.md`, (3).
    """
    n, h, y = len(one.log), one.log.h, np.asarray(one.log["y"])
    length = min(2 * half, n - 1)
    every = all_windows(n, length, h)
    first = weights(length, h)[1]
    fine = weights(max(FINEST_WINDOW, 2 * (half // FINER_WINDOW)), h)[1]
    padded = np.pad(y, len(fine) // 2, mode="reflect", reflect_type="odd")
    v = np.correlate(padded, fine, "valid")[:n]
    sure = SURE_OF_DIRECTION * one.noise.y * float(np.sqrt(noise_gain(first)))
    sure = max(sure, SLOWEST_SLIDING * usual_fastest(np.abs(v)))
    over, unsure = every.first @ y, every.mean @ (1.0 * (np.abs(v) < sure))
    w = every.at(np.flatnonzero((np.abs(over) > sure) & (unsure < UNSURE_IN_WINDOW)))
    over, up, down = w.first @ y, v > 0.0, v < 0.0
    ways = np.column_stack([w.mean @ (1.0 * way) for way in (up, down)])
    speeds = np.column_stack([w.mean @ (v * way) for way in (up, down)])
    # The smoothed velocity parts the ways; how far a window moves is its own, which no smoothing
    # bends: what that leaves out goes with jerk, as a lag of the force does.
    off = (over - np.sum(speeds, axis=1)) / np.sum(ways, axis=1)
    speeds += off[:, np.newaxis] * ways
    X = np.column_stack([w.second @ y, ways * (1.0, -1.0), speeds])
    names: tuple[str, ...] = FIVE
    if gravity:
        X = np.column_stack([X, w.mean @ np.sin(y), w.mean @ np.cos(y)])
        names = (*FIVE, "a", "b")
    b = (w.zoh if one.zoh else w.mean) @ np.asarray(one.log["F"])
    sd = sliding_sd(one, w, over > 0.0, theta)
    return MotionRows(Rows(b, X, sd, blocks_of(w, n), np.abs(over), names), w, v)


def usual_fastest(speed: Array) -> float:
    """The fast one of speeds (n,), of which the largest may be noise. Ours."""
    return float(np.quantile(speed, FAST_SPEEDS))


@dataclass(frozen=True, eq=False)
class _WidthFit:
    """Least squares of rows of one width: the share of the force that they leave, and the share by
    which they err since the position's noise is in the accelerations, too: they lose as much of the
    mass as of these is noise.

    Source: attenuation by errors in a regressor, Fuller, Measurement Error Models (1987), 1.1.1.
    """

    made: list[MotionRows]
    share: float
    bent: float

    @classmethod
    def of(cls, made: list[MotionRows], logs: Sequence[MotionLog]) -> "_WidthFit":
        """The fit of the rows of each log."""
        every = stacked([one.rows for one in made])
        plain = solve_rows(every)
        force = max(float(np.linalg.norm(every.b)), 1e-300)
        square = max(float(np.sum(every.X[:, 0] ** 2)), 1e-300)
        noise = sum(
            len(one.rows.b) * log.noise.y**2 * noise_gain(weights(one.windows.length, log.log.h)[2])
            for one, log in zip(made, logs, strict=True)
        )
        inertia = abs(float(plain.theta[0])) * square**0.5 / force
        left = float(np.linalg.norm(plain.residual * every.sd))
        return cls(made, left / force, inertia * noise / square)
