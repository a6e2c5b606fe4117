"""On what a residual depends: functions of one signal at a time, or a vibration of one frequency,
tested on blocks left out."""

from collections.abc import Mapping

import numpy as np
from scipy.fft import rfft

from identification.arrays import Array, BoolArray, IntArray
from identification.thresholds import OF_ACCOUNT
from identification.tracing.result import Dependence

BINS = (3, 10, 60, 200)  # levels of a signal, by quantiles; straight lines in between
FEW_VALUES = 8  # values of a signal (a switch, a gear) that are each a level of its own
MOST_SIGNALS = 3  # signals named
OVERLAPPING = 20  # rows to a level, since they share samples
SECOND_SIGNAL = 0.15  # share of what is left that a second signal must explain
FINER_FREQUENCIES = 4.0  # trial frequencies in each step that a log's length resolves
GRID_PLACES = 4  # of the even grid, on which rows are put, to a row
HARMONICS = 3  # of a motion, in which what depends on it may vibrate
SWINGS = 200  # rows; of fewer, the frequency that fits best does so by chance
ROWS_IN_PERIOD = 4.0  # rows in a period


def hats(x: Array, levels: int) -> Array:
    """Piecewise linear functions of `x` over its quantiles, (n, k).

    Source: linear B-splines, de Boor, A Practical Guide to Splines (1978).
    """
    values = np.unique(x)
    if len(values) <= FEW_VALUES:
        return np.asarray(x[:, np.newaxis] == values, dtype=np.float64)
    knots = np.unique(np.quantile(x, np.linspace(0.0, 1.0, levels)))
    if len(knots) < 3:
        return np.ones((len(x), 1))
    return np.column_stack([np.interp(x, knots, row) for row in np.eye(len(knots))])


def explained_by(r: Array, X: Array, block: IntArray) -> tuple[float, Array]:
    """Share of the residual's square that X explains on blocks left out, and what it predicts.

    Source: cross-validation, Stone, J. R. Stat. Soc. B 36 (1974) 111; the slight ridge, Hoerl,
    Kennard, Technometrics 12 (1970) 55.
    """
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

    signals: at the rows, (n,) each; up: moves in positive direction; block: stretches of time, left
    out in turn. Each signal may act otherwise in the two directions. Source: cross-validation,
    Stone (1974); `README.md`, (10).
    """
    best = {name: smooth_share(r, x, up, block) for name, x in signals.items()}
    rate = frequency(r, signals["t"]) if "t" in signals and len(r) >= SWINGS else 0.0
    if rate > 0.0:
        swing = periodic_share(r, signals["t"], rate, block)
        # A periodic motion makes all that depends on place or speed periodic as well.
        apart = swing[0] > OF_ACCOUNT + max(share for share, _ in best.values())
        if apart and not _of_the_motion(signals, rate, block):
            best["t"] = swing
        else:
            rate = 0.0
    order = sorted(best, key=lambda name: -best[name][0])
    if not order or best[order[0]][0] < OF_ACCOUNT:
        return Dependence((), max(0.0, best[order[0]][0]) if order else 0.0)
    left = r - best[order[0]][1]
    named = [order[0]]
    for name in order[1:]:
        again = smooth_share(left, signals[name], up, block)
        if best[name][0] > OF_ACCOUNT / 2 and again[0] > SECOND_SIGNAL:
            named.append(name)
    return Dependence(
        tuple(named[:MOST_SIGNALS]), best[order[0]][0], rate if named[0] == "t" else 0.0
    )


def _of_the_motion(signals: Mapping[str, Array], rate: float, block: IntArray) -> bool:
    """Whether the motion itself goes at this rate [Hz], or at one of which it is a harmonic."""
    t = signals["t"]
    return any(
        periodic_share(x - np.mean(x), t, rate / harmonic, block)[0] > OF_ACCOUNT
        for x in (signals[name] for name in ("y", "v") if name in signals)
        for harmonic in range(1, HARMONICS + 1)
    )


def frequency(r: Array, t: Array) -> float:
    """Frequency [Hz] at which a residual (n,) at times t [s] vibrates most; 0 where none can be
    found.

    t begins anew at each log; a vibration has one frequency over the logs, not one phase. Source:
    periodogram, Schuster, Terrestrial Magnetism 3 (1898) 13, summed over the logs.
    """
    logs = np.split(np.arange(len(t)), np.flatnonzero(np.diff(t) < 0.0) + 1)
    longest = max(float(np.ptp(t[one])) for one in logs)
    if longest == 0.0:
        return 0.0
    step = longest / max(map(len, logs)) / GRID_PLACES
    size = round(FINER_FREQUENCIES * longest / step)
    power = np.zeros(size // 2 + 1)
    for one in logs:
        place = np.rint((t[one] - t[one[0]]) / step).astype(np.int64)
        line = np.bincount(place, r[one] - np.mean(r[one]), size)
        power += np.abs(np.asarray(rfft(line, size))) ** 2
    trial = np.arange(len(power)) / (size * step)
    seen = (trial > 1.0 / longest) & (trial < 1.0 / (ROWS_IN_PERIOD * GRID_PLACES * step))
    return float(trial[seen][np.argmax(power[seen])]) if np.any(seen) else 0.0


def periodic_share(r: Array, t: Array, rate: float, block: IntArray) -> tuple[float, Array]:
    """As `smooth_share`, of a vibration at this rate [Hz] whatever the motion does.

    Source: as `explained_by`, Stone (1974).
    """
    log = np.cumsum(np.concatenate([[False], np.diff(t) < 0.0]))
    phase = 2.0 * np.pi * rate * t
    wave = np.column_stack([np.sin(phase), np.cos(phase), np.ones(len(t))])
    own = [wave * (log == k)[:, np.newaxis] for k in range(int(log[-1]) + 1)]
    return explained_by(r, np.column_stack(own), block)


def smooth_share(r: Array, x: Array, up: BoolArray, block: IntArray) -> tuple[float, Array]:
    """The better of a coarse and a fine function of one signal and the direction.

    Source: as `explained_by`, Stone (1974).
    """
    found = []
    for levels in BINS:
        if len(r) < OVERLAPPING * levels:
            continue
        columns = hats(x, levels)
        both = np.column_stack([columns * up[:, np.newaxis], columns * ~up[:, np.newaxis]])
        found.append(explained_by(r, both, block))
    return max(found, key=lambda one: one[0]) if found else (0.0, np.zeros(len(r)))
