"""To objects of python-control; `control` is imported on first use, since it is slow."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from design.polynomial import as_polynomial, check_period, trim
from design.rst import RST
from identification.errors import BadSpecification


def to_control(A: ArrayLike, B: ArrayLike, h: float) -> Any:
    """B/A as a discrete control.TransferFunction in z; A, B ascending in z^-1, h [s].

    Raises BadSpecification where A[0] is 0 or a coefficient is not finite.
    """
    import control

    a, b = as_polynomial(A, "A"), as_polynomial(B, "B")
    if a[0] == 0.0:
        raise BadSpecification("A[0] = 0: not causal; divide out the delay")
    n = max(a.size, b.size)
    num, den = np.pad(b, (0, n - b.size)), np.pad(a, (0, n - a.size))
    leading = np.flatnonzero(num)
    num = num[leading[0] :] if leading.size else np.zeros(1)
    return control.tf(num, den, check_period(h))


def controller_to_control(controller: RST) -> tuple[Any, Any]:
    """The controller as transfer functions in z: feedback R/S and forward T B_m/(S A_m)."""
    forward = np.convolve(controller.T, controller.B_m)
    return (
        to_control(controller.S, controller.R, controller.h),
        to_control(np.convolve(controller.S, controller.A_m), trim(forward), controller.h),
    )


def frd(H: ArrayLike, w: ArrayLike) -> Any:
    """A frequency response H (k,) at w [rad/s] as control.FRD."""
    import control

    return control.FRD(np.asarray(H), np.asarray(w, dtype=np.float64))
