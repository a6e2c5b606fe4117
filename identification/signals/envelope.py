"""Which points of a long signal a picture needs: every peak, an even spread, the liveliest part."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from identification.arrays import Array, IntArray

SCATTER = 6000  # points of a cloud
SHOWN_SHARE = 0.995  # of the points that axes hold; the rarest would flatten the rest


def thinned_together(x: Array, values: Iterable[Array], points: int) -> tuple[Array, list[Array]]:
    """At most `points` places of x, shared by all lines, each of which keeps every peak.

    Every block of samples becomes two places, at which a line has its lowest and highest value in
    the order in which it takes them.
    """
    values, n = [np.asarray(y, dtype=np.float64) for y in values], len(x)
    if n <= points:
        return x, values
    size = -(-2 * n // points)
    starts = np.arange(0, n, size)
    # Spread from the first sample to the last, so that an even clock stays even.
    places = np.interp(np.linspace(0, n - 1, 2 * len(starts)), np.arange(n), x)
    return places, [_low_and_high(y, starts, size) for y in values]


def _low_and_high(y: Array, starts: Any, size: int) -> Array:
    filled = np.full(len(starts) * size, np.nan)
    filled[: len(y)] = y
    blocks = filled.reshape(len(starts), size)
    known = np.isfinite(blocks)
    low = np.where(known, blocks, np.inf)
    high = np.where(known, blocks, -np.inf)
    at = np.sort(np.stack([low.argmin(axis=1), high.argmax(axis=1)]), axis=0).T
    # A block that holds a gap shows one: a line across it would join what is apart.
    whole = known.all(axis=1) | (np.arange(len(starts)) == len(starts) - 1)
    out = np.take_along_axis(blocks, at, axis=1)
    out[~whole, 1] = np.nan
    return np.asarray(out.ravel())


def evenly_spread(count: int, most: int = SCATTER) -> IntArray:
    """Indices of at most `most` of `count` points, evenly spread."""
    step = max(1, -(-count // most))
    return np.arange(0, count, step, dtype=np.int64)


def liveliest(y: Array, share: float = 0.12) -> slice:
    """The stretch of a log, that share of it, in which the position moves most."""
    size = max(50, round(share * len(y)))
    if len(y) <= size:
        return slice(0, len(y))
    # Blocks keep the noise of a fast log from counting as motion.
    block = max(1, size // 50)
    coarse = y[::block]
    way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(coarse)))])
    wide = max(2, size // block)
    gain = way[wide:] - way[:-wide]
    start = int(np.argmax(gain)) * block if gain.size else 0
    return slice(start, min(start + size, len(y)))
