"""The friction compensator, paper eqs. (2)-(4), and its compiled law."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from identification.arrays import Array
from identification.compiled import compiled_exact
from identification.errors import BadModel
from identification.model.karnopp import Karnopp
from identification.simulation.karnopp_step import DV_N, DV_P, F_CN, F_CP, F_SN, F_SP, F_VN, F_VP

# A compensator as the kernels take it: the nine in the order of karnopp.NAMES, then its own.
DV_P1, DV_N1, E_T, INNER, STICK = range(9, 14)
Inner = Literal["zero-velocity", "stick", "none"]
INNERS: tuple[Inner, ...] = ("zero-velocity", "stick", "none")
INNER_ZERO, INNER_STICK, INNER_NONE = range(3)


@compiled_exact
def compensation_force(law: Array, v: float, e_y: float, F: float) -> float:
    """F_comp [N] of the compensator `law` (14,) at velocity v [m/s], error e_y [m], force F [N].

    Source: paper, eqs. (1)-(4).
    """
    if v >= law[DV_P]:
        return float(law[F_CP] + law[F_VP] * v)
    if v <= law[DV_N]:
        return float(-law[F_CN] + law[F_VN] * v)
    stick = law[STICK]
    if law[DV_N1] <= v <= law[DV_P1]:
        if law[INNER] == INNER_ZERO:
            share = min(abs(e_y) / law[E_T], 1.0)
            return float(share * law[F_SP]) if e_y >= 0.0 else float(share * law[F_SN])
        stick = 1.0 if law[INNER] == INNER_STICK else 0.0
    if stick != 0.0:
        return float(min(max(F, law[F_SN]), law[F_SP]))
    return 0.0


@dataclass(frozen=True)
class Compensator:
    """Karnopp compensator: friction model, velocity band divisor N_c > 1 [-], error scale e_T [m].

    Inside the narrow band [dv_n1, dv_p1] the zero-velocity term (3) grows with the position error
    and is full at e_T; in the rest of the band stands F_stick(F_e), outside it Coulomb friction:
    eq. (4). inner: what stands in the narrow band instead; "none" is 0, which is figure 4 without
    its zero-velocity block. stick off: 0 in the rest of the band (figure 22). viscous: F_v v is
    added outside the band; with F_stick in the whole band that is eq. (2). excess: F_s - F_c in
    place of F_s and nothing outside the narrow band, for a loop whose integrator holds the sliding
    friction: given the whole force at each breakaway, such a loop leaps.

    Raises BadModel where N_c <= 1 or e_T <= 0. Source: paper, eqs. (2)-(4), figures 4 and 13.
    """

    friction: Karnopp
    N_c: float
    e_T: float
    inner: Inner = "zero-velocity"
    stick: bool = True
    viscous: bool = False
    excess: bool = False

    def __post_init__(self) -> None:
        if self.inner not in INNERS:
            raise BadModel(f"inner = {self.inner!r}; choose one of {', '.join(INNERS)}")
        if not (math.isfinite(self.N_c) and self.N_c > 1):
            raise BadModel(f"N_c = {self.N_c:g}, must be finite and > 1 (paper: 2)")
        if not (math.isfinite(self.e_T) and self.e_T > 0):
            raise BadModel(f"e_T = {self.e_T:g} m, must be finite and > 0 (paper: 0.003, 0.005)")

    @property
    def dv_p1(self) -> float:
        """Upper limit of the narrow band [m/s], dv_p/N_c."""
        return self.friction.dv_p / self.N_c

    @property
    def dv_n1(self) -> float:
        """Lower limit of the narrow band [m/s], dv_n/N_c."""
        return self.friction.dv_n / self.N_c

    @property
    def law(self) -> Array:
        """The compensator as `compensation_force` takes it, (14,)."""
        p, viscous = self.friction, float(self.viscous)
        slip = [p.F_cp, p.F_cn, viscous * p.F_vp, viscous * p.F_vn]
        stick = [p.F_sp, p.F_sn]
        if self.excess:
            slip, stick = [0.0] * 4, [max(p.F_sp - p.F_cp, 0.0), min(p.F_sn + p.F_cn, 0.0)]
        bands = [p.dv_p, p.dv_n, *stick, self.dv_p1, self.dv_n1]
        terms = [float(INNERS.index(self.inner)), float(self.stick and not self.excess)]
        return np.array([p.m, *slip, *bands, self.e_T, *terms])

    def force(self, v: float, e_y: float, F: float) -> float:
        """F_comp [N] at velocity v [m/s], position error e_y = r - y [m], applied force F [N]."""
        return compensation_force(self.law, v, e_y, F)
