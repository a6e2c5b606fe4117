"""R-hat and effective sample size: as arviz has them, and what they say of chains of known kind."""

import importlib
import importlib.util
import warnings
from typing import Any

import numpy as np
import pytest

from identification.arrays import Array
from identification.estimation.convergence import bulk_ess, rank_r_hat


def walk(share: float, chains: int, draws: int, seed: int = 1) -> Array:
    """Chains (chains, draws) that keep so much of the draw before, of unit variance."""
    rng = np.random.default_rng(seed)
    x = rng.standard_normal((chains, draws))
    for k in range(1, draws):
        x[:, k] = share * x[:, k - 1] + np.sqrt(1.0 - share**2) * x[:, k]
    return x


@pytest.mark.slow
@pytest.mark.skipif(importlib.util.find_spec("arviz") is None, reason="the extra arviz")
@pytest.mark.parametrize(("share", "chains", "draws"), [
    (0.0, 4, 500), (0.5, 4, 501), (0.9, 4, 2000), (-0.4, 4, 300), (0.9, 64, 200),
])  # fmt: skip
def test_the_figures_are_those_of_arviz(share: float, chains: int, draws: int) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what its own imports say of versions to come
        arviz: Any = importlib.import_module("arviz")

    x = np.exp(walk(share, chains, draws))  # not normal: the ranks have to tell
    assert rank_r_hat(x) == pytest.approx(float(arviz.rhat(x, method="rank")), rel=1e-9)
    assert bulk_ess(x) == pytest.approx(float(arviz.ess(x, method="bulk")), rel=0.03)


def test_independent_draws_count_in_full_and_kept_ones_less() -> None:
    assert bulk_ess(walk(0.0, 4, 2000)) == pytest.approx(8000, rel=0.1)
    assert bulk_ess(walk(0.8, 4, 4000)) == pytest.approx(16000 / 9.0, rel=0.2)


def test_a_chain_elsewhere_and_one_that_is_wider_are_seen() -> None:
    alike = walk(0.0, 4, 1000)
    assert rank_r_hat(alike) < 1.005
    assert rank_r_hat(alike + np.array([[0.0], [0.0], [0.0], [0.7]])) > 1.03
    assert rank_r_hat(alike * np.array([[1.0], [1.0], [1.0], [3.0]])) > 1.03


def test_a_chain_that_wanders_off_is_seen_in_its_halves() -> None:
    assert rank_r_hat(walk(0.0, 4, 1000) + np.linspace(0.0, 2.0, 1000)) > 1.05


def test_too_short_or_standing_chains_tell_nothing() -> None:
    assert rank_r_hat(walk(0.0, 4, 7)) == np.inf
    assert bulk_ess(walk(0.0, 4, 7)) == 0.0
    assert rank_r_hat(np.arange(4.0)[:, np.newaxis] * np.ones(50)) == np.inf
