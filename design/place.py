"""Pole placement: the Diophantine equation A H_S S' + B H_R R' = P, solved exactly once."""

import math

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg.lapack import dgetrf, dgetrs

from design.polynomial import (
    SAME_ROOT,
    ComplexArray,
    as_polynomial,
    common_roots,
    describe_root,
    divide,
    from_roots,
    root_error,
)
from design.specification import ONE
from identification.arrays import Array
from identification.errors import BadSpecification

EPS = float(np.finfo(np.float64).eps)
SUSPECT_PIVOT = 1e-12  # below this the equation may be singular: look for a common factor
CERTAIN_DISTANCE = 1e-6
LOST_DIGITS = 1e-6  # relative error of P that float64 rounding of R and S alone may cause
NEARLY_SAME_ROOT = 1e-6


def solve_diophantine(
    A: ArrayLike,
    B: ArrayLike,
    P: ArrayLike,
    *,
    H_R: ArrayLike = ONE,
    H_S: ArrayLike = ONE,
    h: float | None = None,
) -> tuple[Array, Array]:
    """The controller (R, S) of least degree with A S + B R = P, R = H_R R', S = H_S S'.

    A, B: plant in ascending powers of z^-1, the delay as leading zeros of B. P: closed loop, any
    degree; above the least one S' takes the rest. H_R, H_S: fixed parts. h [s]: only to name
    frequencies in errors. With a = A H_S and b = B H_R, deg R' < deg a and
    deg S' < max(deg b, deg P - deg a + 1), which is unique; where it
    would have S[0] = 0, which B[0] != 0 allows, the one with R = z^-1 H_R R' is given.
    A common factor of a and b that P contains is divided out; one that P lacks is refused.

    Raises BadSpecification where no such controller exists (common factor, H_R and H_S sharing a
    root, A[0], H_S[0] or P[0] zero, B or H_R all zero) or float64 cannot hold it.
    Source: Sylvester equation, e.g. Landau & Zito, Digital Control Systems, section 3.3.
    """
    A, B, P = as_polynomial(A, "A"), as_polynomial(B, "B"), as_polynomial(P, "P")
    H_R, H_S = as_polynomial(H_R, "H_R"), as_polynomial(H_S, "H_S")
    for name, c in (("A", A), ("P", P), ("H_S", H_S)):
        if c[0] == 0.0:
            raise BadSpecification(f"{name}[0] = 0: a term of advance; shift {name} to {name}[0]=1")
    for name, c in (("B", B), ("H_R", H_R)):
        if c[-1] == 0.0:
            raise BadSpecification(f"{name} is all zero: nothing to control with; give {name} != 0")
    a = A if H_S.size == 1 and H_S[0] == 1.0 else np.convolve(A, H_S)
    b = B if H_R.size == 1 and H_R[0] == 1.0 else np.convolve(B, H_R)
    if b.size == 1 and P.size < a.size:  # S' = 0 would do: no controller
        return solve_diophantine(A, B, P, H_R=_later(H_R), H_S=H_S, h=h)
    r, s, sound = solve_sylvester(a, b, P)
    if not sound:
        r, s = _second_check(A, B, H_R, H_S, P, h)
    R, S = np.convolve(H_R, r), np.convolve(H_S, s)
    if b[0] != 0.0 and abs(S[0]) <= 1e-12 * np.abs(S).max():
        return solve_diophantine(A, B, P, H_R=_later(H_R), H_S=H_S, h=h)
    return R, S


def _later(c: Array) -> Array:
    """z^-1 c."""
    return np.concatenate([[0.0], c])


def _sylvester(a: Array, b: Array, n_s: int, n_r: int) -> Array:
    """Columns a, a z^-1, ... (n_s of them), then b, b z^-1, ... (n_r), as a Fortran matrix."""
    n = n_s + n_r
    buffer = np.zeros(n * n + n)
    # A column that starts one row lower starts n + 1 further on in column-major order.
    buffer[: n_s * (n + 1)].reshape(n_s, n + 1)[:, : a.size] = a
    buffer[n * n_s : n * n_s + n_r * (n + 1)].reshape(n_r, n + 1)[:, : b.size] = b
    return buffer[: n * n].reshape((n, n), order="F")


def solve_sylvester(a: Array, b: Array, P: Array) -> tuple[Array, Array, bool]:
    """R', S' of least degree with a S' + b R' = P, and whether they are beyond doubt."""
    n_r = a.size - 1
    if n_r == 0:
        return np.zeros(1), P / a[0], True
    n_s = max(b.size - 1, P.size - n_r)
    b_scale = math.ldexp(1.0, math.frexp(float(np.abs(a).max()) / float(np.abs(b).max()))[1])
    b = b * b_scale
    target = np.zeros(n_s + n_r)
    target[: P.size] = P
    lu, pivots, info = dgetrf(_sylvester(a, b, n_s, n_r), overwrite_a=True)
    if info != 0:
        return np.zeros(n_r), np.zeros(n_s), False
    x = dgetrs(lu, pivots, target)[0]
    # One step of refinement, the residual in extended precision where the machine has it.
    residual = target - np.convolve(a.astype(np.longdouble), x[:n_s])
    residual[: b.size + n_r - 1] -= np.convolve(b.astype(np.longdouble), x[n_s:])
    x += dgetrs(lu, pivots, residual.astype(np.float64))[0]
    r, s = x[n_s:], x[:n_s]
    steps = np.abs(lu.diagonal())
    size = np.abs(a).sum() * np.abs(s).max() + np.abs(b).sum() * np.abs(r).max()
    allowed = LOST_DIGITS * np.abs(P).max()
    sound = (
        steps.min() > SUSPECT_PIVOT * steps.max()
        and EPS * size <= allowed
        and np.abs(residual).max() <= allowed
    )
    return r * b_scale, s, bool(sound)


def _holds(a: Array, b: Array, r: Array, s: Array, P: Array) -> bool:
    """Whether a s + b r = P holds, and would still if r and s were rounded once more."""
    n = max(a.size + s.size, b.size + r.size) - 1
    size, error = np.zeros(n), np.zeros(n)
    error[: P.size] = P
    for c, x in ((a, s), (b, r)):
        size[: c.size + x.size - 1] += np.convolve(np.abs(c), np.abs(x))
        error[: c.size + x.size - 1] -= np.convolve(c, x)
    worst = max(float(np.abs(error).max()), EPS * float(size.max()))
    return worst <= LOST_DIGITS * float(np.abs(P).max())


def _second_check(
    A: Array, B: Array, H_R: Array, H_S: Array, P: Array, h: float | None
) -> tuple[Array, Array]:
    """R', S' where the equation is (nearly) singular, or the refusal that says why."""
    for z in common_roots(H_R, H_S):
        raise BadSpecification(
            f"H_R and H_S share the root {describe_root(complex(z), h)}: R and S would cancel "
            "there; take it out of one of them"
        )
    a, b = np.convolve(A, H_S), np.convolve(B, H_R)
    shared = common_roots(a, b, distance=CERTAIN_DISTANCE)
    for z in shared:
        if root_error(P, complex(z)) > SAME_ROOT:
            raise BadSpecification(_common_factor_text(complex(z), A, B, H_R, H_S, h))
    if shared.size:
        factor = from_roots(_paired(shared))
        r, s, _ = solve_sylvester(*(divide(c, factor)[0] for c in (a, b, P)))
        if _holds(a, b, r, s, P):
            return r, s
    r, s, _ = solve_sylvester(a, b, P)
    if s.any() and _holds(a, b, r, s, P):
        return r, s
    for z in common_roots(a, b, NEARLY_SAME_ROOT):
        if root_error(P, complex(z)) > SAME_ROOT:
            raise BadSpecification(_common_factor_text(complex(z), A, B, H_R, H_S, h, "nearly "))
    raise BadSpecification(
        f"the placement of {P.size - 1} poles with deg A = {A.size - 1}, deg B = {B.size - 1} is "
        f"too ill-conditioned for float64 (closed loop uncertain by more than {LOST_DIGITS:g}); "
        "lower the order of the plant, or move the poles nearer to the plant's"
    )


def _paired(z: ComplexArray) -> ComplexArray:
    """Roots made exactly real or conjugate, so that their polynomial is real."""
    real = z[np.abs(z.imag) <= 1e-7 * np.abs(z)].real
    upper = z[z.imag > 1e-7 * np.abs(z)]
    return np.concatenate([real, upper, upper.conj()]).astype(np.complex128)


def _common_factor_text(
    z: complex, A: Array, B: Array, H_R: Array, H_S: Array, h: float | None, nearly: str = ""
) -> str:
    """Why the common root z of A H_S and B H_R cannot be, and what to do about it."""
    near = SAME_ROOT if not nearly else NEARLY_SAME_ROOT
    in_S, in_R = root_error(H_S, z) <= near, root_error(H_R, z) <= near
    root = describe_root(z, h)
    if in_S and abs(z - 1) < 1e-6:
        return (
            f"H_S asks for an integrator but B has a {nearly}common zero at {root}: the plant has "
            "no static gain to hold a reference with; drop the integrator"
        )
    left, right = "H_S" if in_S else "A", "H_R" if in_R else "B"
    head = f"{left} and {right} have the {nearly}common factor at {root}, not in P: "
    if in_S:
        return head + "that zero of the plant cannot lie in H_S; take it out of H_S"
    if in_R:
        return head + "feedback would be blind to that pole of the plant; take it out of H_R"
    if abs(z) >= 1:
        return head + "no controller can move this unstable pole; use another model or actuator"
    return head + "no controller can move it; remove it from A and B, or ask for it as a pole"
