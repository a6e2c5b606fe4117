"""On what a residual depends: functions of one signal at a time, judged on blocks left out."""

from collections.abc import Mapping

import numpy as np

from identification.arrays import Array, BoolArray, IntArray
from identification.trace_result import Dependence

BINS = (10, 60, 200)  # levels of a signal, by quantiles; straight lines in between
FEW = 8  # values of a signal (a switch, a gear) that are told apart each by itself
LEAST = 0.08  # share of the residual, on blocks left out, from which it depends on a signal
MOST = 3  # signals named
ADDED = 0.15  # share of what is left that a second signal must explain


def hats(x: Array, levels: int) -> Array:
    """Piecewise linear functions of `x` over its quantiles, (n, k)."""
    values = np.unique(x)
    if len(values) <= FEW:
        return np.asarray(x[:, np.newaxis] == values, dtype=np.float64)
    knots = np.unique(np.quantile(x, np.linspace(0.0, 1.0, levels)))
    if len(knots) < 3:
        return np.ones((len(x), 1))
    return np.column_stack([np.interp(x, knots, row) for row in np.eye(len(knots))])


def explained_by(r: Array, X: Array, block: IntArray) -> tuple[float, Array]:
    """Share of the residual's square that X explains on blocks left out, and what it predicts."""
    G = {
        b: (X[block == b].T @ X[block == b], X[block == b].T @ r[block == b])
        for b in np.unique(block)
    }
    whole = sum(g for g, _ in G.values())
    right = sum(v for _, v in G.values())
    ridge = 1e-6 * np.trace(whole) / X.shape[1] * np.eye(X.shape[1])
    out = np.zeros(len(r))
    for b, (g, v) in G.items():
        theta = np.linalg.solve(whole - g + ridge, right - v)
        out[block == b] = X[block == b] @ theta
    before = float(np.sum(r**2))
    return (1.0 - float(np.sum((r - out) ** 2)) / before if before > 0 else 0.0), out


def dependence(
    r: Array, signals: Mapping[str, Array], up: BoolArray, block: IntArray
) -> Dependence:
    """Signals on which a whitened residual (n,) depends, most of all first.

    signals: at the rows, (n,) each; up: moves in positive direction; block: stretches of time,
    left out in turn. Each signal may act otherwise in the two directions.
    """
    best = {name: smooth_share(r, x, up, block) for name, x in signals.items()}
    order = sorted(best, key=lambda name: -best[name][0])
    if not order or best[order[0]][0] < LEAST:
        return Dependence((), max(0.0, best[order[0]][0]) if order else 0.0)
    left = r - best[order[0]][1]
    named = [order[0]]
    for name in order[1:]:
        if best[name][0] > LEAST / 2 and smooth_share(left, signals[name], up, block)[0] > ADDED:
            named.append(name)
    return Dependence(tuple(named[:MOST]), best[order[0]][0])


def smooth_share(r: Array, x: Array, up: BoolArray, block: IntArray) -> tuple[float, Array]:
    """The better of a coarse and a fine function of one signal and the direction."""
    found = []
    for levels in BINS:
        if len(r) < 20 * levels:
            continue
        columns = hats(x, levels)
        both = np.column_stack([columns * up[:, np.newaxis], columns * ~up[:, np.newaxis]])
        found.append(explained_by(r, both, block))
    return max(found, key=lambda one: one[0]) if found else (0.0, np.zeros(len(r)))
