"""What a loop is asked for: closed-loop poles, fixed parts, tracking; checked before solving."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from design.polynomial import (
    SAME_ROOT,
    ComplexArray,
    as_polynomial,
    check_period,
    describe_root,
    divide,
    frequency_and_damping,
    from_roots,
    leading_zeros,
    root_error,
    root_values,
    roots,
    second_order,
)
from identification.arrays import Array
from identification.errors import BadSpecification

Tracking = Literal["all-poles", "keep-dominant", "unit-static", "R"]
LEAST_DAMPING = 0.1  # of a plant zero that the controller may cancel
NEAREST_TO_ONE = 1e-12
LEAST_RATIO = 1e-150
ONE = (1.0,)


@dataclass(frozen=True, eq=False)
class RSTSpecification:
    """What an RST loop is asked for.

    dominant: (w_n [rad/s], zeta). auxiliary: further poles as values of z, the rest are at 0. H_R,
    H_S: fixed parts of R and S (integrator: H_S = [1, -1]). T: see `tracking_polynomial`. cancel:
    factor of B that S cancels (a pole of the loop then). model: (w_n, zeta) of the tracking model.
    """

    dominant: Sequence[float]
    auxiliary: ArrayLike = ()
    H_R: ArrayLike = ONE
    H_S: ArrayLike = ONE
    T: Tracking = "all-poles"
    cancel: ArrayLike = ONE
    model: Sequence[float] | None = None


def normalised_plant(A: ArrayLike, B: ArrayLike) -> tuple[Array, Array]:
    """A and B divided by A[0]; raises BadSpecification where A[0] is 0 or B is all zero."""
    a, b = as_polynomial(A, "A"), as_polynomial(B, "B")
    if a[0] == 0.0:
        raise BadSpecification("A[0] = 0: not a causal plant; write it as 1 + a1 z^-1 + ...")
    if leading_zeros(b) == b.size:
        raise BadSpecification("B is all zero: the command does not move the output")
    if np.abs(b).max() < LEAST_RATIO * np.abs(a).max() or abs(a[0]) < LEAST_RATIO * np.abs(a).max():
        raise BadSpecification(
            f"A[0] = {a[0]:.3g}, largest of B {np.abs(b).max():.3g}: too small beside A's largest "
            f"{np.abs(a).max():.3g}; scale the command or the output"
        )
    return a / a[0], b / a[0]


def pole_pair(w_n: float, zeta: float, h: float) -> ComplexArray:
    """The two poles z of `s^2 + 2 zeta w_n s + w_n^2` sampled at h [s]; w_n [rad/s], zeta [-]."""
    return np.asarray(np.roots(second_order(w_n, zeta, h)), dtype=np.complex128)


def dominant_polynomial(dominant: Sequence[float], h: float) -> Array:
    """The polynomial of the dominant poles (w_n [rad/s], zeta) at period h [s], degree 2.

    Raises BadSpecification where they are not stable, alias, or lie too close to z = 1 for float64.
    """
    try:
        w_n, zeta = (float(value) for value in dominant)
    except (TypeError, ValueError):
        raise BadSpecification(
            f"dominant poles: {dominant!r} found, give (w_n in rad/s, zeta)"
        ) from None
    if zeta <= 0:
        raise BadSpecification(
            f"dominant poles: damping zeta = {zeta:g} gives no decay; give zeta > 0"
        )
    P = second_order(w_n, zeta, h)
    if P.sum() <= NEAREST_TO_ONE:
        raise BadSpecification(
            f"dominant poles: w_n h = {w_n * h:.3g} rad puts them at z = 1 to within rounding; "
            f"raise w_n above {math.sqrt(NEAREST_TO_ONE) / h:.2g} rad/s, or sample more slowly"
        )
    return P


def auxiliary_polynomial(auxiliary: ArrayLike, h: float | None = None) -> Array:
    """The polynomial of the other closed-loop poles, given as values of z; 0 may be left out.

    Raises BadSpecification where one is on or outside the unit circle, or lacks its conjugate.
    """
    z = root_values(auxiliary, "auxiliary poles")
    P = from_roots(z, "auxiliary poles")
    for value in z[np.abs(z) >= 1]:
        raise BadSpecification(
            f"auxiliary pole {describe_root(complex(value), h)} with |z| = {abs(value):.6g}: not "
            "stable; give |z| < 1"
        )
    return P


def split_zeros(B: Array, cancel: ArrayLike, h: float) -> tuple[Array, Array]:
    """(B_plus, B_minus): `cancel` as the factor of B that S may cancel, and the rest of B.

    Raises BadSpecification where it is no factor of B, or a zero in it is unstable or badly
    damped (zeta < 0.1): it would go on ringing inside the loop.
    """
    B_plus = as_polynomial(cancel, "cancel")
    if B_plus[0] == 0.0:
        raise BadSpecification("cancel[0] = 0: a delay cannot be cancelled")
    B_plus = B_plus / B_plus[0]
    B_minus, rest = divide(B, B_plus)
    if rest > 1e-8 or any(root_error(B, complex(z)) > 1e-8 for z in roots(B_plus)):
        raise BadSpecification(
            f"cancel is not a factor of B (remainder {rest:.2g} of B); its roots must be zeros of "
            f"B: {', '.join(describe_root(complex(z)) for z in roots(B)) or 'none'}"
        )
    check_cancelled(roots(B_plus), h)
    return B_plus, B_minus


def check_cancelled(zeros: ComplexArray, h: float) -> None:
    """Raises BadSpecification unless every zero z may be cancelled: stable and well damped."""
    for z in zeros:
        value = complex(z)
        if abs(value) >= 1:
            raise BadSpecification(
                f"the plant's unstable zero {describe_root(value, h)} would be cancelled: the "
                "command would grow without bound; leave it in B"
            )
        zeta = frequency_and_damping(value, h)[1]
        if zeta < LEAST_DAMPING:
            raise BadSpecification(
                f"the plant's badly damped zero {describe_root(value, h)} would be cancelled: the "
                f"command would ring, at least zeta = {LEAST_DAMPING} needed; leave it in B"
            )


def tracking_polynomial(
    choice: Tracking, R: Array, B: Array, dominant: Array, auxiliary: Array
) -> Array:
    """T, so that the static gain from r to y is 1 (choice "R": only with an integrator in S).

    "all-poles": P/B(1), y/r = B/B(1), the paper's; "keep-dominant": y/r has the dominant poles
    only; "unit-static": the number P(1)/B(1), y/r has all poles; "R": T = R, control on the error.
    Raises BadSpecification where B(1) = 0 or the choice is unknown.
    """
    if choice not in get_args(Tracking):
        raise BadSpecification(f"T = {choice!r} unknown; choose one of {get_args(Tracking)}")
    if choice == "R":
        return R.copy()
    if root_error(B, 1.0) <= SAME_ROOT:
        raise BadSpecification(
            'the plant has a zero at z = 1 (B(1) = 0), so no T gives static gain 1; use T = "R"'
        )
    gain = 1.0 / float(B.sum())
    if choice == "all-poles":
        return np.convolve(dominant, auxiliary) * gain
    if choice == "keep-dominant":
        return auxiliary * float(dominant.sum()) * gain
    return np.array([float(dominant.sum()) * float(auxiliary.sum()) * gain])


def reference_model(model: Sequence[float] | None, h: float) -> tuple[Array, Array]:
    """(B_m, A_m) of the tracking model (w_n [rad/s], zeta), sampled every h [s]; (1, 1) for None.

    The zero-order-hold equivalent of w_n^2/(s^2 + 2 zeta w_n s + w_n^2) without its sample of
    delay, which the plant's own delay stands for. Raises BadSpecification as for dominant poles.
    """
    if model is None:
        return np.ones(1), np.ones(1)
    A_m = dominant_polynomial(model, check_period(h))
    w_n, zeta = (float(value) for value in model)
    # One step of the response, y(h), gives B_m[0]; unit static gain gives the other.
    if zeta < 1:
        w_d = w_n * math.sqrt(1 - zeta * zeta)
        ripple = math.cos(w_d * h) + zeta * w_n * h * float(np.sinc(w_d * h / math.pi))
        first = 1 - math.exp(-zeta * w_n * h) * ripple
    elif zeta == 1:
        first = 1 - math.exp(-w_n * h) * (1 + w_n * h)
    else:
        root = math.sqrt(zeta * zeta - 1)
        fast, slow = w_n * (zeta + root), w_n / (zeta + root)
        first = 1 - (fast * math.exp(-slow * h) - slow * math.exp(-fast * h)) / (fast - slow)
    return np.array([first, A_m.sum() - first]), A_m
