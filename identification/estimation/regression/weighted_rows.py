"""Weighted rows of a regression, and their least squares."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from identification.arrays import Array, BoolArray, IntArray
from identification.signals.steps import MEDIAN_OF_NOISE

OF_EQUATION = 4e-3  # of a value, by which the equation's smoothing errs where the log shows nothing
OVERLAP = 2.5  # rows that share samples are worth one in so many
BLOCKS = 8  # stretches of a log that are left out in turn
# Deviations from which a row counts for nothing: 95 % efficient of normal errors (Tukey's).
BIWEIGHT = 4.685
# What such a row counts all the same, since none is without; when the weights have converged.
LEAST_WEIGHT, NEAR_ENOUGH, MOST_ROUNDS = 1e-3, 1e-2, 50
CLOSE_VARIANCE = 1e-3  # to which a variance is found, of itself
NEVER_NEGATIVE = frozenset({"m", "F_vp", "F_vn"})  # a constant force may bring either F_c below 0


@dataclass(frozen=True, eq=False)
class Rows:
    """A regression b = X theta: b (r,), X (r, k), sd (r,) of b, block (r,) of time, speed (r,).

    lost: twice the log-likelihood that b has lost, where an effect has taken away a part of what
    was logged: without it the effect that leaves no force at all would explain every force;
    positive: names of parameters that are never below 0.
    """

    b: Array
    X: Array
    sd: Array
    block: IntArray
    speed: Array
    names: tuple[str, ...]
    lost: float = 0.0
    positive: frozenset[str] = NEVER_NEGATIVE

    def at(self, kept: BoolArray) -> "Rows":
        """The rows of a mask (r,)."""
        return replace(
            self, b=self.b[kept], X=self.X[kept], sd=self.sd[kept], block=self.block[kept],
            speed=self.speed[kept],
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Fitted:
    """Least squares of `Rows`: theta (k,), residual in units of sd (r,), cost its square sum."""

    theta: Array
    residual: Array
    cost: float


def stacked(parts: Sequence[Rows]) -> Rows:
    """Rows of several logs as one regression; their blocks stay separate."""
    block = np.concatenate([p.block + BLOCKS * i for i, p in enumerate(parts)])
    join = [np.concatenate([getattr(p, k) for p in parts]) for k in ("b", "X", "sd", "speed")]
    lost = sum(p.lost for p in parts)
    return Rows(join[0], join[1], join[2], block, join[3], parts[0].names, lost, parts[0].positive)


def solve_rows(rows: Rows, keep: BoolArray | None = None) -> Fitted:
    """Weighted least squares; `keep` (r,) masks rows out of the fit (their residual stays).

    Source: Aitken, Proc. R. Soc. Edinburgh 55 (1936) 42.
    """
    A, c = rows.X / rows.sd[:, np.newaxis], rows.b / rows.sd
    mask = np.ones(len(c), dtype=bool) if keep is None else keep
    theta = least_squares(A[mask], c[mask])
    residual = c - A @ theta
    return Fitted(theta, residual, float(np.sum(residual[mask] ** 2)))


def robust(rows: Rows) -> Rows:
    """The rows, those that the fit of the others leaves far outside with so much more deviation.

    Between the samples of a slow log a loop gives impulses that none of them has; the windows about
    them are outliers, the others know nothing of it. Source: biweight, Beaton, Tukey, Technometrics
    16 (1974) 147, its scale by the median, Huber, Robust Statistics (1981), 5.1; no scale is less
    than the equation errs itself.
    """
    weight = np.ones(len(rows.b))
    least = OF_EQUATION * float(np.linalg.norm(rows.b / rows.sd)) / max(len(rows.b), 1) ** 0.5
    for _ in range(MOST_ROUNDS):
        found = solve_rows(replace(rows, sd=rows.sd / weight))
        left = (rows.b - rows.X @ found.theta) / rows.sd
        scale = max(float(np.median(np.abs(left))) / MEDIAN_OF_NOISE, least, 1e-300)
        was, weight = weight, np.maximum(1.0 - (left / (BIWEIGHT * scale)) ** 2, LEAST_WEIGHT)
        if float(np.max(np.abs(weight - was))) < NEAR_ENOUGH:
            break
    return replace(rows, sd=rows.sd / weight)


def with_model_error(rows: Rows) -> Rows:
    """The rows, each with the error of the equation itself beside its noise: one variance for all,
    with which what is left is as large as it should be; none where the noise is all.

    Where a model lacks something its rows are wrong by as much whatever the sensors' noise, and
    weights by that alone would let the few of least noise decide. Source: Paule, Mandel, J. Res.
    Natl. Bur. Stand. 87 (1982) 377.
    """
    free = len(rows.b) - rows.X.shape[1]
    most = float(np.sum(rows.b**2)) / max(free, 1)

    def wider(share: float) -> Rows:
        """The rows with so much of all of the force's square as that variance."""
        return replace(rows, sd=np.sqrt(rows.sd**2 + share * most))

    def more(share: float) -> float:
        """What is left beyond what these rows should leave, as a share of it."""
        return float(solve_rows(wider(share)).cost / free - 1.0)

    if free <= 0 or more(0.0) <= 0.0:
        return rows
    return wider(float(brentq(more, 0.0, 1.0, rtol=CLOSE_VARIANCE)) if more(1.0) < 0.0 else 1.0)


def least_squares(A: Array, b: Array) -> Array:
    """Coefficients (k,) of b (r,) by the columns of A (r, k), whatever their units; 0 of one that
    is nothing."""
    scale = of_column(A)
    return np.asarray(np.linalg.lstsq(A / scale, b, rcond=1e-10)[0] / scale)


def inverse_of_gram(A: Array) -> Array:
    """Covariance (k, k) of least squares by the columns of A (r, k) of unit noise, whatever their
    units. Source: Aitken, Proc. R. Soc. Edinburgh 55 (1936) 42."""
    size = of_column(A) * len(A) ** 0.5
    inverse = np.linalg.pinv((A / size).T @ (A / size), rcond=1e-12, hermitian=True)
    return np.asarray(inverse / np.outer(size, size))


def left_unseen(rows: Rows) -> Array:
    """What is left (r,) of each block by the least squares of all others: of the only one, all.

    Source: cross-validation, Stone, J. R. Stat. Soc. B 36 (1974) 111.
    """
    blocks, left = np.unique(rows.block), np.zeros(len(rows.b))
    if len(blocks) == 1:
        return rows.b
    for block in blocks:
        out = rows.block == block
        left[out] = (rows.b - rows.X @ solve_rows(rows, ~out).theta)[out]
    return left


def without_each_block(rows: Rows) -> Array:
    """Parameters (blocks, k) of the least squares without each block in turn, by `left_out`."""
    return left_out(rows.block, lambda kept: solve_rows(rows, kept).theta)


def left_out(block: IntArray, of: Callable[[BoolArray], Array]) -> Array:
    """What is made of all rows but each block in turn, (blocks, ...); of: of a mask (r,) of them.

    Source: for the jackknife, Tukey, Annals of Mathematical Statistics 29 (1958) 614.
    """
    return np.array([of(np.asarray(block != k)) for k in np.unique(block)])


def spread_of_left_out(each: Array) -> Array:
    """Standard deviations of estimates (k, ...), each made without one of k blocks of the rows.

    Source: the jackknife, Tukey, Annals of Mathematical Statistics 29 (1958) 614.
    """
    n, off = len(each), each - np.mean(each, axis=0)
    return np.asarray(np.sqrt((n - 1) / n * np.sum(off**2, axis=0)))


def of_column(A: Array) -> Array:
    """Root mean square of each column (k,); 1 of nothing, whose parameter then comes out 0."""
    size = np.sqrt(np.mean(A**2, axis=0))
    return np.asarray(np.where(size > 0.0, size, 1.0))
