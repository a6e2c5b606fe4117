"""The nearest minimum of a square sum by differences, and its covariance.

Levenberg, Q. Appl. Math. 2 (1944) 164; Marquardt, SIAM J. 11 (1963) 431.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from identification.arrays import Array, IntArray
from identification.progress import Halted
from identification.thresholds import ADEQUATE

WIDE_STEP = 1e-4  # of a parameter, by which the Jacobian is taken far from the minimum: it smooths
# Near it: the scale common to masses and forces shows in a small difference of large columns.
FINE_STEP = 1e-7
DAMPING_TRIES = 6  # of the damping in one step
# Of a descent: dampings tried at once, steps at most, fall of the cost that ends it
TRIED_AT_ONCE, DESCENT_STEPS, LEAST_FALL = 15, 30, 0.05
SPAN, NARROWEST_SPAN, WIDEST_SPAN = 0.3, 1e-9, 1e-3  # of a conditional deviation, and bounds in x
ALIKE = 0.5  # of a derivative, by which those to either side may differ
LAST_STEP = 1e-5  # share of the cost below which a step is the last
LITTLE = 1e-3  # the same, where more than noise is left


@dataclass(frozen=True, eq=False)
class Minimum:
    """Minimum of the square sum of `fun` at x (k,), and its mean square over the rows of `fun`."""

    fun: Callable[[Array], Array]
    x: Array
    mean: float

    @property
    def followed(self) -> bool:
        """Whether hardly more than noise is left."""
        return self.mean < ADEQUATE

    def covariance(self, cluster: IntArray | None = None) -> Array:
        """Of x, (k, k), for residuals that are noise of this mean square.

        cluster (n,): stretches of the first n residuals within which they are correlated; the
        stretches are independent, and the scatter of their scores gives the deviation of x (cluster
        sandwich; Liang, Zeger, Biometrika 73 (1986) 13).
        """
        J = smooth_jacobian(self.fun, self.x)
        inverse = np.asarray(np.linalg.pinv(J.T @ J), dtype=np.float64)
        if cluster is None:
            return np.asarray(inverse * self.mean)
        pull = J[: len(cluster)] * self.fun(self.x)[: len(cluster), np.newaxis]
        sums = np.array([np.bincount(cluster, column) for column in pull.T])
        count = sums.shape[1]
        spare = count / max(count - len(self.x), 1)
        wider = spare * inverse @ (sums @ sums.T) @ inverse
        # With few stretches for many unknowns the sums all but vanish at the minimum.
        if count <= 2 * len(self.x):
            wider = spare**2 * (wider + inverse * self.mean)
        return np.asarray(wider, dtype=np.float64)

    def covariance_by(self, noise: Array) -> Array:
        """Of x, (k, k), where draws of the first n residuals' noise are known: noise (draws, n).

        The sandwich (J'J)^-1 J'SJ (J'J)^-1, S their covariance; Huber, Robust Statistics (1981).
        """
        J = smooth_jacobian(self.fun, self.x)
        inverse = np.linalg.pinv(J.T @ J)
        moved = noise @ J[: noise.shape[1]] @ inverse
        return np.asarray(moved.T @ moved / len(noise), dtype=np.float64)


def gauss_newton(
    fun: Callable[[Array], Array], x: Array, steps: int, step_by: float = WIDE_STEP,
    reach: Array | float = np.inf, little: float = 0.0,
) -> Minimum:  # fmt: skip
    """Minimum of the square sum of `fun` near x, within this reach of it (k,).

    Damping of Levenberg (1944) and Marquardt (1963), differences for the Jacobian, at most so many
    steps; little: share of the cost below which a step is the last in any case. Halted, it gives
    the x reached.
    """
    low, high = x - reach, x + reach
    r = fun(x)
    cost, damping = float(r @ r), 1e-3
    for _ in range(steps):
        try:
            found = _step(fun, x, r, (cost, damping, step_by), (low, high))
        except Halted:
            break
        if found is None:
            break
        x, r, gained, damping = found
        cost -= gained
        # What is left of much more than noise need not be known to its last digits.
        ends = LAST_STEP if cost < ADEQUATE * len(r) else LITTLE
        if gained < max(ends, little) * cost:
            break
    return Minimum(fun, x, cost / len(r))


def descended(fun: Callable[[Array], Array], x: Array) -> Minimum:
    """Minimum of the square sum of `fun` below x (k,), down to where no damping leads further.

    For errors that are noise at the minimum, but rough: every stop that comes or goes is a step
    in them. Differences over a third of a conditional deviation pass what is finer, and of many
    dampings tried at once the best crosses what is coarser. Halted, it gives the x reached.
    Sources: Levenberg (1944), Marquardt (1963); spans of the differences are ours.
    """
    r = fun(x)
    cost, damping, span = float(r @ r), 1e-3, np.full(len(x), 1e-5)
    powers = damping_powers()
    with ThreadPoolExecutor(2) as pool, suppress(Halted):
        for _ in range(DESCENT_STEPS):
            moved = list(pool.map(fun, x + np.diag(span)))
            J = np.column_stack([(one - r) / by for one, by in zip(moved, span, strict=True)])
            A, g = J.T @ J, J.T @ r
            if not (np.all(np.isfinite(A)) and np.all(np.isfinite(g))):
                break
            size = np.diag(A)
            tried = [x - np.linalg.lstsq(A + np.diag(damping * one * size), g, rcond=1e-14)[0]
                     for one in powers]  # fmt: skip
            after = list(pool.map(fun, tried))
            costs = [float(one @ one) for one in after]
            best = int(np.argmin(costs))
            gained = cost - costs[best]
            if not gained > 0.0:
                break
            x, r, cost = tried[best], after[best], costs[best]
            damping = float(np.clip(damping * max(powers[best], 1e-3), 1e-9, 1e3))
            by = SPAN / np.sqrt(np.maximum(size, 1e-30))
            span = np.where(size > 0.0, np.clip(by, NARROWEST_SPAN, WIDEST_SPAN), span)
            if gained < LEAST_FALL:
                break
    return Minimum(fun, x, cost / len(r))


def damping_powers() -> list[float]:
    """None, and powers of ten about the damping that served last."""
    return [0.0, *(10.0 ** (i - 3) for i in range(1, TRIED_AT_ONCE))]


def _step(
    fun: Callable[[Array], Array], x: Array, r: Array, at: tuple[float, float, float],
    bounds: tuple[Array, Array],
) -> tuple[Array, Array, float, float] | None:  # fmt: skip
    """The next x, `fun` there, by how much the cost falls, and the next damping; None without one.

    r: `fun` at x; at: cost there, damping, and the step of the differences.
    """
    cost, damping, step_by = at
    J = jacobian(fun, x, r, step_by)
    A, g = J.T @ J, J.T @ r
    if not (np.all(np.isfinite(A)) and np.all(np.isfinite(g))):
        return None  # beyond what can be computed with: no direction is known
    size = np.maximum(np.diag(A), 1e-12 * float(np.max(np.diag(A))) + 1e-300)
    for _ in range(DAMPING_TRIES):
        step = np.linalg.lstsq(A + np.diag(damping * size), -g, rcond=1e-14)[0]
        step = np.clip(x + step, *bounds) - x
        after = fun(x + step)
        gained = cost - float(after @ after)
        if gained > 0:
            return x + step, after, gained, damping * 0.1
        damping *= 10.0
    return None


def jacobian(fun: Callable[[Array], Array], x: Array, r: Array, step: float = WIDE_STEP) -> Array:
    """Derivatives of `fun` (n, k) by forward differences from its value r (n,) at x (k,)."""

    def column(i: int) -> Array:
        up = x.copy()
        up[i] += step
        return (fun(up) - r) / step

    with ThreadPoolExecutor(2) as pool:
        return np.column_stack(list(pool.map(column, range(len(x)))))


def smooth_jacobian(fun: Callable[[Array], Array], x: Array) -> Array:
    """Derivatives of `fun` (n, k) at x where it is smooth.

    A run that loses a stop within the step jumps: over the step that would be a derivative beyond
    all others, and a parameter more exact than it is. It does so to one side; the run is smooth
    on the other. Ours.
    """
    here = fun(x)
    down, up = (-jacobian(lambda at: fun(2.0 * x - at), x, here, FINE_STEP),
                jacobian(fun, x, here, FINE_STEP))  # fmt: skip
    alike = np.abs(up - down) <= ALIKE * np.maximum(np.abs(up), np.abs(down))
    least = np.where(np.abs(up) <= np.abs(down), up, down)
    return np.where(alike, 0.5 * (up + down), least)
