"""What the columns of a log do to each other: cheap for all pairs, more for a few positions."""

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from identification.arrays import Array
from identification.signals.differentiate import Motion, low_pass
from identification.signals.relations import (
    ForceLaw,
    Lead,
    actuator_shares,
    force_laws,
    lead,
)
from workbench.steps.first_card.axes import correlation
from workbench.steps.first_card.columns import MOST_ROWS_LOOKED_AT, Column

STRETCHES = (2, 8, 32)  # samples over which a position's change is the velocity's sum
FEWEST_AT_LIMIT = 20  # samples at which a limited command stands at its limit
WITHIN_LIMIT = 1e-3  # of its range, that a limited command is off the one before the limiter
MAYBE_LIMITED = 0.5  # correlation of the two, at least


class Pairs:
    """The signals of a log beside each other: `x` (n, k), `alike` and `rate` (k, k).

    alike: correlation; rate[i, j]: how much of j is the derivative of i, negative where turned.
    """

    def __init__(self, signals: Sequence[Column]) -> None:
        self.signals = tuple(signals)
        self.x = np.column_stack([one.x for one in signals])
        self.alike = correlation(self.x)
        self.rate = _rates(self.x)

    @cached_property
    def limited(self) -> dict[int, int]:
        """Columns that a limiter has behind it, by their place: the place of what stands behind."""
        out = {}
        for j, behind in enumerate(self.signals):
            for i, before in enumerate(self.signals):
                if i == j or behind.flag or abs(self.alike[i, j]) < MAYBE_LIMITED:
                    continue
                if _clipped(before, behind):
                    out[i] = j
        return out


def _rates(x: Array) -> Array:
    """How much of each signal (column) is the derivative of another (row), signed, (k, k)."""
    best = np.zeros((x.shape[1], x.shape[1]))
    mean = x - x.mean(axis=0)
    summed = np.vstack([np.zeros(x.shape[1]), np.cumsum(0.5 * (mean[1:] + mean[:-1]), axis=0)])
    for size in STRETCHES:
        if 4 * size > len(x):
            break
        change, total = mean[size:] - mean[:-size], summed[size:] - summed[:-size]
        k = x.shape[1]
        found = correlation(np.hstack([change, total]))[:k, k:]
        share = np.sign(found) * found**2
        best = np.where(np.abs(share) > np.abs(best), share, best)
    np.fill_diagonal(best, 0.0)
    return best


def _clipped(before: Column, behind: Column) -> bool:
    """Whether a column is another one but where it stands at its limits, which that one passes."""
    a, b = before.values[:MOST_ROWS_LOOKED_AT], behind.values[:MOST_ROWS_LOOKED_AT]
    both = np.isfinite(a) & np.isfinite(b)
    a, b = a[both], b[both]
    low, high = float(b.min()), float(b.max())
    width = high - low
    inside = (b > low + WITHIN_LIMIT * width) & (b < high - WITHIN_LIMIT * width)
    if min(np.sum(~inside), np.sum(inside)) < FEWEST_AT_LIMIT:
        return False
    X = np.column_stack([a, np.ones(len(a))])
    slope, *_ = np.linalg.lstsq(X[inside], b[inside], rcond=None)
    off, beyond = np.abs(X @ slope - b), np.max(np.abs((X @ slope - b)[~inside]))
    return bool(np.max(off[inside]) < 2 * WITHIN_LIMIT * width < beyond)


class Seen:
    """The other columns as a position sees them; `at` is its place among them.

    smooth: all (n, k) as smooth as its motion; v_share, v_factor: of its velocity in each, (k,).
    """

    def __init__(self, pairs: Pairs, at: int) -> None:
        self.pairs, self.at, self.y = pairs, at, pairs.signals[at]
        assert self.y.motion is not None
        self.motion: Motion = self.y.motion
        self.smooth = low_pass(pairs.x.T, 1.0, self.motion.cutoff).T
        inside = slice(self.motion.edge, len(self.motion.v) - self.motion.edge)
        v = self.motion.v[inside] - self.motion.v[inside].mean()
        f = self.smooth[inside] - self.smooth[inside].mean(axis=0)
        square, together = max(float(v @ v), 1e-300), v @ f
        self.v_factor = together / square
        self.v_share = together**2 / square / np.maximum(np.sum(f**2, axis=0), 1e-300)
        self._leads = dict[int, Lead]()

    @cached_property
    def laws(self) -> list[ForceLaw]:
        """What of each column is the force along the position; empty where too little moves."""
        return force_laws(self.motion, self.y.x, self.pairs.x, self.smooth)

    def laws_of(self, f: Array, smooth: Array) -> list[ForceLaw]:
        """The same of other signals (n, j), and of these smoothed."""
        return force_laws(self.motion, self.y.x, f, smooth)

    def lead(self, k: int) -> Lead:
        """By how much a column is ahead of the position."""
        if k not in self._leads:
            self._leads[k] = lead(self.pairs.x[:, k], self.y.x)
        return self._leads[k]

    def moves(self, F: Array) -> Array:
        """How much more the change of F (n,), smoothed, follows each column than its follows F."""
        both = actuator_shares(np.column_stack([F, self.smooth]), self.motion.v)
        return np.asarray(np.abs(both[0, 1:]) - np.abs(both[1:, 0]))
