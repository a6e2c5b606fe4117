"""How probable an effect that is named is: less where more is left, of several, beside equals."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from identification.tracing.probability import evidence, is_probable, probability

SHARES = st.floats(0.0, 2.0)


@given(SHARES, SHARES, SHARES, st.integers(1, 4))
def test_the_more_is_left_the_less_probable(
    force: float, error: float, other: float, named: int
) -> None:
    less, more = sorted((error, other))
    mine = [probability(evidence(force, left, named)) for left in (less, more)]
    assert 0.0 < mine[1] <= mine[0] < 1.0
    less, more = sorted((force, other))
    mine = [probability(evidence(left, error, named)) for left in (less, more)]
    assert mine[1] <= mine[0]


@given(SHARES, SHARES)
def test_several_are_less_probable_than_one(force: float, error: float) -> None:
    one, two = (probability(evidence(force, error, named)) for named in (1, 2))
    assert two < one
    assert probability(evidence(force, error, 3)) == two


def test_what_explains_all_is_probable_and_several_that_leave_much_are_not() -> None:
    assert is_probable(probability(evidence(1e-3, 1e-3, 1)))
    assert not is_probable(probability(evidence(0.3, 0.1, 3)))


def test_rivals_share_a_probability() -> None:
    terms = evidence(1e-3, 1e-3, 1)
    assert probability(terms, alike=2) == pytest.approx(probability(terms) / 3.0)


def test_without_a_force_the_error_speaks_for_it() -> None:
    assert evidence(None, 0.05, 1) == evidence(0.05, 0.05, 1)
    assert np.all(np.isfinite(evidence(0.0, 0.0, 1)))
