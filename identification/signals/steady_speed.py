"""The steady speed to which a body settles under a constant force, and how long it takes to.

    y(t) = a + v t + b exp(-t/tau),   from where it goes the way that it settles to             (1)

which a body with Coulomb and viscous friction does, tau = m/F_v. As a regression of the position it
has no errors but those of what is measured: the steady speed of a long stretch errs next to not at
all, where a smoothed velocity and acceleration are noisy regressors.
"""

from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from identification.arrays import Array
from identification.thresholds import BEYOND_CHANCE, MANY_OF_A_KIND, OF_ACCOUNT

TIMES_TRIED = 60  # times that tau is tried at, evenly in its logarithm
PARTS_OF_LOG = 4  # of the log, by which its speed is seen to be steady


class SteadySpeed(NamedTuple):
    """Speed v [m/s] and time constant tau [s] of (1), with their deviations, and what (1) leaves of
    the position [m], root mean square."""

    v: float
    v_sd: float
    tau: float
    tau_sd: float
    left: float


def steady_speed(t: Array, y: Array, noise: float) -> SteadySpeed | None:
    """What (1) finds in a log of a constant force; None where the body has not settled.

    t [s], y [m]: (n,); noise: of y, one sigma. Settled: the speed changes by a tenth at most from
    the end of the log on. The amplitude b is free, so that the force may come late. Source:
    variable projection, Golub, Pereyra, SIAM J. Numer. Anal. 10 (1973) 413.
    """
    way = float(np.sign(y[-1] - y[len(y) // 2]))
    behind = np.flatnonzero(way * y < np.min(way * y) + BEYOND_CHANCE * noise)
    t, y = t[behind[-1] :] - t[behind[-1]], y[behind[-1] :]
    if way == 0.0 or len(y) < MANY_OF_A_KIND:
        return None

    def columns(log_tau: float) -> Array:
        """Those of a, v and b."""
        return np.column_stack([np.ones(len(t)), t, np.exp(-t / np.exp(log_tau))])

    def left(log_tau: float) -> float:
        """Sum of squares of what the best a, v and b leave."""
        X = columns(log_tau)
        return float(np.sum((y - X @ np.linalg.lstsq(X, y, rcond=None)[0]) ** 2))

    tried = np.linspace(np.log(t[1]), np.log(t[-1]), TIMES_TRIED)
    near = tried[int(np.argmin([left(one) for one in tried]))]
    step = tried[1] - tried[0]
    best = float(minimize_scalar(left, bounds=(near - step, near + step), method="bounded").x)
    X, tau = columns(best), float(np.exp(best))
    a, v, b = np.linalg.lstsq(X, y, rcond=None)[0].tolist()
    slows = float(np.exp(-t[-1] / tau)) * abs(b) / tau
    if not slows < OF_ACCOUNT * way * v:
        return None
    residual = y - X @ (a, v, b)
    variance = residual @ residual / (len(t) - 4)  # four are fitted
    J = np.column_stack([X, b * X[:, 2] * t / tau])  # the last: of the logarithm of tau
    sd = np.sqrt(variance * np.diag(np.linalg.pinv(J.T @ J)))
    v_sd = float(np.hypot(sd[1], _unsteadiness(t, residual)))
    return SteadySpeed(v, v_sd, tau, tau * float(sd[3]), float(np.std(residual)))


def _unsteadiness(t: Array, residual: Array) -> float:
    """Deviation [m/s] that a mean speed has since the speed changes from part to part of the log,
    beyond the noise of each. Source: random effects, DerSimonian, Laird, Controlled Clinical Trials
    7 (1986) 177."""
    parts = [np.array_split(x, PARTS_OF_LOG) for x in (t, residual)]
    each = [np.polyfit(x, left, 1, cov=True) for x, left in zip(*parts, strict=True)]
    between = np.var([line[0] for line, _ in each], ddof=1)
    within = np.mean([spread[0, 0] for _, spread in each])
    return float(np.sqrt(max(between - within, 0.0) / PARTS_OF_LOG))
