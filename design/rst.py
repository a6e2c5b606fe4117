"""The RST controller u = (T r - R y)/S, by pole placement."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from design.place import solve_diophantine
from design.polynomial import (
    ComplexArray,
    add,
    as_polynomial,
    check_period,
    common_roots,
    describe_root,
    multiply,
    root_error,
    roots,
)
from design.specification import (
    RSTSpecification,
    auxiliary_polynomial,
    check_cancelled,
    dominant_polynomial,
    normalised_plant,
    reference_model,
    split_zeros,
    tracking_polynomial,
)
from identification.arrays import Array, frozen
from identification.errors import BadSpecification


@dataclass(frozen=True, eq=False)
class RST:
    """Controller S u = T (B_m/A_m) r - R y, polynomials in ascending powers of z^-1; h [s].

    P: the closed loop A S + B R it was designed for, None where it was not made from a plant.
    B_m/A_m: the tracking model, 1 by default. The arrays are read-only copies.
    Raises BadSpecification where a coefficient is not finite, S[0] or A_m[0] is 0, or h <= 0.
    """

    R: Array
    S: Array
    T: Array
    h: float
    P: Array | None = None
    B_m: Array = field(default_factory=lambda: np.ones(1))
    A_m: Array = field(default_factory=lambda: np.ones(1))

    def __post_init__(self) -> None:
        object.__setattr__(self, "h", check_period(self.h))
        for name in ("R", "S", "T", "P", "B_m", "A_m"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, frozen(as_polynomial(value, name)))
        for name in ("S", "A_m"):
            if getattr(self, name)[0] == 0.0:
                raise BadSpecification(f"{name}[0] = 0: not causal; divide out the delay")

    @property
    def stable(self) -> bool:
        """Whether the controller itself has no pole outside the unit circle (an integrator may)."""
        return bool(np.all(np.abs(roots(self.S)) <= 1 + 1e-9))


def closed_loop(A: ArrayLike, B: ArrayLike, controller: RST) -> Array:
    """P = A S + B R of the plant A, B under the controller, nothing cancelled."""
    A, B = as_polynomial(A, "A"), as_polynomial(B, "B")
    return add(np.convolve(A, controller.S), np.convolve(B, controller.R))


def closed_loop_poles(A: ArrayLike, B: ArrayLike, controller: RST) -> ComplexArray:
    """All closed-loop poles z other than 0, largest first, cancelled modes included."""
    z = roots(closed_loop(A, B, controller))
    return z[np.argsort(-np.abs(z), kind="stable")]


def design_rst(A: ArrayLike, B: ArrayLike, h: float, asked: RSTSpecification) -> RST:
    """The RST controller of least degree that places the closed-loop poles.

    A, B: plant, ascending powers of z^-1, delay as leading zeros of B; h [s]. Where B[0] is not 0
    the controller gets one sample of delay, H_R z^-1, to be realisable.

    Raises BadSpecification with the reason where no controller meets this: see
    `solve_diophantine`; also for unstable poles, cancelled zeros that are unstable or badly
    damped, B(1) = 0. Source: paper, section 3.3.4; PAPER.md 'Pole placement' for what it printed.
    """
    h = check_period(h)
    A, B = normalised_plant(A, B)
    P_d, P_a = dominant_polynomial(asked.dominant, h), auxiliary_polynomial(asked.auxiliary, h)
    B_plus, B_minus = split_zeros(B, asked.cancel, h)
    H_R, H_S = as_polynomial(asked.H_R, "H_R"), as_polynomial(asked.H_S, "H_S")
    if B[0] != 0.0:
        H_R = np.concatenate([[0.0], H_R])
    R, S = solve_diophantine(A, B_minus, np.convolve(P_d, P_a), H_R=H_R, H_S=H_S, h=h)
    S = np.convolve(S, B_plus)
    R, S = R / S[0], S / S[0]
    P = multiply(P_d, P_a, B_plus)
    # A zero of B in S is cancelled only if it is a closed-loop pole; else S is just large.
    shared = [z for z in common_roots(S, B, distance=1e-6) if root_error(P, complex(z)) < 1e-9]
    check_cancelled(np.array(shared, dtype=np.complex128), h)
    B_m, A_m = reference_model(asked.model, h)
    forward = tracking_polynomial(asked.T, R, B_minus, P_d, P_a)
    controller = RST(R, S, forward, h, P, B_m, A_m)
    for z in closed_loop_poles(A, B, controller)[:1]:
        if abs(z) >= 1:
            raise BadSpecification(
                f"rounding moves a closed-loop pole to {describe_root(complex(z), h)}: too "
                "ill-conditioned for float64; move the poles away from z = 1, or lower the order"
            )
    return controller
