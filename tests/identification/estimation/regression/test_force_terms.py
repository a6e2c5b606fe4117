"""The fewest terms of friction that predict the force."""

import numpy as np
import pytest

from identification.estimation.regression.equation_rows import FIVE
from identification.estimation.regression.force_terms import fewest_terms
from identification.estimation.regression.weighted_rows import Rows

VISCOUS = (0, 3, 4)  # columns of mass and viscous friction


def sliding_rows(levels: float, viscous: float, noise: float) -> list[Rows]:
    """Rows of a body of 0.14 kg in swings of many speeds, its force with this white noise."""
    rng, n = np.random.default_rng(2), 300
    v, a = 2.0 * rng.standard_normal(n), 5.0 * rng.standard_normal(n)
    up = v > 0.0
    X = np.column_stack([a, 1.0 * up, -1.0 * ~up, v * up, v * ~up])
    b = X @ np.array([0.14, levels, levels, viscous, viscous]) + noise * rng.standard_normal(n)
    sd, blocks = np.full(n, 1e-6), np.arange(n) // 30
    return [Rows(b, X, sd, blocks, np.abs(v), FIVE)]


@pytest.mark.parametrize("level", [-1e-3, 0.0])
def test_a_level_by_which_the_equation_errs_is_no_friction_below_none(level: float) -> None:
    """A motor that nothing rubs, held by a sine: its Coulomb level of -0.1 % of the force was
    significant beside so little noise, and two levels were fitted that are not there."""
    assert fewest_terms(sliding_rows(level, 0.065, 1e-4)).used == VISCOUS


def test_a_level_well_below_none_is_no_viscous_friction_alone() -> None:
    assert fewest_terms(sliding_rows(-0.05, 0.065, 1e-4)).used != VISCOUS
