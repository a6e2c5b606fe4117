"""PIDs that place the dominant closed-loop poles: what is left free in them, and how it is used."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np
from scipy.optimize import lsq_linear, minimize

from design.place import solve_sylvester
from design.polynomial import INTEGRATOR, add, describe_root, largest_root, multiply, roots
from identification.arrays import Array
from identification.errors import BadSpecification

FILTERED, ANY = -0.1, 0.999  # largest s1: -s1 = e^(-h/eps) >= 0.1 is a derivative filter


class Point(NamedTuple):
    """s1 and t, and the largest |z| among the poles that they leave."""

    x: Array
    radius: float


@dataclass(frozen=True, eq=False)
class DominantPID:
    """The PIDs whose closed loop is P_d Q: S = (1 - z^-1)(1 + s1 z^-1), R = R_0 + s1 R_1 + t P_d.

    Q = Q_0 + s1 Q_1 + t B is linear in the two freedoms s1 and t.
    """

    P_d: Array
    R_0: Array
    R_1: Array
    Q_0: Array
    Q_1: Array
    B: Array

    @classmethod
    def of(cls, A: Array, B: Array, P_d: Array, h: float) -> "DominantPID":
        """Those of a plant A, B in z^-1, h [s]; raises BadSpecification where a pole lies at a
        zero of the plant."""
        Q_0, R_0 = _with_dominant(A, B, P_d, np.array([1.0]), h)
        Q_1, R_1 = _with_dominant(A, B, P_d, np.array([0.0, 1.0]), h)
        return cls(P_d, R_0, R_1, Q_0, Q_1, B)

    def placed(self, P_a: Array) -> tuple[Array, Array]:
        """R and S with Q nearest to P_a; where that is slower than P_d, with the least radius."""
        goal = np.pad(P_a, (0, max(self._terms[0].size - P_a.size, 0)))
        Q_0, Q_1, Q_2 = (np.pad(c, (0, goal.size - c.size)) for c in self._terms)
        freedom = np.stack([Q_1, Q_2], axis=1)
        limits = ([-0.95, -np.inf], [FILTERED, np.inf])
        x = np.asarray(lsq_linear(freedom, goal - Q_0, limits).x, dtype=np.float64)
        # Any other stable filter than that of a derivative is the last resort.
        for upper, wanted in ((FILTERED, float(np.abs(roots(self.P_d)).max())), (ANY, 1 - 1e-9)):
            if self.radius(x, upper) > wanted:
                found = self._filtered if upper == FILTERED else self._any
                x = min((self._refined(x, upper), *found), key=lambda one: one.radius).x
        s1, t = float(x[0]), float(x[1]) * self._size
        S = np.convolve(INTEGRATOR, np.array([1.0, s1]))
        return add(self.R_0 + s1 * self.R_1, t * self.P_d), S

    def radius(self, x: Array, upper: float) -> float:
        """Largest |z| of Q's roots at x = (s1, t over the size of B), with a fine for s1 out of
        its bounds."""
        s1, t = (float(value) for value in x)
        outside = max(s1 - upper, -0.999 - s1, 0.0)
        Q_0, Q_1, Q_2 = self._terms
        return largest_root(Q_0 + s1 * Q_1 + t * Q_2) + 1e3 * outside

    @cached_property
    def _size(self) -> float:
        return 1.0 / float(np.abs(self.B).max())

    @cached_property
    def _terms(self) -> tuple[Array, Array, Array]:
        """Q_0, Q_1 and B over its size, of one length."""
        n = max(self.Q_0.size, self.Q_1.size, self.B.size)
        Q_0, Q_1, B = (np.pad(c, (0, n - c.size)) for c in (self.Q_0, self.Q_1, self.B))
        return Q_0, Q_1, self._size * B

    @cached_property
    def _filtered(self) -> tuple[Point, ...]:
        return self._searched(FILTERED)

    @cached_property
    def _any(self) -> tuple[Point, ...]:
        return self._searched(ANY)

    def _searched(self, upper: float) -> tuple[Point, ...]:
        """Least radii from a coarse grid's best points, which no auxiliary pole changes."""
        sizes = max(1.0, float(np.abs(self.Q_0).max())) * np.geomspace(1e-4, 1e2, 13)
        grid = [np.array([s, t]) for s in np.linspace(-0.9, 0.0, 7) for t in (*-sizes, 0.0, *sizes)]
        radius = partial(self.radius, upper=upper)
        return tuple(self._refined(x, upper) for x in sorted(grid, key=radius)[:4])

    def _refined(self, x: Array, upper: float) -> Point:
        radius: Callable[[Array], float] = partial(self.radius, upper=upper)
        found = minimize(radius, x, method="Nelder-Mead", options={"maxiter": 300})
        return Point(np.asarray(found.x, dtype=np.float64), float(found.fun))


def _with_dominant(A: Array, B: Array, P_d: Array, filter_: Array, h: float) -> tuple[Array, Array]:
    """(Q, R) with A (1 - z^-1) filter_ + B R = P_d Q, deg R <= 1."""
    open_loop = multiply(A, INTEGRATOR, filter_)
    R, Q, sound = solve_sylvester(P_d, -B, open_loop)
    if not sound:
        raise BadSpecification(
            f"a dominant pole {describe_root(complex(roots(P_d)[0]), h)} lies at a zero of the "
            "plant, where feedback is blind; move it"
        )
    return Q, R
