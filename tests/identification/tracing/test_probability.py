"""How probable an effect that is named is: less where more is left, of several, beside equals."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from identification.tracing.probability import evidence, is_probable, probability

SHARES = st.floats(0.0, 2.0)


@given(SHARES, SHARES, st.integers(1, 4))
def test_the_more_is_left_the_less_probable(left: float, other: float, named: int) -> None:
    mine = [probability(evidence(one, named)) for one in sorted((left, other))]
    assert 0.0 < mine[1] <= mine[0] < 1.0


@given(SHARES)
def test_several_are_less_probable_than_one(left: float) -> None:
    one, two, three = (probability(evidence(left, named)) for named in (1, 2, 3))
    assert three < two < one


def test_what_explains_all_is_probable_and_several_that_leave_much_are_not() -> None:
    assert is_probable(probability(evidence(1e-3, 1)))
    assert not is_probable(probability(evidence(0.3, 3)))
    assert np.isfinite(evidence(0.0, 1)[1])


def test_rivals_share_a_probability() -> None:
    terms = evidence(1e-3, 1)
    assert probability(terms, alike=2) == pytest.approx(probability(terms) / 3.0)
