"""Machines drawn from what a model is not sure of, and from how it has drifted."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from design.robust.outcomes import drawn_machines, drift_found
from identification.model.estimates import Estimate
from tests.chain import TABLES, model_of

MODEL = model_of(TABLES["paper_table2"], k_a=35.0, spread=0.02)


def estimated(*values: float, sd: float = 0.0) -> list[dict[str, Estimate]]:
    return [{"F_cp": Estimate(value, "N", sd, None, None)} for value in values]


def test_they_spread_as_the_models_errors() -> None:
    plants = drawn_machines(MODEL, np.random.default_rng(3), 2000).plants
    coulomb = np.array([one.friction.F_cp for one in plants])
    assert np.mean(coulomb) == pytest.approx(16.97, rel=2e-3)
    assert np.std(coulomb) == pytest.approx(0.02 * 16.97, rel=0.06)


def test_drift_widens_what_has_drifted_and_nothing_else() -> None:
    tight = model_of(TABLES["paper_table2"], k_a=35.0, spread=1e-4)
    plants = drawn_machines(tight, np.random.default_rng(3), 2000, {"F_cp": 0.1}).plants
    coulomb = np.log([one.friction.F_cp for one in plants])
    assert np.std(coulomb) == pytest.approx(0.1, rel=0.06)
    assert np.std([one.friction.m for one in plants]) < 1e-3


def test_the_same_seed_draws_the_same_machines() -> None:
    one, other = (drawn_machines(MODEL, np.random.default_rng(7), 20).plants for _ in range(2))
    assert one == other


def test_drift_is_the_mean_square_of_the_steps() -> None:
    steps = np.log([11.0 / 10.0, 12.5 / 11.0])
    found = drift_found(estimated(10.0, 11.0, 12.5))
    assert found == {"F_cp": pytest.approx(float(np.sqrt(np.mean(steps**2))))}


def test_what_the_models_are_unsure_of_is_no_drift() -> None:
    assert drift_found(estimated(10.0, 10.2, 10.0, sd=0.3)) == {}
    drift = drift_found(estimated(10.0, 12.0, sd=0.3))["F_cp"]
    assert 0.0 < drift < drift_found(estimated(10.0, 12.0))["F_cp"]


@pytest.mark.parametrize(
    "models",
    [
        [],
        estimated(10.0),
        [{"F_cp": Estimate(None, "N", None, None, None, "one way only")}, *estimated(10.0)],
        [*estimated(10.0), {"F_cp": Estimate(12.0, "N m", 0.0, None, None)}],
        estimated(10.0, -10.0),
    ],
)
def test_models_that_cannot_be_compared_tell_no_drift(models: list[dict[str, Estimate]]) -> None:
    assert drift_found(models) == {}


@given(st.lists(st.floats(0.5, 50.0), min_size=2, max_size=6))
def test_drift_does_not_depend_on_the_unit(values: list[float]) -> None:
    found = drift_found(estimated(*values))
    scaled = [
        {"F_cp": replace(one["F_cp"], value=1e3 * (one["F_cp"].value or 0.0), unit="mN")}
        for one in estimated(*values)
    ]
    assert drift_found(scaled) == pytest.approx(found)
