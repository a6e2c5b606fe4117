"""Changes of parameters against a practical margin: how far beyond it, and which of them moved.

A change counts by how far it lies outside the box of changes that do not matter, measured in the
covariance of what is known. So a change must be both sure and larger than the margin: a long log
makes no negligible change significant, and a poor log none of its accidents. Sources: distance to a
set of means as a test, Kudo, Biometrika 50 (1963) 403; least squares in a box, Stark, Parker,
Computational Statistics 10 (1995) 129.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from scipy.optimize import lsq_linear
from scipy.stats import chi2

from identification.arrays import Array
from identification.thresholds import CHANCE_LEVEL


@dataclass(frozen=True, eq=False)
class Change:
    """Changes (k,) of the parameters `names`, their covariance (k, k), and the margin within which
    each does not matter."""

    names: tuple[str, ...]
    change: Array
    covariance: Array
    margin: float

    @cached_property
    def square(self) -> float:
        """How far it lies beyond the margin; without a change beyond it at most chi-square of k
        degrees in distribution (Kudo 1963)."""
        return self.without(())

    def without(self, free: tuple[int, ...]) -> float:
        """The same where these entries may be of any size: least (change - x)' covariance^-1
        (change - x) over x with |x| <= margin, unbounded in them."""
        bound = np.full(len(self.change), self.margin)
        bound[list(free)] = np.inf
        if np.all(np.abs(self.change) <= bound):
            return 0.0
        A = np.linalg.inv(np.linalg.cholesky(self.covariance))
        if not np.any(bound):
            return float(np.sum((A @ self.change) ** 2))
        # A margin of no width is a box all the same to the solver, if a very thin one.
        bound = np.maximum(bound, 1e-12)
        found = lsq_linear(A, A @ self.change, bounds=(-bound, bound), method="bvls", tol=1e-12)
        return 2.0 * float(found.cost)

    def moved(self) -> tuple[int, ...]:
        """The fewest entries that explain the change, largest gain first.

        The others may lie anywhere within the margin. One at a time is set free, the one that
        brings the distance down most, as long as it does so surely. Parameters that a log cannot
        separate do not all move.
        """
        d, left = len(self.names), self.square
        chosen: list[int] = []
        while left > 0.0 and len(chosen) < d:
            tried = {i: self.without((*chosen, i)) for i in range(d) if i not in chosen}
            best = min(tried, key=lambda i: tried[i])
            if left - tried[best] < self._sure and chosen:
                break
            chosen.append(best)
            left = tried[best]
        return tuple(chosen)

    def discriminated(self, chosen: tuple[int, ...]) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """Those of `chosen` that surely moved, and the group of which others may have instead.

        Surely: beyond the margin by its own deviation, in which what goes together with the others
        is. Of the rest nobody can say: with them go those that would explain the change as well.
        """
        beyond = np.maximum(np.abs(self.change) - self.margin, 0.0) ** 2
        surely = beyond >= self._sure * np.diag(self.covariance)
        sure = tuple(i for i in chosen if surely[i])
        unsure = [i for i in chosen if not surely[i]]
        left, group = self.without(chosen), set(unsure)
        for i, j in product(unsure, set(range(len(self.names))) - set(chosen)):
            other = (*(k for k in chosen if k != i), j)
            if surely[j] or self.without(other) - left < self._sure:
                group.add(j)
        return sure, tuple(sorted(group))

    @property
    def _sure(self) -> float:
        """Gain in square distance of one entry of k that is no chance (Bonferroni)."""
        return float(chi2.isf(CHANCE_LEVEL / len(self.names), 1))
