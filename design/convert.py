"""python-control objects in and out; `control` is imported on first use, since it is slow."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from design.polynomial import as_polynomial, check_period, trim
from design.rst import RST
from design.specification import normalised_plant
from identification.arrays import Array
from identification.errors import BadSpecification


def from_control(system: Any, h: float | None = None) -> tuple[Array, Array, float]:
    """(A, B, h) of a python-control transfer function or state space; h in s.

    system: one input, one output. A discrete one keeps its period; h gives it where the system
    leaves it open (dt = True), and samples a continuous one by zero-order hold.
    Raises BadSpecification where it is not such a system, is improper, or has another period.
    """
    import control

    if not isinstance(system, control.TransferFunction | control.StateSpace):
        raise BadSpecification(
            f"{type(system).__name__} found, a control.TransferFunction or StateSpace needed"
        )
    if system.ninputs != 1 or system.noutputs != 1:
        raise BadSpecification(
            f"{system.ninputs} inputs, {system.noutputs} outputs: pick one of each"
        )
    period = _period(system, h)
    if not system.isdtime(strict=True):
        system = control.sample_system(control.ss(system), period, method="zoh")
    transfer = control.tf(system)
    num = np.trim_zeros(np.asarray(transfer.num[0][0], dtype=np.float64), "f")
    den = np.trim_zeros(np.asarray(transfer.den[0][0], dtype=np.float64), "f")
    if num.size > den.size:
        raise BadSpecification(
            f"degree {num.size - 1} over {den.size - 1} in z: improper, the plant would answer "
            "before its command"
        )
    delay = np.zeros(den.size - num.size)
    A, B = normalised_plant(den, np.concatenate([delay, num]) if num.size else np.zeros(1))
    return A, B, period


def _period(system: Any, h: float | None) -> float:
    """The sampling period [s] from the system and from the caller, which must agree."""
    own = float(system.dt) if system.isdtime(strict=True) and system.dt is not True else None
    if own is None and h is None:
        raise BadSpecification(
            "the system has no sampling period (continuous, or dt = True); give h in s"
        )
    if own is not None and h is not None and abs(own - h) > 1e-9 * own:
        raise BadSpecification(
            f"the system is sampled at {own:g} s, h = {h:g} s asked; resample it, or leave h out"
        )
    return check_period(own if own is not None else h if h is not None else 0.0)


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
