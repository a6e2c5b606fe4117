"""Changes of parameters against a practical margin: how far beyond it, and which of them moved.

A change counts by how far it lies outside the box of changes that do not matter, measured in the
covariance of what is known. So a change must be both sure and larger than the margin: a long log
makes no negligible change significant, and a poor log none of its accidents.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.optimize import lsq_linear
from scipy.stats import chi2

from identification.arrays import Array
from identification.thresholds import CHANCE_LEVEL


@dataclass(frozen=True, eq=False)
class Distance:
    """Square distance of changes to the margin's box, and the nearest point (d,) of the box."""

    square: float
    nearest: Array


def beyond_margin(
    change: Array, covariance: Array, margin: Array, free: tuple[int, ...] = ()
) -> Distance:
    """Least (change - x)' covariance^-1 (change - x) over x with |x| <= margin.

    change, margin (d,), covariance (d, d); free: indices of x without a bound. Without any true
    change beyond the margin it is at most chi-square of d - len(free) degrees in distribution.
    """
    if not len(change):
        return Distance(0.0, np.zeros(0))
    A = np.linalg.inv(np.linalg.cholesky(covariance))
    if not np.any(margin) and not free:
        return Distance(float(np.sum((A @ change) ** 2)), np.zeros(len(change)))
    bound = margin.astype(np.float64).copy()
    bound[list(free)] = np.inf
    inside = np.clip(change, -bound, bound)
    if np.array_equal(inside, change):
        return Distance(0.0, inside)
    # A margin of no width is a box all the same to the solver, if a very thin one.
    bound = np.maximum(bound, 1e-12)
    found = lsq_linear(A, A @ change, bounds=(-bound, bound), method="bvls", tol=1e-12)
    return Distance(float(np.sum((A @ (change - found.x)) ** 2)), np.asarray(found.x))


def moved(change: Array, covariance: Array, margin: Array) -> tuple[int, ...]:
    """Indices of the fewest parameters whose change explains `change` (d,), largest gain first.

    The others may lie anywhere within the margin. One at a time is set free, the one that brings
    the distance down most, as long as it does so surely; then those are taken back that the rest
    makes needless. Parameters that a log cannot separate do not all move.
    """
    d = len(change)
    sure = float(chi2.isf(CHANCE_LEVEL / max(d, 1), 1))
    chosen: list[int] = []
    left = beyond_margin(change, covariance, margin).square
    while left > 0.0 and len(chosen) < d:
        tried = {
            i: beyond_margin(change, covariance, margin, (*chosen, i)).square
            for i in range(d)
            if i not in chosen
        }
        best = min(tried, key=lambda i: tried[i])
        if left - tried[best] < sure and chosen:
            break
        chosen.append(best)
        left = tried[best]
    for i in tuple(chosen):
        without = tuple(j for j in chosen if j != i)
        if without and beyond_margin(change, covariance, margin, without).square - left < sure:
            chosen.remove(i)
            left = beyond_margin(change, covariance, margin, without).square
    return tuple(chosen)


def discriminated(
    change: Array, covariance: Array, margin: Array, chosen: tuple[int, ...]
) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Those of `chosen` that surely moved, and the group of which others may have in their place.

    Surely: beyond the margin by its own deviation, in which what goes together with the others is.
    Of the rest nobody can say: with them go the parameters that would explain the change as well.
    """
    d = len(change)
    square = float(chi2.isf(CHANCE_LEVEL / max(d, 1), 1))
    beyond = np.maximum(np.abs(change) - margin, 0.0) ** 2 / np.diag(covariance)
    sure = tuple(i for i in chosen if beyond[i] >= square)
    unsure = [i for i in chosen if i not in sure]
    left = beyond_margin(change, covariance, margin, chosen).square
    group = {*unsure, *(i for i in range(d) if unsure and beyond[i] >= square and i not in sure)}
    for i, j in product(unsure, range(d)):
        if j not in chosen:
            other = (*(k for k in chosen if k != i), j)
            if beyond_margin(change, covariance, margin, other).square - left < square:
                group.add(j)
    return sure, tuple(sorted(group))


def explained_change(
    change: Array, covariance: Array, margin: Array, chosen: tuple[int, ...]
) -> tuple[Array, Array]:
    """Change (k,) of the chosen parameters and its covariance (k, k), the others in the margin."""
    at = list(chosen)
    found = beyond_margin(change, covariance, margin, chosen).nearest[at]
    precision = np.linalg.inv(covariance)[np.ix_(at, at)]
    return found, np.linalg.inv(precision)
