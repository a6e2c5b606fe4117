"""A gain schedule: a position controller whose numbers change along the travel, with the load or
with the direction, straight between the points of a table.

With R_1 = R(1) = T(1), S = (1 - q) S', R = R_1 + (1 - q) R', T = R_1 + (1 - q) T', q = z^-1,

    S' (u_free - base) = R_1 (r - y) + T' (r - r[k-1]) - R' (y - y[k-1]),
    base[k+1] = u + decay (u_free - u),

where u is u_free as it was carried out. It is the law of `design.drive_law` in increments: where
the numbers change nothing leaps, and it does not matter where the position is counted from.
Source: Rugh, Shamma, Research on gain scheduling, Automatica 36 (2000) 1401, section 4.
"""

import math
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from design.drive_law import DriveLaw
from design.polynomial import INTEGRATOR, add, divide
from identification.arrays import Array
from identification.errors import BadSpecification

Over = Literal["place", "load", "direction"]
OVERS: tuple[Over, ...] = get_args(Over)  # in the order of `servo_kernels.OVER_PLACE`
NOT_INTEGRATING = 1e-6  # of its coefficients, that S(1) or T(1) - R(1) is at most


@dataclass(frozen=True)
class Schedule:
    """A law at each point of `at`, and beside it what is fed forward of friction there.

    over: "place", the reference's, so that the table is no feedback of its own; "load", the size of
    the force that was fed forward the sample before, without a feed-forward of the force itself;
    "direction", from -1 to 1. at: (k,) [m, N, -], rising; laws: of one period;
    friction: F_cp, F_cn [N], F_vp, F_vn [N s/m] of a feed-forward, (k, 4); forget [s]: in which
    time what was not carried out is forgotten; span: speed [m/s] from which a direction counts in
    full.
    Raises BadSpecification where the points do not rise or a law has no integrator.
    """

    over: Over
    at: tuple[float, ...]
    laws: tuple[DriveLaw, ...]
    friction: tuple[tuple[float, float, float, float], ...]
    forget: float
    span: float

    def __post_init__(self) -> None:
        if len(self.at) < 2 or np.any(np.diff(self.at) <= 0.0):
            raise BadSpecification(f"points of a schedule {self.at}: need two or more that rise")
        if not len(self.at) == len(self.laws) == len(self.friction):
            raise BadSpecification(
                f"{len(self.at)} points of a schedule, {len(self.laws)} laws,"
                f" {len(self.friction)} rows of friction: need one of each at every point"
            )
        _ = self.rows

    @property
    def size(self) -> int:
        """Coefficients of each of T', R' and S'."""
        return max(max(len(c) for c in (one.T, one.R, one.S)) - 1 for one in self.laws)

    @property
    def rows(self) -> Array:
        """As the kernels take it, (k, 5 + 3 size): friction, R(1), T', R', S' but its first."""
        out = []
        for law, friction in zip(self.laws, self.friction, strict=True):
            T, R, S = (np.array(c) for c in (law.T, law.R, law.S))
            apart = max(abs(S.sum()) / np.abs(S).sum(), abs(T.sum() - R.sum()) / abs(R.sum()))
            if apart > NOT_INTEGRATING:
                raise BadSpecification("a schedule needs laws with an integrator; this has none")
            gain = np.array([float(R.sum())])
            parts = [divide(c, INTEGRATOR)[0] for c in (add(T, -gain), add(R, -gain), S)]
            out.append([*friction, *gain, *(v for c in parts for v in self._padded(c))])
        rows = np.array(out)
        return np.delete(rows, 5 + 2 * self.size, axis=1)

    def _padded(self, c: Array) -> Array:
        return np.pad(c, (0, self.size - len(c)))

    def decay(self, h: float) -> float:
        """By which what was not carried out is left after a sample of h [s]."""
        return math.exp(-h / self.forget) if self.forget > 0.0 else 0.0
