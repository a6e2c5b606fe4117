"""The filter and smoother of a chain, against the dense Gaussian of all its samples at once."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import multivariate_normal

from identification.arrays import Array, BoolArray
from identification.signals.kalman import Chain, log_densities, smoothed

H, LENGTH = 0.01, 40


def chain(n: int, kept: float, rng: np.random.Generator) -> Chain:
    """A body pushed by a force that remembers the share `kept` of itself."""
    A = np.array([[1.0, H, H**2 / 2], [0.0, 1.0, H], [0.0, 0.0, kept]])
    A_free = np.array([[1.0, H, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, kept]])
    Q, Q_free = np.diag([1e-9, 1e-7, 1.0]), np.diag([1e-9, 1e-3, 1.0])
    c = 1e-3 * rng.standard_normal((n, 3))
    x0 = np.array([0.02, -0.1, 1.0])
    return Chain(A, Q, A_free, Q_free, c, x0, np.array([1e-4, 1.0, 10.0]))


def dense(of: Chain, free: BoolArray) -> tuple[Array, Array]:
    """Means (n, 3) and covariances (n, n, 3, 3) of all states."""
    n = len(free)
    mean, cov = np.zeros((n, 3)), np.zeros((n, n, 3, 3))
    mean[0], cov[0, 0] = of.x0, np.diag(of.P0)
    for k in range(n - 1):
        A, Q = (of.A_free, of.Q_free) if free[k] else (of.A, of.Q)
        mean[k + 1] = A @ mean[k] + of.c[k]
        for j in range(k + 1):
            cov[k + 1, j] = A @ cov[k, j]
            cov[j, k + 1] = cov[k + 1, j].T
        cov[k + 1, k + 1] = A @ cov[k, k] @ A.T + Q
    return mean, cov


@settings(deadline=None, max_examples=15)
@given(seed=st.integers(0, 10_000), kept=st.floats(0.0, 0.999), hidden=st.floats(0.0, 0.6))
def test_likelihood_and_smoothed_state_are_those_of_the_dense_gaussian(
    seed: int, kept: float, hidden: float
) -> None:
    rng = np.random.default_rng(seed)
    of = chain(LENGTH, kept, rng)
    free, seen = rng.random(LENGTH) < 0.3, rng.random(LENGTH) >= hidden
    seen[0] = True
    R = rng.uniform(1e-7, 1e-5, LENGTH)
    z = np.cumsum(1e-2 * rng.standard_normal(LENGTH))
    mean, cov = dense(of, free)
    at = np.flatnonzero(seen)
    of_z = (cov[:, :, 0, 0] + np.diag(R))[np.ix_(at, at)]
    whole = multivariate_normal(mean[at, 0], of_z, allow_singular=True).logpdf(z[at])
    assert np.sum(log_densities(z, R, seen, free, of)) == pytest.approx(whole, rel=1e-5, abs=1e-3)
    for which in range(3):
        gain = np.linalg.solve(of_z, cov[at, :, 0, which]).T
        expected = mean[:, which] + gain @ (z[at] - mean[at, 0])
        own = np.array([cov[k, k, which, which] for k in range(LENGTH)])
        variance = own - np.sum(gain * cov[at, :, 0, which].T, axis=1)
        found, sd = smoothed(z, R, seen, free, of, which)
        size = float(np.max(np.abs(expected)))
        assert found == pytest.approx(expected, abs=1e-5 * size)
        assert sd**2 == pytest.approx(variance, rel=1e-4, abs=1e-6 * float(np.max(own)))


def test_what_is_not_measured_has_no_density() -> None:
    rng = np.random.default_rng(0)
    of, nothing = chain(LENGTH, 0.9, rng), np.zeros(LENGTH, dtype=np.bool_)
    assert not np.any(log_densities(rng.random(LENGTH), np.ones(LENGTH), nothing, nothing, of))
