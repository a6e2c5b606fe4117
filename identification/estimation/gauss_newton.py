"""The nearest minimum of a square sum by differences, and its covariance.

Levenberg, Q. Appl. Math. 2 (1944) 164; Marquardt, SIAM J. 11 (1963) 431.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from identification.arrays import Array, IntArray
from identification.progress import Halted
from identification.thresholds import ADEQUATE

WIDE_STEP = 1e-4  # of a parameter, by which the Jacobian is taken far from the minimum: it smooths
# Near it: the scale common to masses and forces shows in a small difference of large columns.
FINE_STEP = 1e-7
ROUGH_STEP = 1e-5  # with which a descent begins
TRIED_IN_TURN = tuple((10.0**i,) for i in range(6))  # factors on the damping in one step
# Of a descent over what is rough: those tried at once, steps at most, fall of the cost that ends it
TRIED_AT_ONCE = ((0.0, *(10.0 ** (i - 3) for i in range(1, 15))),)
DESCENT_STEPS, LEAST_FALL = 30, 0.05
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

    def covariance(
        self, cluster: IntArray | None = None, noise: Array | None = None,
        alike: IntArray | None = None,
    ) -> Array:  # fmt: skip
        """Of x, (k, k): the sandwich (J'J)^-1 S (J'J)^-1, S the covariance of the scores J'r.

        Of residuals that are white noise of this mean square S is mean J'J; where, of the first n,
        those of one number in alike (n,) are one value, mean A'A, their rows of J summed in A.
        cluster (n,): stretches of the first n residuals within which they are correlated; the
        stretches are independent, and the scatter of their scores gives S (Liang, Zeger, Biometrika
        73 (1986) 13). noise (draws, n): draws of the first n residuals' noise, whose scores do
        (Huber, Robust Statistics (1981)).
        """
        J = smooth_jacobian(self.fun, self.x)
        inverse = np.asarray(np.linalg.pinv(J.T @ J), dtype=np.float64)
        if noise is not None:
            moved = noise @ J[: noise.shape[1]] @ inverse
            return np.asarray(moved.T @ moved / len(noise), dtype=np.float64)
        if cluster is None:
            if alike is not None:
                J = np.vstack([_sums(J[: len(alike)], alike), J[len(alike) :]])
            return np.asarray(self.mean * (J @ inverse).T @ (J @ inverse))
        pull = J[: len(cluster)] * self.fun(self.x)[: len(cluster), np.newaxis]
        moved = _sums(pull, cluster) @ inverse
        count = len(moved)
        spare = count / max(count - len(self.x), 1)
        wider = spare * moved.T @ moved
        # With few stretches for many unknowns the sums all but vanish at the minimum.
        if count <= 2 * len(self.x):
            wider = spare**2 * (wider + inverse * self.mean)
        return np.asarray(wider, dtype=np.float64)


def _sums(rows: Array, of: IntArray) -> Array:
    """Sums (groups, k) of the rows (n, k) of each group, whose number is in `of` (n,)."""
    return np.column_stack([np.bincount(of, column) for column in rows.T])


def gauss_newton(
    fun: Callable[[Array], Array], x: Array, steps: int = DESCENT_STEPS,
    step_by: float = WIDE_STEP, reach: Array | float = np.inf, little: float = 0.0, *,
    rough: bool = False,
) -> Minimum:  # fmt: skip
    """Minimum of the square sum of `fun` near x, within this reach of it (k,).

    Damping of Levenberg (1944) and Marquardt (1963), differences by `step_by` for the Jacobian, at
    most so many steps; little: share of the cost below which a step is the last in any case.
    Halted, it gives the x reached.

    rough: down to where no damping leads further, of errors that are noise at the minimum, but with
    a step wherever a stop comes or goes. Of many dampings tried at once the best crosses what is
    coarse, and differences over a third of a conditional deviation pass what is finer; ours.
    """
    bounds = x - reach, x + reach
    r = fun(x)
    cost, damping, span = float(r @ r), 1e-3, np.full(len(x), step_by)
    for _ in range(steps):
        try:
            J = jacobian(fun, x, r, span)
            found = _lower(fun, x, r, J, damping, bounds, TRIED_AT_ONCE if rough else TRIED_IN_TURN)
        except Halted:
            break
        if found is None:
            break
        x, r, power = found
        gained, cost = cost - float(r @ r), float(r @ r)
        if rough:
            damping = float(np.clip(damping * max(power, 1e-3), 1e-9, 1e3))
            size = np.sum(J**2, axis=0)
            by = np.clip(SPAN / np.sqrt(np.maximum(size, 1e-30)), NARROWEST_SPAN, WIDEST_SPAN)
            span = np.where(size > 0.0, by, span)
            if gained < max(LEAST_FALL, little * cost):
                break
            continue
        damping *= 0.1 * power
        # What is left of much more than noise need not be known to its last digits.
        ends = LAST_STEP if cost < ADEQUATE * len(r) else LITTLE
        if gained < max(ends, little) * cost:
            break
    return Minimum(fun, x, cost / len(r))


def _lower(
    fun: Callable[[Array], Array], x: Array, r: Array, J: Array, damping: float,
    bounds: tuple[Array, Array], powers: Sequence[Sequence[float]],
) -> tuple[Array, Array, float] | None:  # fmt: skip
    """An x at which the square sum is less than at this one, `fun` there, and by what the damping
    was multiplied for it; None without one.

    r, J: `fun` and its derivatives at x; powers: factors on the damping, those together tried at
    once, one such set after the other.
    """
    A, g = J.T @ J, J.T @ r
    if not (np.all(np.isfinite(A)) and np.all(np.isfinite(g))):
        return None  # beyond what can be computed with: no direction is known
    size = np.maximum(np.diag(A), 1e-12 * float(np.max(np.diag(A))) + 1e-300)
    for together in powers:
        damped = (A + np.diag(damping * power * size) for power in together)
        steps = [np.linalg.lstsq(one, -g, rcond=1e-14)[0] for one in damped]
        tried = [x + (np.clip(x + step, *bounds) - x) for step in steps]
        after = _each(fun, tried)
        costs = [float(one @ one) for one in after]
        best = int(np.argmin(costs))
        if costs[best] < float(r @ r):
            return tried[best], after[best], together[best]
    return None


def jacobian(fun: Callable[[Array], Array], x: Array, r: Array, step: Array | float) -> Array:
    """Derivatives of `fun` (n, k) by forward differences from its value r (n,) at x (k,)."""
    steps = np.broadcast_to(step, x.shape)
    after = _each(fun, list(x + np.diag(steps)))
    return np.column_stack([(one - r) / by for one, by in zip(after, steps, strict=True)])


def _each(fun: Callable[[Array], Array], every: Sequence[Array]) -> list[Array]:
    """`fun` at each x, on two cores."""
    if len(every) == 1:
        return [fun(every[0])]
    with ThreadPoolExecutor(2) as pool:
        return list(pool.map(fun, every))


def smooth_jacobian(fun: Callable[[Array], Array], x: Array) -> Array:
    """Derivatives of `fun` (n, k) at x where it is smooth.

    A run that loses a stop within the step jumps: over the step that would be a derivative beyond
    all others, and a parameter more exact than it is. It does so to one side; the run is smooth
    on the other. Ours.
    """
    here = fun(x)
    down, up = (jacobian(fun, x, here, step) for step in (-FINE_STEP, FINE_STEP))
    alike = np.abs(up - down) <= ALIKE * np.maximum(np.abs(up), np.abs(down))
    least = np.where(np.abs(up) <= np.abs(down), up, down)
    return np.where(alike, 0.5 * (up + down), least)
