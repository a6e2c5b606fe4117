"""The friction compensator's parameters, paper eqs. (2)-(4)."""

import math
from dataclasses import dataclass

from identification.errors import BadModel
from identification.karnopp import Karnopp


@dataclass(frozen=True)
class Compensator:
    """Karnopp compensator: friction model, velocity band divisor N_c > 1 [-], error scale e_T [m].

    Inside the narrow band [dv_n1, dv_p1] the zero-velocity term (3) grows with the position error
    and is full at e_T. Raises BadModel where N_c <= 1 or e_T <= 0. Source: paper, eqs. (3), (4).
    """

    friction: Karnopp
    N_c: float
    e_T: float

    def __post_init__(self) -> None:
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
