import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from design.place import solve_diophantine
from design.polynomial import add, common_roots, from_roots, multiply, root_error, second_order
from identification.arrays import Array
from identification.errors import BadSpecification
from tests.design.strategies import plant, stable_polynomial

A_3 = from_roots([0.9, 0.5 + 0.2j, 0.5 - 0.2j])
B_3 = np.array([0.0, 0.0, 0.1, 0.05])


def residual(A: Array, B: Array, P: Array, R: Array, S: Array) -> float:
    """Largest coefficient of A S + B R - P relative to P's largest."""
    left = add(np.convolve(A, S), np.convolve(B, R))
    return float(np.abs(add(left, -P)).max() / np.abs(P).max())


def sylvester_condition(a: Array, b: Array) -> float:
    """Condition number of the equation's matrix, made by shifting columns."""
    n_s, n_r = b.size - 1, a.size - 1
    columns = [np.pad(a, (k, n_s - 1 - k)) for k in range(n_s)]
    columns += [np.pad(b, (k, n_r - 1 - k)) for k in range(n_r)]
    return float(np.linalg.cond(np.array(columns)))


@pytest.mark.slow
@given(plant(), stable_polynomial(1, 14), st.booleans(), st.booleans())
def test_closed_loop_is_as_asked(
    AB: tuple[Array, Array], P: Array, integrator: bool, notch: bool
) -> None:
    A, B = AB
    H_S = np.array([1.0, -1.0]) if integrator else np.ones(1)
    H_R = second_order(100.0, 0.1, 0.01) if notch else np.ones(1)
    a, b = multiply(A, H_S), multiply(B, H_R)
    assume(common_roots(a, b, 1e-2, 0.05).size == 0)
    before = [x.copy() for x in (A, B, P, H_R, H_S)]
    try:
        R, S = solve_diophantine(A, B, P, H_R=H_R, H_S=H_S)
    except BadSpecification as error:
        assert "ill-conditioned" in str(error)
        assert sylvester_condition(a, b / np.abs(b).max()) > 1e8
        return
    size = np.abs(A).sum() * np.abs(S).max() + np.abs(B).sum() * np.abs(R).max()
    assert residual(A, B, P, R, S) < 1e-12 + 8 * 2.3e-16 * size / np.abs(P).max()
    assert R.size <= max(a.size - 1, 1) + H_R.size - 1
    assert S.size == max(b.size - 1, P.size - (a.size - 1)) + H_S.size - 1
    assert root_error(S, 1.0) < 1e-9 or not integrator
    for x, y in zip((A, B, P, H_R, H_S), before, strict=True):
        assert np.array_equal(x, y)


@pytest.mark.slow
@given(plant(), st.integers(0, 2**32 - 1))
def test_least_degree_solution_is_the_unique_one(AB: tuple[Array, Array], seed: int) -> None:
    A, B = AB
    assume(common_roots(A, B, 1e-2, 0.05).size == 0)
    rng = np.random.default_rng(seed)
    R_0 = rng.uniform(0.5, 2, A.size - 1) / np.abs(B).max()
    S_0 = np.concatenate([[1.0], rng.uniform(0.1, 1, B.size - 2)])
    R, S = solve_diophantine(A, B, add(np.convolve(A, S_0), np.convolve(B, R_0)))
    np.testing.assert_allclose(S, S_0, atol=1e-5)
    np.testing.assert_allclose(R, R_0, rtol=1e-5, atol=1e-5 * np.abs(R_0).max())


@pytest.mark.parametrize("order", [3, 10, 20, 40])
def test_accuracy_holds_at_high_order(order: int) -> None:
    rng = np.random.default_rng(order)
    angle = rng.uniform(0.1, 3.0, order // 2)
    z = rng.uniform(0.6, 0.95, order // 2) * np.exp(1j * angle)
    A = from_roots(np.concatenate([z, z.conj(), [0.8] * (order % 2)]))
    B = np.concatenate([[0.0], 1e-3 * rng.standard_normal(order)])
    S_0 = np.concatenate([[1.0], rng.standard_normal(order - 1)])
    P = add(np.convolve(A, S_0), np.convolve(B, 10 * rng.standard_normal(order)))
    R, S = solve_diophantine(A, B, P)
    assert residual(A, B, P, R, S) < 1e-13
    np.testing.assert_allclose(S, S_0, atol=1e-7)


@pytest.mark.parametrize("delay", [0, 1, 2, 7, 30])
@pytest.mark.parametrize("degree", [0, 2, 12, 45])
def test_any_delay_and_any_degree_of_P(delay: int, degree: int) -> None:
    B = np.concatenate([np.zeros(delay), [0.1, 0.05]])
    P = from_roots(np.linspace(-0.5, 0.7, degree)) if degree else np.ones(1)
    R, S = solve_diophantine(A_3, B, P, H_S=[1, -1])
    assert residual(A_3, B, P, R, S) < 1e-10
    assert S[0] == pytest.approx(P[0]) or delay == 0


@pytest.mark.parametrize(
    ("A", "B", "P"),
    [
        ([1.0], [0.0, 0.5], [1.0, -0.3]),  # static plant with a delay: open loop, R = 0
        ([1.0, -0.5], [2.0], [1.0]),  # no delay, B one number
        ([1.0, -0.5], [2.0], [1.0, -0.2, 0.1]),  # the unique solution has S[0] = 0
        ([1.0, -0.5], [2.0], [1.0, -0.2, 0.3]),
        ([2.0, -1.0, 0.0, 0.0], [0.0, 3.0, 0.0], [1.0, -0.2]),  # A[0] not 1, trailing zeros
    ],
)
def test_degenerate_plants(A: list[float], B: list[float], P: list[float]) -> None:
    R, S = solve_diophantine(A, B, P)
    assert residual(np.array(A), np.array(B), np.array(P), R, S) < 1e-14
    assert S[0] != 0


def test_common_factor_in_P_is_divided_out() -> None:
    factor = from_roots([0.7, 0.3 + 0.4j, 0.3 - 0.4j])
    A, B, P = (
        multiply(A_3, factor),
        multiply(B_3, factor),
        multiply(np.array([1.0, -1.2, 0.4]), factor),
    )
    R, S = solve_diophantine(A, B, P)
    R_0, S_0 = solve_diophantine(A_3, B_3, [1.0, -1.2, 0.4])
    assert residual(A, B, P, R, S) < 1e-10
    np.testing.assert_allclose(S, S_0, atol=1e-9)
    np.testing.assert_allclose(R, R_0, atol=1e-8)


F_IN, F_OUT = np.array([1.0, -0.7]), np.array([1.0, -1.2])
F_PAIR = from_roots([0.6 + 0.5j, 0.6 - 0.5j])


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"A": multiply(A_3, F_IN), "B": multiply(B_3, F_IN)}, "A and B .* z = 0.7 .*remove it"),
        ({"A": multiply(A_3, F_OUT), "B": multiply(B_3, F_OUT)}, "z = 1.2 .*no controller"),
        ({"A": multiply(A_3, F_PAIR), "B": multiply(B_3, F_PAIR)}, r"z = 0.6 \+/- 0.5j \("),
        ({"H_R": [1.0, -1.0], "H_S": [1.0, -1.0]}, "H_R and H_S share the root z = 1"),
        ({"B": multiply(B_3, np.array([1.0, -1.0])), "H_S": [1, -1]}, "no static gain"),
        ({"H_S": [1.0, 0.5]}, "H_S and B .* z = -0.5"),
        ({"H_R": [1.0, -0.9]}, "A and H_R .* z = 0.9"),
        ({"A": [0.0, 1.0, 0.5]}, r"A\[0\] = 0"),
        ({"P": [0.0, 1.0]}, r"P\[0\] = 0"),
        ({"H_S": [0.0, 1.0]}, r"H_S\[0\] = 0"),
        ({"B": [0.0, 0.0]}, "B is all zero"),
        ({"H_R": [0.0]}, "H_R is all zero"),
        ({"A": [1.0, np.nan]}, "A: NaN"),
        ({"P": []}, "P: shape"),
    ],
)
def test_impossible_equations_are_refused(arguments: dict[str, Array], text: str) -> None:
    given_ = {"A": A_3, "B": B_3, "P": np.array([1.0, -1.2, 0.4])} | arguments
    with pytest.raises(BadSpecification, match=text) as caught:
        solve_diophantine(given_.pop("A"), given_.pop("B"), given_.pop("P"), h=0.01, **given_)
    assert "\n" not in str(caught.value)


@given(st.floats(-14, -1), st.floats(0.3, 1.3))
def test_near_common_factor_is_solved_truly_or_refused(exponent: float, z: float) -> None:
    A = multiply(from_roots([0.2, -0.4]), np.array([1.0, -z]))
    B = multiply(np.array([0.0, 1.0, 0.9]), np.array([1.0, -z - 10.0**exponent]))
    P = np.array([1.0, -1.2, 0.4])
    try:
        R, S = solve_diophantine(A, B, P)
    except BadSpecification as error:
        assert "common factor" in str(error) or "ill-conditioned" in str(error)
        assert exponent < -5
    else:
        assert residual(A, B, P, R, S) < 1e-6
