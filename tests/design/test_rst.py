import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.signal import cont2discrete, lfilter

from design.polynomial import add, common_roots, evaluate, from_roots, multiply, second_order
from design.rst import RST, closed_loop, closed_loop_poles, design_rst
from design.specification import RSTSpecification, pole_pair, reference_model
from identification.arrays import Array
from identification.errors import BadSpecification
from tests.design.strategies import plant

REFERENCE = tomllib.loads((Path(__file__).parents[1] / "reference" / "rst.toml").read_text())
A_2, B_2, H = [1.0, -1.6, 0.65], [0.0, 0.05, 0.03], 0.01


@pytest.fixture(scope="module")
def printed() -> RST:
    model, wanted = REFERENCE["plant"], REFERENCE["specification"]
    h = model["h"]
    return design_rst(
        model["A"],
        model["B"],
        h,
        RSTSpecification(
            wanted["dominant"],
            H_S=wanted["H_S"],
            H_R=multiply(*(second_order(w, zeta, h) for w, zeta in wanted["H_R_pairs"])),
            T=wanted["tracking"],
        ),
    )


def test_paper_table_is_reproduced(printed: RST) -> None:
    R, S, T = (REFERENCE[name] for name in "RST")
    np.testing.assert_allclose(printed.T, T["value"], rtol=T["tolerance"])
    np.testing.assert_allclose(printed.S, S["value"], atol=S["tolerance"], rtol=0)
    np.testing.assert_allclose(printed.R, R["value"], atol=R["tolerance"], rtol=0)
    assert printed.R.sum() == pytest.approx(R["sum"], abs=5e-4)


def test_integrator_gives_equal_static_gains(printed: RST) -> None:
    assert printed.T.sum() == pytest.approx(printed.R.sum(), rel=1e-9)


def test_printed_sign_convention_is_the_stable_one() -> None:
    A, B, h = (REFERENCE["plant"][name] for name in ("A", "B", "h"))
    R, S = np.array(REFERENCE["R"]["value"]), np.array(REFERENCE["S"]["value"])
    assert abs(closed_loop_poles(A, B, RST(R, S, R, h))[0]) < 1
    assert abs(closed_loop_poles(A, B, RST(-R, S, R, h))[0]) > 1


@pytest.mark.slow
@given(plant(4), st.floats(2, 60), st.floats(0.3, 1.5), st.lists(st.floats(-0.3, 0.6), max_size=2))
def test_poles_are_placed(
    AB: tuple[Array, Array], w_n: float, zeta: float, others: list[float]
) -> None:
    A, B = AB
    assume(common_roots(A, B, 1e-2, 0.05).size == 0 and abs(B.sum()) > 1e-3 * np.abs(B).sum())
    before = A.copy(), B.copy()
    c = design_rst(A, B, H, RSTSpecification((w_n, zeta), others))
    P = multiply(second_order(w_n, zeta, H), from_roots(others))
    error = add(closed_loop(A, B, c), -P)
    assert np.abs(error).max() < 1e-8 * np.abs(P).max()
    assert c.P is not None
    assert np.abs(add(c.P, -P)).max() < 1e-14
    assert np.array_equal(A, before[0])
    assert np.array_equal(B, before[1])
    assert c.S[0] == 1.0


def respond(A: list[float], B: list[float], c: RST, steps: int) -> Array:
    """Step response of the loop by its difference equations, u = (T r - R y)/S."""
    r = lfilter(c.B_m, c.A_m, np.ones(steps))
    y, u = np.zeros(steps), np.zeros(steps)
    forward = lfilter(c.T, [1.0], r)
    for t in range(steps):
        y[t] = sum(b * u[t - k] for k, b in enumerate(B) if k <= t and k > 0)
        y[t] = (y[t] - sum(a * y[t - k] for k, a in enumerate(A) if 0 < k <= t)) / A[0]
        back = sum(q * y[t - k] for k, q in enumerate(c.R) if k <= t)
        past = sum(s * u[t - k] for k, s in enumerate(c.S) if 0 < k <= t)
        u[t] = (forward[t] - back - past) / c.S[0]
    return y


@pytest.mark.parametrize("T", ["all-poles", "keep-dominant", "unit-static", "R"])
@pytest.mark.parametrize("model", [None, (15.0, 0.7)])
def test_step_response_settles_at_one(T: Any, model: tuple[float, float] | None) -> None:
    c = design_rst(
        A_2, B_2, H, RSTSpecification((10, 0.8), [0.3, 0.2], H_S=[1, -1], T=T, model=model)
    )
    assert respond(A_2, B_2, c, 250)[-1] == pytest.approx(1.0, abs=1e-6)


def test_tracking_choices_leave_the_stated_dynamics() -> None:
    z, w = np.exp(1j * np.linspace(0.01, 3, 20)), (12.0, 0.7)
    B = np.array(B_2)
    P_d = second_order(*w, H)
    left = {
        "all-poles": evaluate(B, z) / B.sum(),
        "keep-dominant": evaluate(B, z) / B.sum() * P_d.sum() / evaluate(P_d, z),
    }
    for choice, wanted in left.items():
        T: Any = choice
        c = design_rst(A_2, B_2, H, RSTSpecification(w, [0.4], H_S=[1, -1], T=T))
        y_r = evaluate(B, z) * evaluate(c.T, z) / evaluate(closed_loop(A_2, B_2, c), z)
        np.testing.assert_allclose(y_r, wanted, rtol=1e-9)


@pytest.mark.parametrize("zeta", [0.3, 1.0, 1.7])
def test_reference_model_is_the_sampled_second_order(zeta: float) -> None:
    system: Any = ([400.0], [1.0, 40 * zeta, 400.0])
    b, a, _ = cont2discrete(system, H, "zoh")
    B_m, A_m = reference_model((20.0, zeta), H)
    np.testing.assert_allclose(B_m, np.ravel(b)[1:], rtol=1e-8)
    np.testing.assert_allclose(A_m, a, rtol=1e-8)


def test_chosen_zero_is_cancelled() -> None:
    B = multiply(np.array([0.0, 0.1, 0.05]), np.array([1.0, -0.6]))
    c = design_rst(A_2, B, H, RSTSpecification((10, 0.8), cancel=[1.0, -0.6], H_S=[1, -1]))
    assert evaluate(c.S, 0.6) == pytest.approx(0, abs=1e-12)
    poles = closed_loop_poles(A_2, B, c)
    assert np.abs(poles - 0.6).min() < 1e-6
    assert np.abs(poles - pole_pair(10, 0.8, H)[0]).min() < 1e-6


def test_plant_without_delay_gets_a_realisable_controller() -> None:
    c = design_rst([1.0, -0.9], [0.1, 0.05], H, RSTSpecification((10, 0.8)))
    assert c.R[0] == 0.0
    assert np.abs(
        add(closed_loop([1.0, -0.9], [0.1, 0.05], c), -second_order(10, 0.8, H))
    ).max() < (1e-12)


def test_arrays_are_read_only_copies() -> None:
    R = np.array([1.0, 2.0])
    c = RST(R, np.ones(1), R, H)
    R[0] = 9.0
    assert c.R[0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        c.R[0] = 2.0


PAIR = from_roots([0.7 + 0.7j, 0.7 - 0.7j])


@pytest.mark.parametrize(
    ("changed", "text"),
    [
        ({"dominant": (3.0, -0.1)}, "zeta"),
        ({"dominant": (3.0, 0.0)}, "zeta"),
        ({"dominant": (-3.0, 0.8)}, "w_n"),
        ({"dominant": (500.0, 0.1)}, "alias"),
        ({"dominant": (1e-6, 0.8)}, "z = 1"),
        ({"dominant": 3.0}, "give"),
        ({"dominant": (np.nan, 0.8)}, "w_n"),
        ({"auxiliary": [1.1]}, "not stable"),
        ({"auxiliary": [1.0]}, "not stable"),
        ({"auxiliary": [0.9j]}, "conjugate"),
        ({"h": 0.0}, "sampling period"),
        ({"A": [0.0, 1.0]}, r"A\[0\]"),
        ({"A": [1.0, np.nan]}, "NaN"),
        ({"B": [0.0, 0.0]}, "all zero"),
        ({"B": [0.0, 0.1, -0.1], "H_S": [1, -1]}, "no static gain"),
        ({"B": [0.0, 0.1, -0.1]}, r"B\(1\) = 0"),
        ({"T": "best"}, "choose one of"),
        (
            {"A": multiply(np.array([1, -0.8]), PAIR), "B": multiply(np.array([0, 1.0]), PAIR)},
            "rad/s",
        ),
        ({"H_R": [1.0, -1.0], "H_S": [1.0, -1.0]}, "share the root"),
        ({"B": [0.0, 0.1, -0.12], "cancel": [1.0, -1.2]}, "unstable zero"),
        ({"B": [0.0, 0.1, 0.095], "cancel": [1.0, 0.95]}, "badly damped"),
        ({"cancel": [1.0, -0.3]}, "not a factor"),
        ({"B": [0.0, 0.1, 0.095], "H_S": [1.0, 0.95], "auxiliary": [-0.95]}, "badly damped"),
        ({"model": (3.0, 0.0)}, "zeta"),
        ({"auxiliary": ["a"]}, "not numbers"),
        ({"B": [0.0, 1e-320]}, "too small"),
    ],
)
def test_impossible_specifications_are_refused(changed: dict[str, Any], text: str) -> None:
    wanted: dict[str, Any] = {"A": A_2, "B": B_2, "h": H, "dominant": (10.0, 0.8)} | changed
    with pytest.raises(BadSpecification, match=text) as caught:
        A, B, h = (wanted.pop(name) for name in "ABh")
        design_rst(A, B, h, RSTSpecification(**wanted))
    assert "\n" not in str(caught.value)
