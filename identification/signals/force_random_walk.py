"""Random-walk drift of an actuator's force from what its logged command makes of it.

Noise of the logged command did not reach the valve: k1 times it adds up to a random walk of the
force beside the model's, held back by the actuator's k2 alone. The measured force less
k1 times the command's integral plus k2 y is then a random walk in white noise (a local level;
Durbin, Koopman, Time Series Analysis by State Space Methods, 2012, section 2). Its likelihood has
the closed form of a filter of gain g, in which k1, k2, an offset of the rate and a start are
linear. What is not white after it is no noise, but something that the model lacks.
"""

import numpy as np
from scipy.signal import lfilter
from scipy.stats import chi2

from identification.arrays import Array
from identification.thresholds import BEYOND_CHANCE

# Of the filter, that are tried beside 0: beyond 1 where a step of the walk shows in two samples, as
# where the command is taken between its samples.
FILTER_GAINS = (np.geomspace(1e-4, 0.97, 60), np.linspace(1.03, 1.9, 15))
LAGS = 12  # over which what is left is to be white
CHANCE = 1e-4  # chance below which it is not
COUNTED = 3000  # values as which a log counts: with more, a correlation of no account would show
LEAST_COMPARED = 60  # samples, from which anything is estimated


def force_random_walk(F: Array, y: Array, impulse: Array, h: float, apart: float) -> float:
    """Standard deviation [N] of the walk's step in one sample of h [s], 0 where none shows.

    F [N], y [m] (smoothed: its noise times k2 may be far more than the force's), impulse [V s]
    (integral of the command up to each sample): (n,); apart [s]: time over which the smoothing
    draws errors together, so that samples so far apart are compared.
    """
    step = max(1, round(apart / h))
    x = np.asarray(F)[::step]
    n = len(x)
    if n < LEAST_COMPARED:
        return 0.0
    X = np.column_stack([impulse[::step], y[::step], np.arange(n) / n, np.ones(n)])
    X = X / np.maximum(np.linalg.norm(X, axis=0), 1e-300)
    plain = n * np.log(float(np.mean(_filtered(x, X, 0.0) ** 2)))
    best: tuple[float, float] | None = None  # cost, and step of the walk
    for gains in FILTER_GAINS:
        found = [_filtered(x, X, float(gain)) for gain in gains]
        costs = [n * np.log(float(np.mean(r**2))) for r in found]
        i = int(np.argmin(costs))
        if (best is None or costs[i] < best[0]) and shows(plain - costs[i]) and _white(found[i]):
            # Of innovations of variance S the walk has g^2 S in each step.
            best = costs[i], float(gains[i]) * float(np.sqrt(np.mean(found[i] ** 2)))
    return 0.0 if best is None else best[1] / float(np.sqrt(step))


def shows(gained: float) -> bool:
    """Whether a walk that gains so much (twice the log-likelihood) is more than chance."""
    return gained > BEYOND_CHANCE**2


def _filtered(x: Array, X: Array, gain: float) -> Array:
    """Innovations (n,) of a local level of this gain in x (n,), less the columns X (n, k)."""
    b, a = [1.0, -1.0], [1.0, gain - 1.0]
    if gain == 0.0:
        b, a = [1.0], [1.0]
    own, columns = lfilter(b, a, x), lfilter(b, a, X, axis=0)
    return np.asarray(own - columns @ np.linalg.lstsq(columns, own, rcond=1e-12)[0])


def _white(r: Array) -> bool:
    """Whether nothing draws the values r (n,) together (Ljung, Box, Biometrika 65 (1978) 297).

    What smoothing leaves between neighbours is negative and slight, and does not count.
    """
    n = min(len(r), COUNTED)
    rho = np.array([np.dot(r[lag:], r[:-lag]) for lag in range(1, LAGS + 1)]) / np.dot(r, r)
    rho = np.maximum(rho, 0.0)
    statistic = n * (n + 2) * float(np.sum(rho**2 / (n - np.arange(1, LAGS + 1))))
    return statistic <= float(chi2.ppf(1.0 - CHANCE, LAGS))


def corrected_share(random_walk: float, noise: float) -> float:
    """Share g of its distance to the measured force by which a run's force is best corrected at
    every sample: the steady gain of a Kalman filter of a random walk in white noise."""
    if random_walk <= 0.0 or noise <= 0.0:
        return 0.0
    q, R = random_walk**2, noise**2
    before = 0.5 * (q + np.sqrt(q * q + 4.0 * q * R))
    return float(before / (before + R))
