"""The distance to a margin's box: sure and larger than the margin, in the whole covariance."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from identification.drift.practical_margin import beyond_margin, explained_change, moved

TOGETHER = 1e-4 * np.array([[1.0, 0.98], [0.98, 1.0]])
MARGIN = np.array([0.02, 0.02])


def test_a_change_inside_the_margin_is_none_however_sure() -> None:
    found = beyond_margin(np.array([0.019, -0.01]), 1e-12 * np.eye(2), MARGIN)
    assert found.square == 0.0


def test_one_parameter_counts_in_deviations_beyond_the_margin() -> None:
    found = beyond_margin(np.array([0.05]), np.array([[1e-4]]), np.array([0.02]))
    assert found.square == pytest.approx(9.0)
    assert found.nearest == pytest.approx([0.02])


def test_a_free_parameter_takes_its_change_and_what_goes_with_it() -> None:
    change = np.array([0.1, 0.1])
    assert beyond_margin(change, TOGETHER, MARGIN).square > 30.0
    assert (
        beyond_margin(change, TOGETHER, MARGIN, (0,)).square
        < beyond_margin(change, np.diag(np.diag(TOGETHER)), MARGIN, (0,)).square
    )


def test_errors_that_go_together_make_a_common_change_less_sure_and_a_contrary_one_surer() -> None:
    alone = np.diag(np.diag(TOGETHER))
    same, contrary = np.array([0.055, 0.055]), np.array([0.055, -0.055])
    assert (
        beyond_margin(same, TOGETHER, MARGIN).square
        < 0.6 * beyond_margin(same, alone, MARGIN).square
    )
    assert (
        beyond_margin(contrary, TOGETHER, MARGIN).square
        > 10 * beyond_margin(contrary, alone, MARGIN).square
    )


def test_the_fewest_that_explain_a_change_are_named() -> None:
    # The second lies 2.5 deviations beyond its margin, by the error that it shares with the first.
    assert moved(np.array([0.1, 0.045]), TOGETHER, MARGIN) == (0,)
    assert moved(np.array([0.1, 0.08]), TOGETHER, MARGIN) == (0, 1)


def test_the_size_is_that_with_the_others_in_the_margin() -> None:
    size, covariance = explained_change(np.array([0.1, 0.0]), 1e-4 * np.eye(2), MARGIN, (0,))
    assert size == pytest.approx([0.1])
    assert covariance == pytest.approx(np.array([[1e-4]]))


def test_nothing_judged_is_no_distance() -> None:
    assert beyond_margin(np.zeros(0), np.zeros((0, 0)), np.zeros(0)).square == 0.0


@given(
    st.lists(st.floats(-0.3, 0.3), min_size=3, max_size=3),
    st.floats(-0.9, 0.9),
    st.floats(0.0, 0.1),
)
def test_a_wider_margin_never_counts_more(change: list[float], rho: float, more: float) -> None:
    x = np.array(change)
    covariance = 1e-4 * (np.eye(3) + rho * (np.eye(3, k=1) + np.eye(3, k=-1)) / 2)
    narrow = beyond_margin(x, covariance, np.full(3, 0.02)).square
    wide = beyond_margin(x, covariance, np.full(3, 0.02 + more)).square
    whole = float(x @ np.linalg.solve(covariance, x))
    assert 0.0 <= wide <= narrow * (1 + 1e-6) + 1e-9
    assert narrow <= whole * (1 + 1e-6) + 1e-9
