import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import cont2discrete

from design.margins import margins
from design.pid import design_pid, pd_to_rst, pi_to_rst, pid_gains, pid_to_rst
from design.polynomial import add, evaluate, multiply, second_order
from design.rst import RST, closed_loop, closed_loop_poles
from design.specification import pole_pair
from identification.errors import BadSpecification

REFERENCE = tomllib.loads((Path(__file__).parents[1] / "reference" / "rst.toml").read_text())
PID_PLANT, RST_PLANT = REFERENCE["pid_plant"], REFERENCE["plant"]
Z = np.exp(1j * np.linspace(0.01, 3.1, 40))


def ratio(c: RST) -> Any:
    return evaluate(c.R, Z) / evaluate(c.S, Z)


@pytest.mark.parametrize("others", [[], [0.5], [0.5, 0.5], [0.9, -0.9]])
@pytest.mark.parametrize("dominant", [(3.0, 0.8), (10.0, 0.9), (10.0, 1.5)])
def test_every_pole_of_a_second_order_plant_is_placed(
    others: list[float], dominant: tuple[float, float]
) -> None:
    A, B, h = (PID_PLANT[name] for name in ("A", "B", "h"))
    found = design_pid(A, B, h, dominant=dominant, auxiliary=others)
    P = multiply(second_order(*dominant, h), *(np.array([1.0, -z]) for z in others))
    assert np.abs(add(closed_loop(A, B, found.rst), -P)).max() < 1e-11
    assert found.exact
    assert found.rst.R.size == 3
    assert found.rst.S.size == 3
    assert abs(found.rst.S.sum()) < 1e-12
    assert (found.gains is None) == (found.reason is not None)
    if found.gains is not None:
        again = pid_to_rst(found.gains.k_R, found.gains.T_i, found.gains.T_d, found.gains.eps, h)
        np.testing.assert_allclose(ratio(again), ratio(found.rst), rtol=1e-8)


@pytest.mark.parametrize("dominant", [(1.0, 0.8), (3.0, 0.8), (8.0, 0.8), (20.0, 0.5)])
def test_dominant_poles_of_a_higher_plant_are_placed(dominant: tuple[float, float]) -> None:
    A, B, h = (RST_PLANT[name] for name in ("A", "B", "h"))
    found = design_pid(A, B, h, dominant=dominant)
    poles = closed_loop_poles(A, B, found.rst)
    wanted = pole_pair(*dominant, h)
    assert abs(poles[0]) < 1
    assert all(np.abs(poles - z).min() < 1e-7 for z in wanted)
    assert not found.exact
    assert found.note is None
    assert np.abs(poles).max() == pytest.approx(np.abs(wanted).max())
    assert margins(A, B, found.rst).modulus > 0.3


@pytest.mark.parametrize("order", [0, 1])
def test_plants_of_lower_order_keep_the_pid_form(order: int) -> None:
    A = [1.0, -0.8][: order + 1]
    found = design_pid(A, [0.0, 0.5], 0.01, dominant=(10.0, 0.8), auxiliary=[0.3] * order)
    P = np.convolve(second_order(10.0, 0.8, 0.01), [1.0, -0.3] if order else [1.0])
    assert np.abs(add(closed_loop(A, [0.0, 0.5], found.rst), -P)).max() < 1e-12
    assert found.rst.S.size <= 3


def test_dominant_poles_that_do_not_dominate_are_reported() -> None:
    A, B, h = (RST_PLANT[name] for name in ("A", "B", "h"))
    found = design_pid(A, B, h, dominant=(100.0, 0.5))
    assert found.note is not None
    assert "slower than the dominant" in found.note


def test_a_double_dominant_pole_that_rounding_tears_apart_is_not_slower_than_itself() -> None:
    A = [1.0, -2.40005, 1.94707, -0.626034, 0.0790104]
    B = [0.0, 4.64186e-06, 6.63177e-06, -7.67243e-06, -1.24133e-06]
    others = [complex(0.259588, 0.149364), complex(0.259588, -0.149364)]
    for w in (17.0, 17.3):
        assert design_pid(A, B, 0.01, dominant=(w, 1.0), auxiliary=others).note is None


@given(
    st.floats(0.1, 2000),
    st.floats(0.02, 5),
    st.floats(0, 0.5),
    st.floats(0.01, 0.5),
    st.sampled_from((1e-3, 1e-2)),
)
def test_gains_are_read_back(k_R: float, T_i: float, T_d: float, eps: float, h: float) -> None:
    found = pid_gains(pid_to_rst(k_R, T_i, T_d, eps, h))
    assert (found.k_R, found.T_i, found.eps) == pytest.approx((k_R, T_i, eps), rel=1e-4)
    assert found.T_d == pytest.approx(T_d, rel=1e-4, abs=1e-4)


@pytest.mark.parametrize(("method", "name"), [("zoh", "zoh"), ("tustin", "bilinear")])
def test_sampled_terms_agree_with_scipy(method: Any, name: Any) -> None:
    k_R, T_i, T_d, eps, h = (
        REFERENCE["simulation_pid"][k] for k in ("k_R", "T_i", "T_d", "eps", "h")
    )
    derivative: Any = ([T_d, 0.0], [eps, 1.0])
    b, a, _ = cont2discrete(derivative, h, name)
    D = np.polyval(np.ravel(b), Z) / np.polyval(a, Z)
    integral: Any = ([1.0], [T_i, 0.0])
    b, a, _ = cont2discrete(integral, h, name)
    I_ = np.polyval(np.ravel(b), Z) / np.polyval(a, Z)
    np.testing.assert_allclose(ratio(pid_to_rst(k_R, T_i, T_d, eps, h, method)), k_R * (1 + I_ + D))
    np.testing.assert_allclose(ratio(pd_to_rst(k_R, T_d, eps, h, method)), k_R * (1 + D))
    np.testing.assert_allclose(ratio(pi_to_rst(k_R, T_i, h, method)), k_R * (1 + I_))


def test_rig_controllers_are_the_printed_forms() -> None:
    k_d, T_d, eps, h = (REFERENCE["rig_pd"][k] for k in ("k_d", "T_d", "eps", "h"))
    C_y = k_d * (1 + T_d * (1 - 1 / Z) / (eps * (1 - np.exp(-h / eps) / Z)))
    np.testing.assert_allclose(ratio(pd_to_rst(k_d, T_d, eps, h)), C_y)
    k_i, T_i, h = (REFERENCE["rig_pi"][k] for k in ("k_i", "T_i", "h"))
    C_F = k_i * (1 + h / Z / (T_i * (1 - 1 / Z)))
    np.testing.assert_allclose(ratio(pi_to_rst(k_i, T_i, h)), C_F)


def test_controller_on_the_error_has_T_equal_R() -> None:
    c = pid_to_rst(2.0, 0.5, 0.1, 0.2, 0.01)
    assert np.array_equal(c.T, c.R)


@pytest.mark.parametrize(
    ("changed", "text"),
    [
        ({"auxiliary": [0.5, 0.4, 0.3]}, "3 auxiliary poles asked, a PID on this plant places 2"),
        ({"B": [0.1, 0.05]}, r"B\[0\]"),
        ({"B": [0.0, 0.1, -0.1]}, "no static gain"),
        ({"auxiliary": [1.2]}, "not stable"),
        ({"dominant": (3.0, -1.0)}, "zeta"),
        ({"A": [1.0, -4.0, 5.5, -3.0, 0.5], "B": [0.0, 0.0, 0.1]}, "no PID found .* stable"),
        (
            {"A": [1.0, -0.5, 0.0, 0.1], "B": [0, *(second_order(10, 0.8, 0.01))]},
            "feedback is blind",
        ),
    ],
)
def test_impossible_pid_is_refused(changed: dict[str, Any], text: str) -> None:
    wanted: dict[str, Any] = {
        "A": [1.0, -1.6, 0.65],
        "B": [0.0, 0.05, 0.03],
        "dominant": (10.0, 0.8),
    } | changed
    with pytest.raises(BadSpecification, match=text) as caught:
        design_pid(wanted.pop("A"), wanted.pop("B"), 0.01, **wanted)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ((0.0, 0.1, 0.1, 0.1, 0.01), "k_R"),
        ((1.0, 0.0, 0.1, 0.1, 0.01), "T_i"),
        ((1.0, np.inf, 0.1, 0.1, 0.01), "T_i"),
        ((1.0, 0.1, -0.1, 0.1, 0.01), "T_d"),
        ((1.0, 0.1, 0.1, 0.0, 0.01), "eps"),
        ((1.0, 0.1, 0.1, 0.1, 0.0), "sampling period"),
    ],
)
def test_bad_gains_are_refused(values: tuple[float, float, float, float, float], text: str) -> None:
    with pytest.raises(BadSpecification, match=text):
        pid_to_rst(*values)


def test_unknown_sampling_is_refused() -> None:
    method: Any = "euler"
    with pytest.raises(BadSpecification, match="choose one of"):
        pd_to_rst(1.0, 0.1, 0.1, 0.01, method)


@pytest.mark.parametrize(
    ("R", "S", "text"),
    [
        ([1.0, 2.0, 3.0, 4.0], [1.0, -1.5, 0.5], "deg R"),
        ([1.0, -0.5], [1.0, -0.5], "S"),
        ([1.0, -0.5], [1.0, -0.3, -0.7], "derivative filter"),
        ([1.0, -0.5, -0.5], [1.0, -1.5, 0.5], "no parallel form"),
        ([-1.0, 0.0, 3.0], [1.0, -1.5, 0.5], "T_i"),
    ],
)
def test_other_controllers_have_no_pid_gains(R: list[float], S: list[float], text: str) -> None:
    with pytest.raises(BadSpecification, match=text):
        pid_gains(RST(np.array(R), np.array(S), np.array(R), 0.01))
