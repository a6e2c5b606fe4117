import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from design.margins import Margins, margins, sensitivities
from design.polynomial import common_roots, evaluate
from design.rst import RST, closed_loop_poles, design_rst
from design.specification import RSTSpecification
from identification.arrays import Array
from identification.errors import BadSpecification
from tests.design.strategies import plant

REFERENCE = tomllib.loads((Path(__file__).parents[1] / "reference" / "rst.toml").read_text())
H = 0.01


@pytest.fixture(scope="module")
def paper() -> tuple[Array, Array, RST]:
    A, B = (np.array(REFERENCE["plant"][name]) for name in "AB")
    R, S, T = (np.array(REFERENCE[name]["value"]) for name in "RST")
    return A, B, RST(R, S, T, REFERENCE["plant"]["h"])


def stable(A: Array, B: Array, c: RST, gain: float = 1.0, delay: int = 0) -> bool:
    """Whether the loop is stable with that gain and that many more samples of delay."""
    later = gain * np.concatenate([np.zeros(delay), B])
    z = closed_loop_poles(A, later, c)
    return z.size == 0 or bool(abs(z[0]) < 1)


def test_printed_controller_has_the_known_margins(paper: tuple[Array, Array, RST]) -> None:
    found = margins(*paper)
    for name, wanted in REFERENCE["margins"].items():
        assert getattr(found, name) == pytest.approx(wanted["value"], abs=wanted["tolerance"])


@pytest.mark.slow
@given(plant(4), st.floats(2, 60), st.floats(0.2, 1.2), st.booleans())
@settings(max_examples=25)
def test_margins_agree_with_a_dense_grid_and_with_the_poles(
    AB: tuple[Array, Array], w_n: float, zeta: float, integrator: bool
) -> None:
    A, B = AB
    assume(common_roots(np.convolve(A, [1, -1]), B, 1e-2, 0.05).size == 0)
    H_S = [1.0, -1.0] if integrator else [1.0]
    c = design_rst(A, B, H, RSTSpecification((w_n, zeta), H_S=H_S, T="R"))
    found = margins(A, B, c)
    assume(found.modulus > 1e-3)  # a loop that rounding alone upsets has no figures to compare
    theta = np.linspace(1e-6, np.pi, 200_001)
    centres = [found.modulus_w * H, (found.S_up_max_w or 0.0) * H]
    near = np.concatenate([x + np.linspace(-3e-5, 3e-5, 2001) for x in centres])
    everywhere = np.concatenate([theta, near[(near >= 0) & (near <= np.pi)]])
    S = sensitivities(A, B, c, everywhere / H)
    peak = float(np.abs(S.S_yp).max())
    assert 1 / found.modulus == pytest.approx(peak, rel=1e-6)
    assert 1 / found.modulus >= peak * (1 - 1e-12)
    if found.S_up_max_db is not None:
        assert 10 ** (found.S_up_max_db / 20) == pytest.approx(
            float(np.abs(S.S_up).max()), rel=1e-6
        )
    check_gain(A, B, c, found)
    check_against_crossings(A, B, c, found, theta)


def check_gain(A: Array, B: Array, c: RST, found: Margins) -> None:
    """The loop is stable up to the gain margins, and not beyond them."""
    up, down = found.gain_up or 100.0, found.gain_down or 0.01
    for gain in np.geomspace(max(down, 1e-3) * (1 + 1e-5), min(up, 1e3) * (1 - 1e-5), 9):
        assert stable(A, B, c, gain)
    if found.gain_up is not None and found.gain_up < 1e3:
        assert not stable(A, B, c, found.gain_up * (1 + 1e-5))
    if found.gain_down is not None and found.gain_down > 1e-3:
        assert not stable(A, B, c, found.gain_down * (1 - 1e-5))


def check_against_crossings(A: Array, B: Array, c: RST, found: Margins, theta: Array) -> None:
    """Phase and delay margin against a dense search over all crossings of |L| = 1."""
    z = np.exp(1j * theta)
    L = evaluate(B, z) * evaluate(c.R, z) / (evaluate(A, z) * evaluate(c.S, z))
    cross = np.flatnonzero((np.abs(L[:-1]) > 1) != (np.abs(L[1:]) > 1))
    if cross.size and abs(L[-1]) < 1:
        lag = np.mod(np.angle(L[cross]) + np.pi, 2 * np.pi)
        assert found.phase_deg is not None
        assert found.delay_s is not None
        assert found.phase_deg == pytest.approx(
            np.degrees(np.minimum(lag, 2 * np.pi - lag).min()), rel=1e-2, abs=0.05
        )
        assert found.delay_s == pytest.approx(H * (lag / theta[cross]).min(), rel=1e-2, abs=1e-4)
    if found.delay_s is not None and found.delay_s / H < 200:
        whole = int(np.floor(found.delay_s / H * (1 - 1e-9)))
        for delay in sorted({0, 1, whole // 2, whole} & set(range(whole + 1))):
            assert stable(A, B, c, delay=delay)


def test_delay_margin_is_tight(paper: tuple[Array, Array, RST]) -> None:
    A, B, c = paper
    found = margins(A, B, c)
    assert found.delay_s is not None
    whole = int(found.delay_s / c.h)
    assert stable(A, B, c, delay=whole)
    assert not stable(A, B, c, delay=whole + 1)


def test_delay_margin_counts_every_crossing() -> None:
    # A sharp resonance lifts |L| over 1 again far above the first crossing.
    A = np.convolve([1.0, -0.999], [1.0, -2 * 0.995 * np.cos(1.0), 0.995**2])
    B = np.array([0.0, 0.0, 0.0, 0.0, 0.012])
    c = RST(np.ones(1), np.ones(1), np.ones(1), H)
    found = margins(A, B, c)
    theta = np.linspace(1e-4, np.pi, 400_001)
    z = np.exp(1j * theta)
    L = evaluate(B, z) / evaluate(A, z)
    cross = np.flatnonzero((np.abs(L[:-1]) > 1) != (np.abs(L[1:]) > 1))
    assert cross.size >= 3
    lag = np.mod(np.angle(L[cross]) + np.pi, 2 * np.pi)
    assert found.delay_s == pytest.approx(H * (lag / theta[cross]).min(), rel=1e-3)
    assert found.delay_s is not None
    assert found.delay_s < H * lag[0] / theta[cross[0]]


def test_loop_gain_above_one_up_to_nyquist_stands_no_sample_of_delay() -> None:
    A, B = np.array([1.0, 1.2]), np.array([0.0, -0.9])
    c = RST(np.ones(1), np.ones(1), np.ones(1), H)
    found = margins(A, B, c)
    assert found.delay_s is not None
    assert 0 < found.delay_s < H
    assert not stable(A, B, c, delay=1)


def test_open_loop_has_no_finite_margin() -> None:
    found = margins([1.0, -0.5], [0.0, 1.0], RST(np.zeros(1), np.ones(1), np.ones(1), H))
    assert found.modulus == pytest.approx(1.0)
    assert found.gain_up is found.gain_down is found.phase_deg is found.delay_s is None
    assert found.S_up_max_db is None


def test_narrow_peak_is_not_missed() -> None:
    r, angle = 1 - 1e-6, 1.2345678
    A = np.array([1.0, -0.5])
    P = np.array([1.0, -2 * r * np.cos(angle), r * r])
    B = np.array([0.0, 1.0])
    R = np.array([P[1] - A[1], P[2]])
    c = RST(R, np.ones(1), R, H)
    found = margins(A, B, c)
    near = angle + np.linspace(-1e-5, 1e-5, 200_001)
    peak = np.abs(sensitivities(A, B, c, near / H).S_yp).max()
    assert 1 / found.modulus == pytest.approx(peak, rel=1e-6)


def test_sensitivities_add_to_one(paper: tuple[Array, Array, RST]) -> None:
    S = sensitivities(*paper, np.linspace(0, 314, 50))
    np.testing.assert_allclose(S.S_yp - S.S_yb, 1.0, rtol=1e-9)
    np.testing.assert_allclose(S.S_yr[0], 2.8 / 2.8306, rtol=1e-3)


def test_a_pole_that_only_rounding_moves_inside_is_refused() -> None:
    # R and S both vanish at z = 1, and so does P; its computed root there lies at 1 -+ 1e-8.
    said = set()
    for a in np.linspace(0.2, 0.95, 40):
        A, B = np.convolve([1.0, -1.0], [1.0, -a]), np.array([0.0, 1e-4, 1e-4 * a])
        one = np.array([1.0, -1.0])
        with pytest.raises(BadSpecification) as caught:
            margins(A, B, RST(100.0 * one, one, 100.0 * one, 0.01))
        said.add("but for rounding" in str(caught.value))
    assert True in said


def test_unstable_loop_is_refused_with_its_pole() -> None:
    with pytest.raises(BadSpecification, match=r"unstable: pole z = 1\.5"):
        margins([1.0, -0.5], [0.0, -1.0], RST(np.ones(1), np.ones(1), np.ones(1), H))


def test_frequency_above_nyquist_is_refused(paper: tuple[Array, Array, RST]) -> None:
    with pytest.raises(BadSpecification, match="pi/h"):
        sensitivities(*paper, [400.0])
