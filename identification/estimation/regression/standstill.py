"""Evidence in rest and breakaway: what a stuck body does, and the force at which it lets go.

A stuck Karnopp body does not move at all, and lets go at F_sp or F_sn whatever came before. In
rest the shown position against force shows elasticity; at breakaway force against the time at
rest, place, pressure shows what the limits depend on.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d

from identification.arrays import Array, IntArray
from identification.estimation.regression.equation_rows import MotionLog
from identification.estimation.regression.weighted_rows import BLOCKS, Rows
from identification.signals.sampling import samples

LEAST_BREAKAWAY = 0.6  # of the direction's median force, below which an event is none
RATE = 4  # samples over which the force's rate is taken
MEAN = 8  # samples in a row of rest
BORNE_SHARE = 0.95  # of the Coulomb level, that a force may reach without moving a body at rest
LEAST_ROWS = 4  # rows in a stretch
ONSET = 5.0  # times the noise at which a body has moved


@dataclass(frozen=True, eq=False)
class Rest:
    """Rows of rest of one log: first sample (r,) of each mean, and its stretch (r,)."""

    start: IntArray
    stretch: IntArray


@dataclass(frozen=True, eq=False)
class Breakaways:
    """Events of one log: last sample at rest (k,), direction, time at rest [s], force
    [N] and its rate [N/s], positive where it rises in the direction of motion; left: of the
    position about each, mean square in noise units."""

    at: IntArray
    direction: Array
    rested: Array
    force: Array
    rate: Array
    left: Array

    @classmethod
    def of(cls, found: Sequence[tuple[float, float, float, float, float, float]]) -> "Breakaways":
        """Events as they were found, but for those far below the others of their direction: a body
        that is pushed on at the start of a log has not broken away."""
        k = np.array(found).reshape(-1, 6)
        for way in (1.0, -1.0):
            own = k[:, 1] == way
            if np.any(own):
                middle = np.median(way * k[own, 3])
                k = k[~own | (way * k[:, 3] > LEAST_BREAKAWAY * middle)]
        return cls(k[:, 0].astype(np.int64), *k[:, 1:].T)


def rest_stretches(one: MotionLog, shortest: int) -> list[tuple[int, int]]:
    """Stretches of samples (low, high) in which the body does not move significantly."""
    still = one.signals["d"] == 0
    edges = np.flatnonzero(np.diff(np.concatenate([[0], still.astype(np.int8), [0]])))
    return [
        (int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a >= shortest
    ]


def rests(one: MotionLog, up: float, down: float) -> Rest:
    """Rows of rest, without the ends of a stretch, where the body starts or stops.

    up, down: Coulomb levels [N]. Beyond them a body may creep in stops too short to be seen; below
    them nothing rigid moves.
    """
    mean = samples(MEAN, one.log.h)
    starts, number = [], []
    load = uniform_filter1d(np.asarray(one.log["F"]), mean, origin=-(mean // 2))
    stuck = (load < BORNE_SHARE * up) & (load > -BORNE_SHARE * down)
    for i, (low, high) in enumerate(rest_stretches(one, (LEAST_ROWS + 2) * mean)):
        own = np.arange(low + mean, high - 2 * mean + 1, mean)
        own = own[stuck[own]]
        if len(own) >= LEAST_ROWS:
            starts.append(own)
            number.append(np.full(len(own), i))
    if not starts:
        none = np.zeros(0, dtype=np.int64)
        return Rest(none, none)
    return Rest(np.concatenate(starts).astype(np.int64), np.concatenate(number).astype(np.int64))


def borne(logs: Sequence[MotionLog]) -> tuple[float, float]:
    """Largest forces [N] that a body at rest bore in either direction, 0 where it never rested.

    Means over a row, without the ends of a stretch: the stick limits are hardly less.
    """
    up, down = 0.0, 0.0
    for one in logs:
        mean = samples(MEAN, one.log.h)
        load = uniform_filter1d(np.asarray(one.log["F"]), mean)
        for low, high in rest_stretches(one, 3 * mean):
            own = load[low + mean : high - mean]
            up, down = max(up, float(np.max(own))), max(down, -float(np.min(own)))
    return up, down


def means(x: Array, rest: Rest, mean: int) -> Array:
    """Means of a signal over the rows, of so many samples, less that over their stretch, (r,)."""
    view = np.lib.stride_tricks.sliding_window_view(np.asarray(x), mean)
    rows: Array = np.asarray(view[rest.start].mean(axis=1))
    if not len(rows):
        return rows
    count = np.bincount(rest.stretch)
    level = np.bincount(rest.stretch, rows) / np.maximum(count, 1)
    return np.asarray(rows - level[rest.stretch])


def rest_rows(one: MotionLog, rest: Rest, moved: Array | None = None) -> Rows:
    """Rows of the shown position in rest [m], less what an effect makes of it, `moved` (n,).

    A stuck body does not move: the paper's eq. (1); `README.md`, (5).
    """
    y = one.log["y"] if moved is None else one.log["y"] - moved
    mean = samples(MEAN, one.log.h)
    b = means(y, rest, mean)
    sd = np.full(len(b), one.noise.y / np.sqrt(mean))
    block = (rest.start * BLOCKS // len(one.log)).astype(np.int64)
    return Rows(b, np.zeros((len(b), 0)), sd, block, np.full(len(b), np.inf), ())


def breakaway_rows(one: MotionLog, events: Breakaways) -> Rows:
    """Rows of the breakaway force F_sp or -F_sn [N] (the paper's eq. (1)); `README.md`, (6)."""
    up = events.direction > 0
    # What is late in seeing the motion is the more, the faster the force rises.
    X = np.column_stack([1.0 * up, -1.0 * ~up, events.direction * events.rate])
    sd = np.full(len(up), scatter(events))
    block = (events.at * BLOCKS // len(one.log)).astype(np.int64)
    return Rows(events.force, X, sd, block, np.full(len(up), np.inf), ("F_sp", "-F_sn", "rate"))


def scatter(events: Breakaways) -> float:
    """Spread of the breakaway forces [N] of one direction between neighbours in time at rest."""
    steps = []
    for way in (1.0, -1.0):
        own = events.direction == way
        order = np.argsort(events.rested[own], kind="stable")
        steps.append(np.diff(events.force[own][order]) / np.sqrt(2.0))
    joined = np.abs(np.concatenate(steps))
    return max(1.48 * float(np.median(joined)), 1e-9) if len(joined) >= 3 else np.inf
