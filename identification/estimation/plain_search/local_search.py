"""Local refinement: damped Gauss-Newton on finite differences, then importance sampling.

The distance is piecewise smooth: it breaks wherever a parameter decides whether the body stops.
Differences are therefore taken over about a third of a standard deviation, and what counts in the
end is a cloud of parameter sets weighted by their likelihood, which also gives the covariance.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from identification.arrays import Array, IntArray
from identification.estimation.plain_search.cost import cost_of_lanes
from identification.estimation.plain_search.fitted_runs import FittedRun, total_cost
from identification.simulation.karnopp_lanes import WIDTH
from identification.simulation.karnopp_step import DV_N, DV_P, F_CN, F_CP, F_SN, F_SP, K1, K2, M

TRIALS = WIDTH - 1
FREEDOM = 8.0  # degrees of freedom of the sampling t-distribution
NEWTON_STEPS, LEAST_COST_GAIN = 30, 1e-3  # of a refinement at most; fall of the cost that ends it
CLOUD = 256
REFINE_ROUNDS = 40
MANY_RUNS = 16  # runs from which their own unknowns are eliminated one by one
EFFECTIVE_SHARE = 0.2  # effective share of a cloud that ends the sampling
STEP_WIDTHS = (0.01, 0.1, 1.0, 10.0)  # widths of the last differences, in the usual one


@dataclass(frozen=True)
class Optimum:
    """Parameters (11,), starts (runs, 3) and their cost; covariance (d, d), the inverse of J'J: of
    the `free` shared parameters, then of each run's start."""

    p: Array
    starts: Array
    cost: float
    free: IntArray
    evaluations: int
    covariance: Array

    def runs(self, runs: Sequence[FittedRun]) -> list[FittedRun]:
        """The runs with their refined starts."""
        return [replace(run, start=s) for run, s in zip(runs, self.starts, strict=True)]


@dataclass(frozen=True)
class _Form:
    cost: float
    gradient: Array
    hessian: Array


def refine(
    runs: Sequence[FittedRun],
    p: Array,
    free: IntArray,
    *,
    cap: float = 0.0,
) -> Optimum:
    """Nearest minimum of the cost from `p` (11,).

    free: indices of the shared parameters that may move; cap: bound of one sample's squared
    residual (0: none). A weak prior (one scale) holds what the logs do not identify near its start.
    Sources: Levenberg (1944), Marquardt (1963); differences of least slope are ours.
    """
    starts = np.array([run.start for run in runs])
    scale = _scales(runs, p, free)
    center = pack(runs, p, starts, free)
    prior = 1e-6 * np.ones(len(scale))
    theta, damping, spent = center, 1e-3, 0
    own = [len(run.open) for run in runs]
    delta = np.full(len(scale), 1e-5)
    form = _quadratic(runs, p, starts, theta, free, scale, delta, cap)
    for _ in range(NEWTON_STEPS):
        trials = _steps(form, theta, center, scale, prior, damping, len(free), own)
        keep_near(trials, free, p)
        sets, begun = unpack(runs, p, starts, free, trials)
        costs = total_cost(runs, sets, cap, begun)
        spent += len(trials) + WIDTH
        costs = np.where(np.isfinite(costs), costs, np.inf)
        best = int(np.argmin(costs))
        gain = form.cost - costs[best]
        if not gain > 0.0:
            break
        damping = float(np.clip(1e-3 * 10.0 ** (best // 2 - 3) if best else 1e-6, 1e-9, 1e3))
        theta = trials[best]
        delta = _spans(form.hessian, delta)
        form = _quadratic(runs, p, starts, theta, free, scale, delta, cap)
        if gain < LEAST_COST_GAIN:
            break
    form = _gentlest(runs, p, starts, theta, free, scale, _spans(form.hessian, delta), cap)
    sets, begun = unpack(runs, p, starts, free, theta[None])
    inverse = np.linalg.pinv(form.hessian + np.diag(prior), rcond=1e-14, hermitian=True)
    return Optimum(
        p=sets[0],
        starts=begun[:, 0],
        cost=form.cost,
        free=free,
        evaluations=spent + len(STEP_WIDTHS) * WIDTH,
        covariance=inverse * np.outer(scale, scale),
    )


@dataclass(frozen=True)
class Cloud:
    """Weighted parameter sets: unknowns (k, d), weights (k,) that sum to 1; `converged`: whether
    their effective number was large enough."""

    members: Array
    weights: Array
    converged: bool
    evaluations: int


def sample(runs: Sequence[FittedRun], optimum: Optimum, rng: np.random.Generator) -> Cloud:
    """Parameter sets around the optimum, weighted by their likelihood.

    Adaptive importance sampling: a cloud drawn from a t-distribution is weighted by the likelihood
    and shapes the next, until a fifth of a cloud counts, or after REFINE_ROUNDS of them. Sources:
    Cappé, Guillin, Marin, Robert, J. Comput. Graph. Stat. 13 (2004) 907; number of sets that count,
    Kish, Survey Sampling (1965).
    """
    theta = pack(runs, optimum.p, optimum.starts, optimum.free)
    covariance = optimum.covariance
    spent = 0
    for _ in range(REFINE_ROUNDS):
        spent += CLOUD
        cloud, density = _draw(theta, covariance, rng)
        keep_near(cloud, optimum.free, optimum.p)
        sets, begun = unpack(runs, optimum.p, optimum.starts, optimum.free, cloud)
        costs = total_cost(runs, sets, 0.0, begun)
        costs = np.where(np.isfinite(costs), costs, np.inf)
        weight = _weights(costs, density, 1.0)
        effective = 1.0 / float(np.sum(weight**2))
        if effective > EFFECTIVE_SHARE * CLOUD:
            break
        softened = _tempered(costs, density, CLOUD / 6.0)
        theta = softened @ cloud
        off = cloud - theta
        covariance = 0.8 * (softened[:, None] * off).T @ off + 0.2 * covariance
    return Cloud(cloud, weight, effective > EFFECTIVE_SHARE * CLOUD, spent)


def moved_optimum(
    runs: Sequence[FittedRun], optimum: Optimum, theta: Array, covariance: Array
) -> Optimum:
    """The optimum with its unknowns at `theta` (d,) and this covariance (d, d)."""
    sets, begun = unpack(runs, optimum.p, optimum.starts, optimum.free, theta[None])
    cost = float(total_cost(runs, sets, 0.0, begun)[0])
    return replace(optimum, p=sets[0], starts=begun[:, 0], cost=cost, covariance=covariance)


def _draw(center: Array, covariance: Array, rng: np.random.Generator) -> tuple[Array, Array]:
    """A cloud (CLOUD, d) of a t-distribution and its log density up to a constant, (CLOUD,)."""
    d = len(center)
    values, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T))
    root = vectors * np.sqrt(np.maximum(values, 1e-30 * values.max()))
    normal = rng.standard_normal((CLOUD, d))
    stretch = np.sqrt(FREEDOM / rng.chisquare(FREEDOM, CLOUD))
    normal *= stretch[:, None]
    squared = np.sum(normal**2, axis=1)
    return center + normal @ root.T, -0.5 * (FREEDOM + d) * np.log1p(squared / FREEDOM)


def _weights(costs: Array, density: Array, power: float) -> Array:
    """Weights (k,) of likelihood over sampling density, raised to a power."""
    exponent = power * (-0.5 * (costs - costs.min()) - density)
    weight = np.exp(np.clip(exponent - exponent.max(), -700.0, 0.0))
    return np.asarray(weight / weight.sum())


def _tempered(costs: Array, density: Array, wanted: float) -> Array:
    """Weights raised to the power at which `wanted` members count."""
    low, high = 0.0, 1.0
    for _ in range(40):
        power = 0.5 * (low + high)
        if 1.0 / float(np.sum(_weights(costs, density, power) ** 2)) > wanted:
            low = power
        else:
            high = power
    return _weights(costs, density, low)


def _scales(runs: Sequence[FittedRun], p: Array, free: IntArray) -> Array:
    """Units in which the unknowns are of order one."""
    shared = np.maximum(np.abs(p[free]), 1e-9)
    forces = np.isin(free, [1, 2, 7, 8])
    if forces.any():
        shared[forces] = np.maximum(shared[forces], 0.1 * shared[forces].max())
    own = []
    for run in runs:
        sigma, h = 1.0 / run.measured.weight_y, run.measured.h
        own.append(np.array([100 * sigma, 10 * sigma / h, 1.0])[list(run.open)])
    return np.concatenate([shared, *own])


def pack(runs: Sequence[FittedRun], p: Array, starts: Array, free: IntArray) -> Array:
    """Unknowns (d,): the free shared parameters, then each run's open start entries."""
    own = [starts[index, list(run.open)] for index, run in enumerate(runs)]
    return np.concatenate([p[free], *own])


def unpack(
    runs: Sequence[FittedRun], p: Array, starts: Array, free: IntArray, theta: Array
) -> tuple[Array, Array]:
    """Parameter sets (k, 11) and starts (runs, k, 3) of unknowns (k, d)."""
    sets = np.tile(p, (len(theta), 1))
    sets[:, free] = theta[:, : len(free)]
    begun = np.repeat(starts[:, None, :], len(theta), axis=1)
    low = len(free)
    for index, run in enumerate(runs):
        begun[index][:, list(run.open)] = theta[:, low : low + len(run.open)]
        low += len(run.open)
    return sets, begun


def keep_near(theta: Array, free: IntArray, row: Array) -> None:
    """Move unknowns (k, d) to the model's signs and within reach of `row` (11,), in place.

    A step to a vanishing mass or band would be as costly to simulate as it is beside the point.
    """
    reach = 5.0 * np.abs(row[free]) + 5.0 * np.max(np.abs(row[[F_CP, F_CN, F_SP, F_SN]]))
    for column, index in enumerate(free):
        sign = -1.0 if index in (DV_N, F_SN) else 1.0
        size = abs(row[index])
        low = 0.2 * size if index in (M, DV_P, DV_N) else 0.0
        high = 5.0 * size if index in (M, DV_P, DV_N, K1, K2) else reach[column]
        theta[:, column] = sign * np.clip(sign * theta[:, column], low, high)


def _quadratic(
    runs: Sequence[FittedRun],
    p: Array,
    starts: Array,
    theta: Array,
    free: IntArray,
    scale: Array,
    delta: Array,
    cap: float,
) -> _Form:
    """Cost at `theta` and its Gauss-Newton form in units of `scale`."""
    k = len(free)
    d = len(theta)
    gradient, hessian, cost = np.zeros(d), np.zeros((d, d)), 0.0
    runs[0].halt.ask()
    low = k
    for index, run in enumerate(runs):
        used = np.concatenate([np.arange(k), np.arange(low, low + len(run.open))])
        low += len(run.open)
        lanes = np.tile(theta, (WIDTH, 1))
        for lane, column in enumerate(used):
            lanes[lane + 1, column] += delta[column] * scale[column]
        sets, begun = unpack(runs, p, starts, free, lanes)
        begin = np.ascontiguousarray(begun[index])
        gram = cost_of_lanes(sets, begin, run.measured, run.windows, cap, 1)[1][0]
        inner = slice(1, len(used) + 1)
        cost += float(gram[0, 0]) if np.isfinite(gram[0, 0]) else np.inf
        gram = np.nan_to_num(gram, nan=0.0, posinf=0.0, neginf=0.0)
        gradient[used] += gram[inner, 0] / delta[used]
        hessian[np.ix_(used, used)] += gram[inner, inner] / np.outer(delta[used], delta[used])
    return _Form(cost, gradient, hessian)


def _gentlest(
    runs: Sequence[FittedRun],
    p: Array,
    starts: Array,
    theta: Array,
    free: IntArray,
    scale: Array,
    delta: Array,
    cap: float,
) -> _Form:
    """The form with each difference at the width of least slope.

    Where a wider step makes the body stop elsewhere the residual jumps, and a slope taken across
    the jump would feign knowledge.
    """
    slopes = []
    for factor in STEP_WIDTHS:
        form = _quadratic(runs, p, starts, theta, free, scale, factor * delta, cap)
        slopes.append(np.diag(form.hessian))
    choice = np.argmin(np.where(np.array(slopes) > 0, slopes, np.inf), axis=0)
    widths = np.array(STEP_WIDTHS)[choice] * delta
    return _quadratic(runs, p, starts, theta, free, scale, widths, cap)


def _spans(hessian: Array, delta: Array) -> Array:
    """Differences over a third of a conditional standard deviation."""
    curvature = np.diag(hessian)
    span = 0.3 / np.sqrt(np.maximum(curvature, 1e-30))
    return np.where(curvature > 0, np.clip(span, 1e-9, 1e-3), delta)


def _steps(
    form: _Form,
    theta: Array,
    center: Array,
    scale: Array,
    prior: Array,
    damping: float,
    shared: int,
    own: Sequence[int],
) -> Array:
    """Trial points (TRIALS, d) for dampings around the last that served."""
    pull = form.gradient + prior * (theta - center) / scale
    diagonal = np.diag(form.hessian) + 1e-12 * np.max(np.diag(form.hessian))
    trials = np.empty((TRIALS, len(theta)))
    for i in range(TRIALS):
        weight = damping * 10.0 ** (i - 3) if i else 0.0
        matrix = form.hessian + np.diag(weight * diagonal + prior)
        try:
            step = _solved(matrix, pull, shared, own)
        except np.linalg.LinAlgError:
            step = np.linalg.pinv(matrix) @ pull
        trials[i] = theta - step * scale
    return trials


def _solved(matrix: Array, pull: Array, shared: int, own: Sequence[int]) -> Array:
    """Solution of matrix @ step = pull, the runs' own unknowns eliminated where they are many.

    own: number of each run's unknowns, which meet those of other runs in zeros only.
    """
    if len(own) < MANY_RUNS:
        return np.asarray(np.linalg.solve(matrix, pull), dtype=np.float64)
    reduced, right = matrix[:shared, :shared].copy(), pull[:shared].copy()
    bounds = shared + np.concatenate([[0], np.cumsum(own)])
    solved = []
    for low, high in pairwise(bounds):
        beside = matrix[low:high, :shared]
        both = np.linalg.solve(
            matrix[low:high, low:high], np.column_stack([beside, pull[low:high]])
        )
        reduced -= beside.T @ both[:, :-1]
        right -= beside.T @ both[:, -1]
        solved.append(both)
    step = np.linalg.solve(reduced, right)
    out: Array = np.concatenate([step, *(both[:, -1] - both[:, :-1] @ step for both in solved)])
    return out
