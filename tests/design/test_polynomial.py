import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from design.polynomial import (
    as_polynomial,
    check_period,
    common_roots,
    divide,
    evaluate,
    frequency_and_damping,
    from_roots,
    multiply,
    roots,
    second_order,
    trim,
)
from identification.arrays import Array
from identification.errors import BadSpecification
from tests.design.strategies import stable_polynomial


@given(stable_polynomial(), stable_polynomial())
def test_product_evaluates_to_the_product(c: Array, d: Array) -> None:
    z = np.exp(1j * np.linspace(0, np.pi, 7))
    np.testing.assert_allclose(
        evaluate(multiply(c, d), z), evaluate(c, z) * evaluate(d, z), atol=1e-9
    )


@given(stable_polynomial(), stable_polynomial(1, 4))
def test_division_undoes_multiplication(c: Array, d: Array) -> None:
    quotient, rest = divide(multiply(c, d), d)
    assert rest < 1e-12
    np.testing.assert_allclose(quotient, c, atol=1e-7 * np.abs(c).max())


@given(st.floats(0.1, 300), st.floats(0, 5), st.floats(1e-4, 1e-2))
def test_second_order_maps_the_continuous_roots(w_n: float, zeta: float, h: float) -> None:
    s = np.roots([1, 2 * zeta * w_n, w_n**2]).astype(complex)
    np.testing.assert_allclose(
        second_order(w_n, zeta, h), np.poly(np.exp(s * h)).real, rtol=1e-6, atol=1e-6
    )


def test_second_order_is_continuous_at_critical_damping() -> None:
    below, at = second_order(20.0, 1 - 1e-12, 0.01), second_order(20.0, 1.0, 0.01)
    np.testing.assert_allclose(below, at, rtol=1e-9)


@given(st.floats(1, 200), st.floats(0.01, 0.99))
def test_frequency_and_damping_read_back(w_n: float, zeta: float) -> None:
    z = roots(second_order(w_n, zeta, 0.01))[0]
    assert frequency_and_damping(complex(z), 0.01) == pytest.approx((w_n, zeta), rel=1e-6)


@pytest.mark.slow
@given(stable_polynomial(1, 3), stable_polynomial(1, 3), stable_polynomial(1, 2))
def test_common_factor_is_found(c: Array, d: Array, factor: Array) -> None:
    shared = common_roots(multiply(c, factor), multiply(d, factor))
    assert shared.size >= factor.size - 1


def test_no_common_factor_where_roots_differ() -> None:
    assert common_roots(from_roots([0.5, 0.2]), from_roots([0.5001, -0.3])).size == 0


def test_common_double_root_counts_twice() -> None:
    assert common_roots(from_roots([0.9, 0.9, 0.1]), from_roots([0.9, 0.9, -0.4])).size == 2


def test_trim() -> None:
    assert trim(np.array([1.0, 2.0, 0.0])).tolist() == [1.0, 2.0]
    assert trim(np.zeros(3)).tolist() == [0.0]
    assert trim(np.array([1.0, 1e-20]), 1e-15).tolist() == [1.0]


@pytest.mark.parametrize("bad", [[], [[1.0, 2.0]], [np.nan], [np.inf, 1], ["a"], [1j], None])
def test_bad_coefficients_are_refused(bad: list[float]) -> None:
    with pytest.raises(BadSpecification, match=r"^B: "):
        as_polynomial(bad, "B")


@pytest.mark.parametrize("h", [0.0, -0.01, np.nan, np.inf, None])
def test_bad_period_is_refused(h: float) -> None:
    with pytest.raises(BadSpecification, match="sampling period"):
        check_period(h)


@pytest.mark.parametrize(
    ("w_n", "zeta", "text"),
    [
        (-1, 0.5, "w_n"),
        (0, 0.5, "w_n"),
        (3, -0.1, "zeta"),
        (400, 0.1, "alias"),
        (3, np.nan, "zeta"),
    ],
)
def test_bad_pole_pair_is_refused(w_n: float, zeta: float, text: str) -> None:
    with pytest.raises(BadSpecification, match=text):
        second_order(w_n, zeta, 0.01)


@pytest.mark.parametrize("bad", [[0.5 + 0.1j], [np.nan], ["x"]])
def test_bad_roots_are_refused(bad: list[complex]) -> None:
    with pytest.raises(BadSpecification):
        from_roots(bad)
