"""How far chains of a sampler agree, and how many independent draws they are worth.

Rank-normalised split R-hat and bulk effective sample size of Vehtari, Gelman, Simpson, Carpenter,
Bürkner, Bayesian Analysis 16 (2021) 667, as arviz has them, so that no more than numpy is needed.
"""

import numpy as np
from scipy.stats import norm, rankdata

from identification.arrays import Array

FEWEST_DRAWS = 8  # of a chain, whose halves have a spread of their own


def rank_r_hat(chains: Array) -> float:
    """Rank-normalised split R-hat of chains (c, n): 1 where all agree.

    The larger of that of the draws and that of their distances from the median, which is large of
    chains that agree in the middle but not in the tails. Infinite of chains too short for it.
    Source: Vehtari et al., Bayesian Analysis 16 (2021) 667.
    """
    if chains.shape[1] < FEWEST_DRAWS:
        return float("inf")
    halves = _split(chains)
    folded = np.abs(halves - np.median(halves))
    return max(_r_hat(_normal_ranks(halves)), _r_hat(_normal_ranks(folded)))


def bulk_ess(chains: Array) -> float:
    """Independent draws that chains (c, n) are worth in their bulk; 0 of chains too short.

    Source: Vehtari et al., Bayesian Analysis 16 (2021) 667; autocorrelation time, Geyer,
    Statistical Science 7 (1992) 473.
    """
    if chains.shape[1] < FEWEST_DRAWS:
        return 0.0
    z = _normal_ranks(_split(chains))
    c, n = z.shape
    covariance = _autocovariance(z)
    within = float(np.mean(covariance[:, 0])) * n / (n - 1.0)
    total = within * (n - 1.0) / n + float(np.var(np.mean(z, axis=1), ddof=1))
    if not total > 0.0:
        return 0.0
    rho = 1.0 - (within - np.mean(covariance, axis=0)) / total
    rho[0] = 1.0
    return float(c * n / max(_time(rho), 1.0 / float(np.log10(c * n))))


def _split(chains: Array) -> Array:
    """The chains' halves as chains of their own, (2 c, n // 2)."""
    half = chains.shape[1] // 2
    return np.concatenate([chains[:, :half], chains[:, -half:]])


def _normal_ranks(chains: Array) -> Array:
    """The draws by their ranks, as if they were normal."""
    ranks = rankdata(chains, method="average").reshape(chains.shape)
    return np.asarray(norm.ppf((ranks - 0.375) / (chains.size + 0.25)))


def _r_hat(z: Array) -> float:
    n = z.shape[1]
    within = float(np.mean(np.var(z, axis=1, ddof=1)))
    between = float(np.var(np.mean(z, axis=1), ddof=1))
    if not within > 0.0:
        return float("inf")
    return float(np.sqrt((n - 1.0) / n + between / within))


def _autocovariance(z: Array) -> Array:
    """Of chains (c, n) at all lags, (c, n)."""
    n = z.shape[1]
    spectrum = np.fft.rfft(z - np.mean(z, axis=1, keepdims=True), n=2 * n, axis=1)
    return np.asarray(np.fft.irfft(np.abs(spectrum) ** 2, n=2 * n, axis=1)[:, :n] / n)


def _time(rho: Array) -> float:
    """Autocorrelation time of correlations (n,): Geyer's (1992) sum of pairs, falling and positive,
    with the last even one once."""
    pairs = rho[: len(rho) - len(rho) % 2].reshape(-1, 2).sum(axis=1)[: (len(rho) - 1) // 2]
    negative = np.flatnonzero(pairs[1:] <= 0.0)
    last = int(negative[0]) + 1 if len(negative) else len(pairs)
    falling = np.minimum.accumulate(pairs[:last])
    after = float(rho[2 * last]) if 2 * last < len(rho) else 0.0
    return float(-1.0 + 2.0 * np.sum(falling) + max(after, 0.0))
