"""P-PI cascades tuned on plants: margins on all of them, what a notch buys, who is refused."""

import numpy as np
import pytest

from design.cascade import bandwidth_of, tune_cascade
from design.elastic import Swing, elastic_plant
from design.linear import linear_plant
from design.margins import margins, modulus_margin
from design.polynomial import evaluate
from design.series_filters import filters_against
from design.tune import Goals
from identification.arrays import Array
from identification.errors import BadSpecification

M, F_V, H = 2.0, 5.0, 1e-3
SWING = Swing.of_two_masses(90.0, 60.0, 0.015)


def late(plant: tuple[Array, Array], samples: int = 2) -> tuple[Array, Array]:
    return plant[0], np.concatenate([np.zeros(samples), plant[1]])


def two_masses(frequency: float = 1.0, mass: float = 1.0) -> tuple[Array, Array]:
    return late(elastic_plant(mass * M, F_V, H, [SWING.times(frequency)]))


PLANTS = [two_masses(), two_masses(0.98, 1.02), two_masses(1.02, 0.98)]
SWINGS = (90.0, 60.0)


def test_the_margins_hold_on_every_plant_and_the_gains_make_the_controller() -> None:
    found = tune_cascade(PLANTS, H, M, Goals(), swings=SWINGS)
    assert found.missed == () and found.series is None
    assert all(modulus_margin(A, B, found.rst) >= 0.499 for A, B in PLANTS)
    exact = margins(*PLANTS[0], found.rst)
    assert exact.delay_s is not None and exact.delay_s >= 2.0 * H
    np.testing.assert_allclose(found.gains.rst(H).R, found.rst.R[: len(found.gains.rst(H).R)])


def test_a_filter_makes_the_loop_on_two_masses_clearly_faster() -> None:
    plain = tune_cascade(PLANTS, H, M, Goals(), swings=SWINGS)
    filters = list(filters_against(SWING.resonance, SWING.damping, H))
    found = tune_cascade(PLANTS, H, M, Goals(), filters=filters, swings=SWINGS)
    assert found.series is not None and found.missed == ()
    assert all(modulus_margin(A, B, found.rst) >= 0.499 for A, B in PLANTS)
    assert found.bandwidth > 1.5 * plain.bandwidth


def test_bandwidth_is_where_the_sensitivity_comes_to_minus_three_decibels() -> None:
    A, B = late(linear_plant(M, F_V, H))
    found = tune_cascade([(A, B)], H, M, Goals())
    z = np.exp(2j * np.pi * np.array([found.bandwidth]) * H)
    back = evaluate(A, z) * evaluate(found.rst.S, z)
    S = np.abs(back / (back + evaluate(B, z) * evaluate(found.rst.R, z)))[0]
    assert 20.0 * np.log10(S) == pytest.approx(-3.0, abs=0.05)
    assert bandwidth_of(A, B, found.rst) == found.bandwidth


def test_noise_bounds_the_gains() -> None:
    A, B = late(linear_plant(M, F_V, H))
    free = tune_cascade([(A, B)], H, M, Goals())
    most = margins(A, B, free.rst).S_up_max_db
    assert most is not None
    bound = tune_cascade([(A, B)], H, M, Goals(effort=most - 20.0))
    found = margins(A, B, bound.rst).S_up_max_db
    assert found is not None and found <= most - 20.0
    assert bound.bandwidth < free.bandwidth


def test_margins_that_no_cascade_keeps_are_refused() -> None:
    with pytest.raises(BadSpecification, match="no P-PI cascade"):
        tune_cascade([late(linear_plant(M, F_V, H))], H, M, Goals(modulus=0.99))
