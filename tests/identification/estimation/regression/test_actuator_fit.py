"""The actuator regression."""

import numpy as np
import pytest

from identification.estimation.regression.actuator_fit import fit_actuator
from tests.identification.plants import ACTUATOR, made_log, table


def test_k1_and_k2_are_found_within_their_spread() -> None:
    fit = fit_actuator([made_log(table(1), seed=1), made_log(table(3), seed=2)])
    assert fit.plausible
    assert fit.k1 == pytest.approx(ACTUATOR.k1, rel=2e-3)
    assert fit.k2 == pytest.approx(ACTUATOR.k2, rel=2e-3)
    assert fit.relative < 0.02


def test_a_command_that_does_nothing_is_not_plausible() -> None:
    log = made_log(table(1), seed=1)
    rng = np.random.default_rng(0)
    assert not fit_actuator([log.with_signals(u=rng.standard_normal(len(log)))]).plausible
