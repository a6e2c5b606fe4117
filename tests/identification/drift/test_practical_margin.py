"""The distance to a margin's box: sure and larger than the margin, in the whole covariance."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from identification.arrays import Array
from identification.drift.practical_margin import Change

TOGETHER = 1e-4 * np.array([[1.0, 0.98], [0.98, 1.0]])


def of(change: Array, covariance: Array, margin: float = 0.02) -> Change:
    return Change(("m", "F_cp", "F_cn")[: len(change)], change, covariance, margin)


def test_a_change_inside_the_margin_is_none_however_sure() -> None:
    found = of(np.array([0.019, -0.01]), 1e-12 * np.eye(2))
    assert found.square == 0.0


def test_one_parameter_counts_in_deviations_beyond_the_margin() -> None:
    found = of(np.array([0.05]), np.array([[1e-4]]))
    assert found.square == pytest.approx(9.0)


def test_a_free_parameter_takes_its_change_and_what_goes_with_it() -> None:
    change = np.array([0.1, 0.1])
    assert of(change, TOGETHER).square > 30.0
    alone = of(change, np.diag(np.diag(TOGETHER)))
    assert of(change, TOGETHER).without((0,)) < alone.without((0,))


def test_errors_that_go_together_make_a_common_change_less_sure_and_a_contrary_one_surer() -> None:
    alone = np.diag(np.diag(TOGETHER))
    same, contrary = np.array([0.055, 0.055]), np.array([0.055, -0.055])
    assert of(same, TOGETHER).square < 0.6 * of(same, alone).square
    assert of(contrary, TOGETHER).square > 10 * of(contrary, alone).square


def test_the_fewest_that_explain_a_change_are_named() -> None:
    # The second lies 2.5 deviations beyond its margin, by the error that it shares with the first.
    assert of(np.array([0.1, 0.045]), TOGETHER).moved() == (0,)
    assert of(np.array([0.1, 0.08]), TOGETHER).moved() == (0, 1)


@given(
    st.lists(st.floats(-0.3, 0.3), min_size=3, max_size=3),
    st.floats(-0.9, 0.9),
    st.floats(0.0, 0.1),
)
def test_a_wider_margin_never_counts_more(change: list[float], rho: float, more: float) -> None:
    x = np.array(change)
    covariance = 1e-4 * (np.eye(3) + rho * (np.eye(3, k=1) + np.eye(3, k=-1)) / 2)
    narrow = of(x, covariance).square
    wide = of(x, covariance, 0.02 + more).square
    whole = float(x @ np.linalg.solve(covariance, x))
    assert 0.0 <= wide <= narrow * (1 + 1e-6) + 1e-9
    assert narrow <= whole * (1 + 1e-6) + 1e-9
