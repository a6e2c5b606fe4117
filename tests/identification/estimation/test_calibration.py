"""The truth lies in posteriors as their width says, and would not if the noise were another.

A small version of benchmarks/calibration.py: where the rank of a truth among the draws is uniform,
the square of its normal deviate is 1 in the mean.
"""

from collections.abc import Sequence

import numpy as np
import pytest
from scipy.stats import norm

from benchmarks.calibration import drawn
from identification.estimation import likelihood
from identification.model.karnopp import NAMES

SECONDS = 2.5  # of a log
OUTERMOST = 1e-3  # rank of a truth beyond every draw


def mean_square(seeds: Sequence[int]) -> float:
    """Of the normal deviates of the nine's ranks, over the machines of the seeds."""
    ranks = [drawn("none", seed, SECONDS, True).posterior for seed in seeds]
    assert all(set(one) == set(NAMES) for one in ranks), "a sampling has not converged"
    of_law = np.array([list(one.values()) for one in ranks])
    return float(np.mean(norm.ppf(np.clip(of_law, OUTERMOST, 1.0 - OUTERMOST)) ** 2))


@pytest.mark.method
def test_with_the_noise_of_the_logs_ranks_are_uniform() -> None:
    assert 0.5 < mean_square(range(700, 706)) < 2.0


@pytest.mark.method
@pytest.mark.parametrize(("factor", "low", "high"), [(2.0, 2.0, np.inf), (0.5, 0.0, 0.5)])
def test_a_wrong_noise_is_seen(
    monkeypatch: pytest.MonkeyPatch, factor: float, low: float, high: float
) -> None:
    monkeypatch.setattr(likelihood, "AS_NOISE", factor**2 * likelihood.AS_NOISE)
    assert low < mean_square(range(700, 703)) < high
