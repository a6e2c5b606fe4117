"""What the columns of a log do to each other: cheap for all pairs, more for a few positions."""

from collections.abc import Sequence
from functools import cached_property
from itertools import permutations

import numpy as np

from identification.arrays import Array
from identification.columns.column import MOST_ROWS_READ, Column
from identification.signals.differentiate import Motion, low_pass
from identification.signals.relations import ForceLaw, Lead, beside, changed_by, force_laws, lead

STRETCHES = (2, 8, 32)  # samples over which a position's change is the velocity's sum
FEWEST_AT_LIMIT = 3  # samples at which a limited command stands at its limit
MOST_CONSTANT = 0.3  # of a signal's spread, that a derivative is off the change of what it is of
DIFFERENCE, SAME_FACTOR = 0.9995, 0.02  # share of an error that two signals' difference explains
ONE_UNIT, MOST_ADDED = 0.15, 0.3  # slope off one, and share of the variance, of what is added
MOSTLY_PAST, PASSES = 0.8, 1.05  # samples at the limit, and range, of the one before a limiter
SAME_SUM, MOSTLY_ADDED, SELDOM = 1e-4, 0.95, 0.02  # of its range, and of the rows, in a sum
ONE_SIGNAL = 0.5  # correlation of a reference with what follows it, at least
SURELY_TURNED = 0.9  # likeness from which a reference has the other sign
# Gains of a controller from reference and position, apart, and shares of its output that are left.
SAME_GAIN, NOT_OF_CONTROL, MORE_OF_BOTH = 0.1, 0.05, 0.2
MAYBE_ONE = 0.5  # correlation of a command before a limiter or sum and behind it, at least


class Pairs:
    """The signals of a log beside each other: `x` (n, k), `alike` and `rate` (k, k).

    alike: correlation; rate[i, j]: how much of j is the derivative of i, negative where turned;
    rate_but_constant: the same where the two may be a constant apart, as a friction force is from a
    velocity; bodies: what others do to each of those that may be the position, by its place.
    """

    def __init__(self, signals: Sequence[Column]) -> None:
        self.signals = tuple(signals)
        self.x = np.column_stack([one.x for one in signals])
        self.alike = correlation(self.x)
        self.rate, self.rate_but_constant = _rates(self.x)
        self.stems = [one.header.stem for one in signals]
        self.bodies = dict[int, Seen]()

    @cached_property
    def errors(self) -> dict[int, set[tuple[int, int]]]:
        """Signals that are the difference of two others, as a following error is, by their place:
        the places of the two, the first before the second.

        Of three such the smallest is the error; what is fed forward goes less with either.
        """
        centred = self.x - self.x.mean(axis=0)
        gram = centred.T @ centred
        square = np.maximum(np.diag(gram), 1e-300)
        out: dict[int, set[tuple[int, int]]] = {}
        for i in range(len(self.signals) - 1):
            near = np.flatnonzero(np.abs(self.alike[i, i + 1 :]) >= ONE_SIGNAL) + i + 1
            det = (square[i] * square[near] - gram[i, near] ** 2)[:, None]
            det = np.where(det > 1e-12 * square[i] * square[near, None], det, np.inf)
            first = (square[near, None] * gram[i] - gram[i, near, None] * gram[near]) / det
            second = (square[i] * gram[near] - gram[i, near, None] * gram[i]) / det
            share = (first * gram[i] + second * gram[near]) / square
            turned = np.abs(first + second) < SAME_FACTOR * np.abs(first)
            small = square < np.minimum(square[i], square[near, None]) * first**2
            found = (share > DIFFERENCE) & turned & small
            found[:, i] = False
            found[np.arange(len(near)), near] = False
            for row, k in np.argwhere(found).tolist():
                out.setdefault(k, set()).add((i, int(near[row])))
        return out

    def behind(self, commands: Sequence[int]) -> dict[int, int]:
        """Commands before a limiter or a sum, by their place: the place of what comes out of it.

        commands: places of the columns that may be such.
        """
        out = {}
        for i, j in permutations(commands, 2):
            if abs(self.alike[i, j]) < MAYBE_ONE or self.signals[j].flag:
                continue
            before, after = self.signals[i], self.signals[j]
            if _clipped(before, after):
                out[i] = j
            elif i not in out and (part := _added(self.signals, i, j)) is not None:
                out |= {i: j, part: j}
        return out


def normed(x: Array) -> Array:
    """Columns (n, k) without their mean, of length one."""
    a = x - x.mean(axis=0)
    size = np.sqrt(np.sum(a**2, axis=0))
    return np.asarray(a / np.where(size > 0.0, size, 1.0))


def correlation(x: Array) -> Array:
    """Correlation of the columns of x (n, k), (k, k)."""
    a = normed(x)
    return np.asarray(a.T @ a)


def follows(found: Lead) -> bool:
    """Whether a position so alike follows a reference, or one of the other sign."""
    return found.likeness >= ONE_SIGNAL or found.likeness < -SURELY_TURNED


def _rates(x: Array) -> tuple[Array, Array]:
    """How much of each signal (column) is the derivative of another (row), signed, (k, k): none of
    it where the two are a constant apart, and whether they are or not."""
    best = np.zeros((x.shape[1], x.shape[1]))
    every = best.copy()
    mean, middle = x - x.mean(axis=0), x.mean(axis=0)
    spread = np.maximum(np.std(x, axis=0), 1e-300)
    summed = np.vstack([np.zeros(x.shape[1]), np.cumsum(0.5 * (mean[1:] + mean[:-1]), axis=0)])
    for size in STRETCHES:
        if 4 * size > len(x):
            break
        step = max(1, size // 4)
        change = (mean[size:] - mean[:-size])[::step]
        rise = (summed[size:] - summed[:-size])[::step]
        found = normed(change).T @ normed(rise)
        factor = found * np.std(rise, axis=0) / np.maximum(np.std(change, axis=0), 1e-300)[:, None]
        constant = middle + (rise.mean(axis=0) - factor * change.mean(axis=0)[:, None]) / size
        own = np.abs(constant) < MOST_CONSTANT * spread
        share = np.sign(found) * found**2
        every = np.where(np.abs(share) > np.abs(every), share, every)
        best = np.where(own & (np.abs(share) > np.abs(best)), share, best)
    for one in (best, every):
        np.fill_diagonal(one, 0.0)
    return best, every


def _clipped(before: Column, behind: Column) -> bool:
    """Whether a column is another one, mostly, but where it stands at limits which that passes.

    Mostly: a feed-forward may be added between the two. They are in one unit.
    """
    a, b = before.beside(behind)
    low, high = float(b.min()), float(b.max())
    above, below = b == high, b == low
    at = above | below
    if max(np.sum(above), np.sum(below)) < FEWEST_AT_LIMIT or np.sum(~at) < FEWEST_AT_LIMIT:
        return False
    slope, shift = np.polyfit(a[~at], b[~at], 1) if np.ptp(a[~at]) > 0.0 else (0.0, 0.0)
    fitted = slope * a + shift
    left = float(np.var(b[~at] - fitted[~at]))
    past = np.sum(fitted[above] > high) + np.sum(fitted[below] < low)
    return (
        abs(slope - 1.0) < ONE_UNIT
        and left < MOST_ADDED * float(np.var(b[~at]))
        and bool(past > MOSTLY_PAST * np.sum(at))
        and float(np.ptp(a)) > PASSES * (high - low)
    )


def _added(signals: Sequence[Column], i: int, j: int) -> int | None:
    """The place of the column that, added to one, makes the other; None where there is none."""
    a, b = signals[i].beside(signals[j])
    width = float(np.ptp(b))
    for k, part in enumerate(signals):
        if k in (i, j) or part.flag or len(part.values) != len(signals[i].values):
            continue
        c = part.values[:MOST_ROWS_READ]
        if len(c) != len(a) or float(np.ptp(c)) > width:
            continue
        same = np.abs(b - a - c) < SAME_SUM * width
        if np.mean(same) > MOSTLY_ADDED and np.mean(np.abs(c) > SAME_SUM * width) > SELDOM:
            return k
    return None


def _left_by(X: Array, of: Array) -> tuple[Array, Array]:
    """Least squares of columns (n, k) by X (n, m): coefficients (m, k), and the share left (k,)."""
    found = np.asarray(np.linalg.lstsq(X, of, rcond=None)[0], dtype=np.float64)
    left = np.var(of - X @ found, axis=0) / np.maximum(np.var(of, axis=0), 1e-300)
    return found, left


class Seen:
    """The other columns as a position sees them; `at` is its place among them.

    smooth: all (n, k) as smooth as its motion; v_share, v_factor: of its velocity in each, (k,);
    v_constant: what is constant beside it, in units of the
    spread.
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
        spread = np.maximum(np.std(self.smooth[inside], axis=0), 1e-300)
        constant = self.smooth[inside].mean(axis=0) - self.v_factor * self.motion.v[inside].mean()
        self.v_constant = np.abs(constant) / spread
        self._leads = dict[int, Lead]()
        self.as_reference = dict[int, float]()

    @cached_property
    def laws(self) -> list[ForceLaw]:
        """What of each column is the force along the position; empty where too little moves."""
        return force_laws(self.motion, self.y.x, self.pairs.x, self.smooth)

    def lead(self, k: int) -> Lead:
        """By how much a column is ahead of the position."""
        if k not in self._leads:
            self._leads[k] = lead(self.pairs.x[:, k], self.y.x)
        return self._leads[k]

    @cached_property
    def _beside(self) -> Array:
        return beside(self.smooth, self.motion.v)

    @cached_property
    def _rates(self) -> Array:
        """The change of each column, its share of the velocity taken out, over its spread."""
        rate = np.gradient(self.smooth, axis=0)
        spread = np.sqrt(np.sum((rate - rate.mean(axis=0)) ** 2, axis=0))
        return np.asarray(beside(rate, self.motion.v) / np.maximum(spread, 1e-300))

    def is_followed_by_control(self, k: int) -> bool:
        """Whether another column is what a controller makes of the difference between this one and
        the position and of its derivative: then this one is the reference, whatever its name.

        Neither this one nor the position alone makes as much of it, as of what one of them drives.
        """
        s = self.smooth - self.smooth.mean(axis=0)
        own = [np.column_stack([s[:, i], np.gradient(s[:, i])]) for i in (k, self.at)]
        law, left = _left_by(np.hstack(own), s)
        alone = np.minimum(*(_left_by(one, s)[1] for one in own))
        turned = np.abs(law[0] + law[2]) < SAME_GAIN * np.abs(law[0])
        made = turned & (left < NOT_OF_CONTROL) & (left < MORE_OF_BOTH * alone)
        made[[k, self.at]] = False
        return bool(np.any(made))

    def moves(self, F: Array) -> Array:
        """How much more the change of F (n,), smoothed, follows each column than its follows F."""
        v = self.motion.v
        there = np.abs(changed_by(F[:, None], self._beside, v)[0])
        own = beside(F[:, None], v)[:, 0]
        back = (own @ self._rates) ** 2 / max(float(own @ own), 1e-300)
        return np.asarray(there - back)
