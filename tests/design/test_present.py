"""Cascades as a drive runs them, and what is forgotten where a command is clipped."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import lfilter

from design.drive_law import DriveLaw, drive_law, forgetting
from design.pid import pd_to_rst, pid_to_rst
from design.present import cascade_to_rst
from design.rst import RST
from identification.arrays import Array
from identification.errors import BadSpecification

H = 5e-4
TIMES = st.floats(1e-3, 1.0)
GAINS = st.floats(0.1, 200.0)


def by_loops(r: Array, y: Array, g: dict[str, float]) -> Array:
    """A position P above a speed PI, written as a drive's programmer would."""
    pole = math.exp(-H / g["eps"]) if g["eps"] > 0 else 0.0
    speed, total, last_r, last_y, out = 0.0, 0.0, 0.0, 0.0, []
    for now, y_now in zip(r.tolist(), y.tolist(), strict=True):
        speed = pole * speed + (1.0 - pole) * (y_now - last_y) / H
        wanted = g["k_v"] * (now - y_now) + g["v_ff"] * (now - last_r) / H
        out.append(g["k_p"] * (wanted - speed + total))
        total += H / g["T_i"] * (wanted - speed)
        last_r, last_y = now, y_now
    return np.array(out)


@given(GAINS, GAINS, TIMES, st.sampled_from([0.0, 1e-3, 0.02]), st.sampled_from([0.0, 0.7]))
def test_a_cascade_is_its_two_loops(
    k_v: float, k_p: float, T_i: float, eps: float, v_ff: float
) -> None:
    rng = np.random.default_rng(1)
    r, y = np.cumsum(rng.standard_normal((2, 200)) * 1e-3, axis=1)
    rst = cascade_to_rst(k_v, k_p, T_i, H, eps=eps, v_ff=v_ff)
    u = lfilter(rst.T, rst.S, r) - lfilter(rst.R, rst.S, y)
    gains = {"k_v": k_v, "k_p": k_p, "T_i": T_i, "eps": eps, "v_ff": v_ff}
    own = by_loops(r, y, gains)
    assert np.max(np.abs(u - own)) < 1e-8 * max(1.0, float(np.max(np.abs(own))))


@pytest.mark.parametrize("wrong", [{"k_v": 0.0}, {"T_i": -1.0}, {"k_p": math.nan}, {"eps": -1.0}])
def test_gains_that_are_none_are_refused(wrong: dict[str, float]) -> None:
    given_ = {"k_v": 40.0, "k_p": 20.0, "T_i": 0.01, "h": H, "eps": 0.0} | wrong
    with pytest.raises(BadSpecification, match=next(iter(wrong))):
        cascade_to_rst(**given_)


def test_only_integrators_forget() -> None:
    pid, pd = pid_to_rst(10.0, 0.1, 0.02, 0.005, H), pd_to_rst(10.0, 0.02, 0.005, H)
    law = drive_law(pid, 0.05)
    kept = math.exp(-H / 0.005)
    expected = np.convolve([1.0, -math.exp(-H / 0.05)], [1.0, -kept])
    assert np.allclose(law.W, expected, rtol=0, atol=1e-9)
    assert drive_law(pd, 0.05).W == drive_law(pd, 0.05).S  # there is none
    assert np.array_equal(forgetting(pid.S, None, H), pid.S)
    assert forgetting(pid.S, 0.0, H).tolist() == [1.0, 0.0, 0.0]


def test_a_law_in_another_unit_is_the_controller_over_k_a() -> None:
    rst = pid_to_rst(10.0, 0.1, 0.02, 0.005, H)
    law = drive_law(rst, 0.05, 4.0)
    assert np.allclose(4.0 * np.array(law.R), rst.R) and np.allclose(4.0 * np.array(law.T), rst.T)
    assert np.allclose(law.S, rst.S)


def test_what_is_no_law_is_refused() -> None:
    with pytest.raises(BadSpecification, match="one length"):
        DriveLaw((1.0,), (1.0, -1.0), (1.0,), (1.0,), H)
    with pytest.raises(BadSpecification, match="begin with 1"):
        DriveLaw((1.0,), (2.0, -1.0), (1.0,), (1.0, 0.0), H)
    model = RST(np.ones(1), np.ones(1), np.ones(1), H, B_m=np.array([0.1]), A_m=np.array([1, -0.9]))
    with pytest.raises(BadSpecification, match="tracking model"):
        drive_law(model, None)
