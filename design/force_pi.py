"""The PI controller of a force loop."""

import math
from dataclasses import dataclass

from identification.errors import BadModel


@dataclass(frozen=True)
class ForcePI:
    """Force controller k_i (1 + h z^-1/(T_i (1 - z^-1))); k_i [V/N], T_i [s]. Paper, eq. (9).

    Raises BadModel where a value is not finite or T_i is not positive.
    """

    k_i: float
    T_i: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.k_i) and math.isfinite(self.T_i) and self.T_i > 0):
            raise BadModel(f"k_i = {self.k_i:g} V/N, T_i = {self.T_i:g} s: need T_i > 0, finite")
