"""The equation of motion's rows with the force at many lags, and what they leave."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.arrays import Array, BoolArray, IntArray
from identification.estimation.regression.equation_rows import NOTHING_KNOWN, MotionLog, mechanical
from identification.estimation.regression.motion_log import SLOWEST_PART
from identification.estimation.regression.weighted_rows import BLOCKS
from identification.model.surroundings import NO_SURROUNDINGS, Surroundings
from identification.thresholds import OF_ACCOUNT

FEWEST_WINDOWS = 40  # windows of sliding


@dataclass(frozen=True, eq=False)
class LaggedRows:
    """Products of the equation's columns X with themselves (k, c, c) and with the force at every
    lag (k, c, l), and its squares (k, l), of each block; lags in samples (l,);
    rows: of all."""

    columns: Array
    with_force: Array
    force: Array
    lags: Array
    rows: int

    def left(self, kept: BoolArray, used: Sequence[int]) -> tuple[Array, Array]:
        """Square left at every lag (l,) and coefficients (c, l), of these blocks and columns."""
        at = np.asarray(used)
        G = np.sum(self.columns[kept], axis=0)[np.ix_(at, at)]
        size = np.sqrt(np.diag(G))
        size = np.where(size > 0.0, size, 1.0)  # of nothing, whose coefficient is then 0
        c = np.sum(self.with_force[kept], axis=0)[at] / size[:, np.newaxis]
        theta = np.linalg.pinv(G / np.outer(size, size), rcond=1e-10, hermitian=True) @ c
        square = np.sum(self.force[kept], axis=0) - np.sum(c * theta, axis=0)
        return np.maximum(square, 1e-300), theta / size[:, np.newaxis]

    def least(self, used: Sequence[int], kept: BoolArray | None = None) -> float:
        """Square left at the best lag, of these blocks, by default all, and columns."""
        return float(np.min(self.left(self.every if kept is None else kept, used)[0]))

    def with_inertia(self, used: Sequence[int]) -> "LaggedRows":
        """The lags about the least square of those at which inertia is of account, and that of 0;
        all of them where there is no such.

        A force of two levels that a loop switches is Coulomb friction alone at the lag at which its
        steps are those of the direction, without anything left. Ours.
        """
        left, theta = self.left(self.every, used)
        force = np.sum(self.force, axis=0)
        share = theta[0] * np.sqrt(np.sum(self.columns[:, 0, 0]) / np.where(force > 0, force, 1.0))
        lows = 1 + np.flatnonzero((left[1:-1] < left[:-2]) & (left[1:-1] <= left[2:]))
        lows = lows[share[lows] >= OF_ACCOUNT]
        if not len(lows):
            return self
        at, none = int(lows[np.argmin(left[lows])]), int(np.argmin(np.abs(self.lags)))
        rises = np.diff(left) > 0.0
        first = at - int(np.argmax(np.append(rises[:at][::-1], True)))
        last = at + int(np.argmax(np.append(~rises[at:], True)))
        kept = slice(min(first, none), max(last, none) + 1)
        return replace(
            self, with_force=self.with_force[:, :, kept], force=self.force[:, kept],
            lags=self.lags[kept],
        )  # fmt: skip

    @property
    def blocks(self) -> IntArray:
        """Numbers of the blocks (k,)."""
        return np.arange(len(self.force))

    @property
    def every(self) -> BoolArray:
        """All of them (k,)."""
        return np.ones(len(self.force), dtype=np.bool_)


def lagged_rows(
    moved: Sequence[MotionLog], lags: Array, turns: bool, zoh: bool,
    known: Surroundings = NO_SURROUNDINGS,
) -> LaggedRows | None:  # fmt: skip
    """The equation's rows at every lag, by blocks of time; None where there are too few. Source:
    weak form, Messenger, Bortz, J. Comput. Phys. 443 (2021) 110525.

    lags: in samples, ascending; zoh: the force's column is a zero-order hold.
    """
    if not any(len(one.speed) for one in moved):
        return None
    own, cross, square, rows = [], [], [], 0
    slow = slow_of_each_way(moved)
    for one in moved:
        w, plain = one.sliding, mechanical(one, NOTHING_KNOWN)
        mean = w.zoh if zoh else w.mean
        at, F, y = np.arange(len(one.log)), np.asarray(one.log["F"]), np.asarray(one.log["y"])
        X = plain.X
        if turns:
            X = np.column_stack([X, w.mean @ y, w.mean @ np.sin(y), w.mean @ np.cos(y)])
        own_lags = lags * (moved[0].log.h / one.log.h)  # lags are in samples of the first log
        place = known.of_angle(y)  # which is of the angle at that instant, whatever the lag
        B = np.column_stack(
            [mean @ (np.interp(at - lag, at, F - place) + place) for lag in own_lags]
        )
        inside = (w.start >= lags[-1]) & (w.start + w.length < len(F) + min(float(lags[0]), 0.0))
        up = one.up
        inside &= plain.speed >= np.where(up, *slow)
        block = _blocks_of_each_way(up, inside)
        for k in range(BLOCKS):
            in_block = inside & (block == k)
            if np.any(in_block):
                x, b = X[in_block], B[in_block]
                own.append(x.T @ x)
                cross.append(x.T @ b)
                square.append(np.sum(b**2, axis=0))
                rows += len(b)
    if rows < FEWEST_WINDOWS:
        return None
    return LaggedRows(np.array(own), np.array(cross), np.array(square), lags, rows)


def slow_of_each_way(moved: Sequence[MotionLog]) -> tuple[float, float]:
    """The speed [m/s] of the slow windows that move up, and of those that move down, of which all
    may be slower than the others."""
    speed = np.concatenate([one.speed for one in moved])
    up = np.concatenate([one.up for one in moved])
    ways = (speed[up], speed[~up])
    first, second = (float(np.quantile(x, SLOWEST_PART)) if len(x) else 0.0 for x in ways)
    return first, second


def _blocks_of_each_way(up: BoolArray, inside: BoolArray) -> IntArray:
    """Blocks of time (r,) with as many of the rows inside that go up, and that go down, in each:
    without any one of them there is motion both ways."""
    block = np.zeros(len(up), dtype=np.int64)
    for way in (up & inside, ~up & inside):
        count = int(np.count_nonzero(way))
        block[way] = np.arange(count) * BLOCKS // max(count, 1)
    return block
