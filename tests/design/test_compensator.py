"""The compensator (4) against its written form, in every band, and what is refused."""

from dataclasses import FrozenInstanceError, replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from design.compensator import Compensator
from identification.errors import BadModel
from identification.model.karnopp import Karnopp

FRICTION = Karnopp(1.0, 12.0, 15.0, 300.0, 200.0, 0.04, -0.04, 20.6, -23.0)
C = Compensator(FRICTION, N_c=2.0, e_T=0.003)


def written(c: Compensator, v: float, e: float, F: float) -> float:
    """Eqs. (1), (3) and (4) as the paper writes them."""
    p = c.friction
    if v >= p.dv_p:
        return p.F_cp + (p.F_vp * v if c.viscous else 0.0)
    if v <= p.dv_n:
        return -p.F_cn + (p.F_vn * v if c.viscous else 0.0)
    stick = min(F, p.F_sp) if F >= 0 else max(F, p.F_sn)
    if p.dv_n / c.N_c <= v <= p.dv_p / c.N_c:
        zero = min(e / c.e_T * p.F_sp, p.F_sp) if e >= 0 else max(-e / c.e_T * p.F_sn, p.F_sn)
        return {"zero-velocity": zero, "stick": stick, "none": 0.0}[c.inner]
    return stick if c.stick else 0.0


@given(
    st.sampled_from(
        [
            C,
            replace(C, inner="stick", viscous=True),
            replace(C, inner="none"),
            replace(C, stick=False),
            replace(C, N_c=3.0, e_T=0.01, viscous=True),
        ]
    ),
    st.one_of(st.floats(-0.1, 0.1), st.sampled_from([0.0, 0.02, -0.02, 0.04, -0.04])),
    st.floats(-0.01, 0.01),
    st.floats(-60.0, 60.0),
)
def test_the_compiled_law_is_the_written_one(c: Compensator, v: float, e: float, F: float) -> None:
    assert c.force(v, e, F) == pytest.approx(written(c, v, e, F), rel=1e-12, abs=1e-12)


def test_the_terms_at_a_glance() -> None:
    """Figure 13: slip, stick and zero-velocity bands of the paper's table 1."""
    assert C.force(0.05, 0.0, 0.0) == 12.0
    assert C.force(-0.05, 0.0, 0.0) == -15.0
    assert C.force(0.0, 0.0015, 99.0) == pytest.approx(10.3)
    assert C.force(0.0, -0.0015, 99.0) == pytest.approx(-11.5)
    assert C.force(0.0, 1.0, 0.0) == 20.6
    assert C.force(0.03, 1.0, 7.0) == 7.0
    assert C.force(0.03, 1.0, 70.0) == 20.6
    assert replace(C, stick=False).force(0.03, 1.0, 7.0) == 0.0


def test_the_excess_alone_pushes_by_what_breakaway_needs_beyond_sliding() -> None:
    own = replace(C, excess=True)
    assert own.force(0.05, 0.0, 0.0) == own.force(-0.05, 0.0, 0.0) == 0.0
    assert own.force(0.0, 1.0, 0.0) == pytest.approx(20.6 - 12.0)
    assert own.force(0.0, -1.0, 0.0) == pytest.approx(-(23.0 - 15.0))
    assert own.force(0.0, 0.0015, 0.0) == pytest.approx(0.5 * (20.6 - 12.0))
    assert own.force(0.03, 1.0, 7.0) == 0.0


def test_where_sliding_needs_more_than_breakaway_there_is_no_excess() -> None:
    own = replace(C, friction=replace(FRICTION, F_sp=11.0, F_sn=-14.0), excess=True)
    assert own.force(0.0, 1.0, 0.0) == own.force(0.0, -1.0, 0.0) == 0.0


def test_narrow_band_is_the_band_over_N_c() -> None:
    assert (C.dv_p1, C.dv_n1) == (0.02, -0.02)
    with pytest.raises(FrozenInstanceError):
        C.N_c = 3.0  # type: ignore[misc]


@pytest.mark.parametrize(
    ("N_c", "e_T", "text"),
    [
        (1.0, 0.003, "N_c"),
        (float("nan"), 0.003, "N_c"),
        (2.0, 0.0, "e_T"),
        (2.0, float("inf"), "e_T"),
    ],
)
def test_bad_parameters_are_refused(N_c: float, e_T: float, text: str) -> None:
    with pytest.raises(BadModel, match=text):
        Compensator(FRICTION, N_c, e_T)


def test_an_unknown_inner_term_is_refused() -> None:
    with pytest.raises(BadModel, match="zero-velocity, stick, none"):
        replace(C, inner="both")  # type: ignore[arg-type]
