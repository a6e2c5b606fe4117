"""Rows of a regression and their outliers."""

from dataclasses import replace

import numpy as np
import pytest

from identification.arrays import Array, BoolArray
from identification.estimation.regression.weighted_rows import (
    Rows,
    robust,
    solve_rows,
    with_model_error,
)

TRUTH = np.array([2.0, -1.0, 0.5])


def rows_of(noise: float, added: float = 0.0) -> tuple[Rows, BoolArray]:
    """400 rows of three coefficients; one in six has `added` to it, most where the first column is
    large; and which these are."""
    rng = np.random.default_rng(7)
    X = rng.standard_normal((400, 3))
    spoilt = np.arange(400) % 6 == 0
    b = X @ TRUTH + noise * rng.standard_normal(400) + added * spoilt * np.abs(X[:, 0])
    blank = np.ones(400)
    return Rows(b, X, 0.1 * blank, np.arange(400) // 50, blank, ("a", "b", "c")), spoilt


def of(rows: Rows) -> Array:
    return solve_rows(rows).theta


def test_normal_errors_are_no_outliers() -> None:
    rows, _ = rows_of(0.1)
    weight = rows.sd / robust(rows).sd
    assert np.mean(weight) > 0.9 and np.min(weight) > 0.0
    assert of(robust(rows)) == pytest.approx(of(rows), abs=0.003)


@pytest.mark.parametrize("added", [2.0, 20.0])
def test_rows_that_hold_what_no_sample_has_do_not_move_the_fit(added: float) -> None:
    rows, spoilt = rows_of(0.02, added)
    assert np.max(np.abs(of(rows) - TRUTH)) > 0.05
    assert of(robust(rows)) == pytest.approx(TRUTH, abs=0.005)
    weight = rows.sd / robust(rows).sd
    assert np.mean(weight[spoilt]) < 0.2 < 0.8 < np.mean(weight[~spoilt])


def test_a_row_eight_deviations_off_counts_for_nothing() -> None:
    rows, spoilt = rows_of(0.1)
    off = replace(rows, b=rows.b + 0.8 * spoilt)
    weight = off.sd / robust(off).sd
    assert np.median(weight[spoilt]) < 0.01 and np.median(weight[~spoilt]) > 0.9


def test_rows_without_errors_have_no_outliers_but_beyond_what_the_equation_errs() -> None:
    rows, _ = rows_of(0.0, 1e-3)
    assert np.all(rows.sd / robust(rows).sd > 0.9)
    rows, _ = rows_of(0.0, 1.0)
    assert of(robust(rows)) == pytest.approx(TRUTH, abs=1e-4)


def test_rows_that_err_by_their_noise_alone_have_no_model_error() -> None:
    rows, _ = rows_of(0.1)
    wider = with_model_error(rows)
    assert wider.sd == pytest.approx(rows.sd, rel=0.1)
    assert with_model_error(replace(rows, sd=2.0 * rows.sd)).sd == pytest.approx(2.0 * rows.sd)


def test_the_log_of_the_finest_sensor_does_not_decide_where_the_equation_errs() -> None:
    """One log in ten has a hundredth of the noise, and all lack the same force of 0.5."""
    rows, _ = rows_of(0.01, 0.0)
    fine = np.arange(400) % 10 == 0
    lacks = 0.5 * np.random.default_rng(3).standard_normal(400)
    rows = replace(rows, b=rows.b + lacks, sd=np.where(fine, 1e-4, 1e-2))
    wider = with_model_error(rows)
    assert wider.sd == pytest.approx(np.full(400, 0.5), rel=0.1)
    assert np.max(np.abs(of(rows) - TRUTH)) > 2.0 * np.max(np.abs(of(wider) - TRUTH))
    left = (wider.b - wider.X @ of(wider)) / wider.sd
    assert np.sum(left**2) == pytest.approx(397.0, rel=1e-2)
    small = with_model_error(replace(rows, b=1e-9 * rows.b, X=1e-9 * rows.X, sd=1e-9 * rows.sd))
    assert small.sd == pytest.approx(1e-9 * wider.sd, rel=1e-3)
