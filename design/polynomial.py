"""Polynomials in z^-1: float64 arrays [c0, c1, ...] in ascending powers of z^-1."""

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from identification.arrays import Array
from identification.errors import BadSpecification

ComplexArray = NDArray[np.complex128]
INTEGRATOR = np.array([1.0, -1.0])
SAME_ROOT = 1e-9  # backward error under which a value counts as a root of a polynomial


def as_polynomial(values: ArrayLike, name: str = "polynomial") -> Array:
    """The coefficients as a float64 array, trailing zeros trimmed; the caller's array is not kept.

    values: real coefficients [c0, c1, ...], shape (n,), or one number. name: for the error.
    Raises BadSpecification where they are empty, complex, not finite or not one row.
    """
    source: Any = values
    if np.iscomplexobj(source):
        raise BadSpecification(f"{name}: complex coefficients found, real ones needed")
    try:
        c: Array = np.array(source, dtype=np.float64, ndmin=1)
    except (TypeError, ValueError):
        raise BadSpecification(f"{name}: not a row of numbers; give [c0, c1, ...]") from None
    if c.ndim != 1 or c.size == 0:
        raise BadSpecification(f"{name}: shape {c.shape} found, one row [c0, c1, ...] needed")
    if not math.isfinite(float(c.sum())):
        raise BadSpecification(f"{name}: NaN or infinite coefficients; give finite ones")
    return c if c[-1] != 0.0 else trim(c)


def check_period(h: float) -> float:
    """The sampling period h [s]; raises BadSpecification unless it is finite and positive."""
    value: object = h
    if not (isinstance(value, int | float | np.number) and math.isfinite(h) and h > 0):
        raise BadSpecification(f"sampling period h = {h} s, must be finite and > 0")
    return float(h)


def trim(c: Array, tolerance: float = 0.0) -> Array:
    """`c` without trailing coefficients of at most `tolerance` times the largest; at least one."""
    size = np.abs(c)
    nonzero = np.flatnonzero(size > tolerance * size.max())
    return c[: nonzero[-1] + 1] if nonzero.size else c[:1]


def leading_zeros(c: Array) -> int:
    """The delay in samples: how many leading coefficients are zero (all, for the zero one)."""
    nonzero = np.flatnonzero(c)
    return int(nonzero[0]) if nonzero.size else int(c.size)


def multiply(*factors: Array) -> Array:
    """The product of the factors; [1] where there is none."""
    out = np.ones(1)
    for factor in factors:
        out = np.convolve(out, factor)
    return out


def add(c: Array, d: Array) -> Array:
    """The sum of two polynomials of any degrees."""
    out = np.zeros(max(c.size, d.size))
    out[: c.size] += c
    out[: d.size] += d
    return out


def divide(c: Array, factor: Array) -> tuple[Array, float]:
    """Least-squares quotient c / factor, and the remainder's largest size relative to c's.

    Stable for factors with roots on either side of the unit circle, where long division is not.
    """
    n = c.size - factor.size + 1
    if n < 1:
        return np.zeros(1), 1.0
    matrix = np.zeros((c.size, n))
    for k in range(n):
        matrix[k : k + factor.size, k] = factor
    quotient = np.linalg.lstsq(matrix, c, rcond=None)[0].astype(np.float64)
    scale = float(np.abs(c).max()) or 1.0
    return quotient, float(np.abs(c - matrix @ quotient).max()) / scale


def evaluate(c: Array, z: ComplexArray | Array | complex) -> ComplexArray:
    """c(z^-1) at the points z (not 0), shape of `z`."""
    q = 1.0 / np.asarray(z, dtype=np.complex128)
    out = np.full(q.shape, c[-1], dtype=np.complex128)
    for value in c[-2::-1]:
        out *= q
        out += value
    return out


def roots(c: Array) -> ComplexArray:
    """The roots as values of z, roots at z = 0 and at infinity (pure delay) left out."""
    nonzero = np.flatnonzero(c)
    if nonzero.size < 2:
        return np.zeros(0, dtype=np.complex128)
    found = np.roots(c[nonzero[0] : nonzero[-1] + 1])
    return np.asarray(found, dtype=np.complex128)


def largest_root(c: Array) -> float:
    """|z| of the largest root, 0 where there is none; as `roots`, without their order."""
    nonzero = np.flatnonzero(c)
    if nonzero.size < 2:
        return 0.0
    c = c[nonzero[0] : nonzero[-1] + 1]
    companion = np.eye(c.size - 1, k=-1)
    companion[0] = -c[1:] / c[0]
    return float(np.abs(np.linalg.eigvals(companion)).max())


def root_values(z: ArrayLike, name: str = "poles") -> ComplexArray:
    """z as one row of complex numbers; raises BadSpecification where they are not numbers."""
    try:
        return np.atleast_1d(np.asarray(z, dtype=np.complex128)).ravel()
    except (TypeError, ValueError):
        raise BadSpecification(f"{name}: not numbers; give values of z") from None


def from_roots(z: ArrayLike, name: str = "poles") -> Array:
    """The real polynomial prod(1 - z_k z^-1); a root at 0 adds nothing.

    z: roots, complex ones with their conjugates, shape (n,). Raises BadSpecification where one
    is not finite or a conjugate is missing.
    """
    values = root_values(z, name)
    if not np.all(np.isfinite(values)):
        raise BadSpecification(f"{name}: NaN or infinite value; give finite values of z")
    upper = np.sort_complex(values[values.imag > 0])
    lower = np.sort_complex(values[values.imag < 0].conj())
    if upper.size != lower.size or not np.allclose(upper, lower, rtol=1e-9, atol=1e-12):
        raise BadSpecification(f"{name}: a complex value without its conjugate; give both")
    real = [np.array([1.0, -float(v)]) for v in values[values.imag == 0].real]
    pairs = [np.array([1.0, -2.0 * float(v.real), float(abs(v)) ** 2]) for v in upper]
    return trim(multiply(*real, *pairs))


def second_order(w_n: float, zeta: float, h: float) -> Array:
    """`s^2 + 2 zeta w_n s + w_n^2` sampled at h: its roots carried over by z = exp(s h).

    w_n: natural frequency [rad/s], zeta: damping [-], h: period [s]; zeta >= 1 gives two real
    roots. Raises BadSpecification where w_n or h is not positive, zeta is negative, or the damped
    frequency is above pi/h (it would alias). Source: exact root mapping, PAPER 'Pole placement'.
    """
    h = check_period(h)
    if not (math.isfinite(w_n) and w_n > 0):
        raise BadSpecification(f"w_n = {w_n:g} rad/s, must be finite and > 0")
    if not (math.isfinite(zeta) and zeta >= 0):
        raise BadSpecification(f"damping zeta = {zeta:g}, must be finite and 0 or more")
    if zeta >= 1:
        fast = zeta + math.sqrt(zeta * zeta - 1)
        return multiply(*(np.array([1.0, -math.exp(-w_n * h * x)]) for x in (fast, 1 / fast)))
    w_d = w_n * math.sqrt(1 - zeta * zeta)
    if w_d * h > math.pi:
        raise BadSpecification(
            f"w_n = {w_n:g} rad/s, zeta = {zeta:g}: damped frequency {w_d:g} rad/s is above "
            f"pi/h = {math.pi / h:g} rad/s and would alias; lower w_n or h"
        )
    decay = math.exp(-zeta * w_n * h)
    return np.array([1.0, -2.0 * decay * math.cos(w_d * h), decay * decay])


def frequency_and_damping(z: complex, h: float) -> tuple[float, float]:
    """w_n [rad/s] and zeta of the continuous root that maps to z by z = exp(s h); z = 1: (0, 0)."""
    if z == 0:
        return math.inf, 1.0
    s = complex(np.log(complex(z))) / h
    return abs(s), (-s.real / abs(s) if s != 0 else 0.0)


def describe_root(z: complex, h: float | None = None) -> str:
    """The root in words: its value of z and, with h [s], its frequency and damping."""
    imag = abs(z.imag) > 1e-9 * max(1.0, abs(z))
    text = f"z = {z.real:.6g}" + (f" +/- {abs(z.imag):.6g}j" if imag else "")
    if h is None:
        return text
    w_n, zeta = frequency_and_damping(z if imag else complex(z.real), h)
    return f"{text} ({w_n:.4g} rad/s, zeta {zeta:.3g})"


def root_error(c: Array, z: complex) -> float:
    """Relative change of c's coefficients that makes z a root of it (backward error), 0 to 1."""
    point, series = (z, c) if abs(z) < 1 else (1 / z, c[::-1])
    size = float(np.polyval(np.abs(series), abs(point)))
    return abs(complex(np.polyval(series, point))) / size if size > 0 else 0.0


def common_roots(
    c: Array, d: Array, tolerance: float = SAME_ROOT, distance: float = 1e-2
) -> ComplexArray:
    """Roots of both c and d as values of z, matched one to one (multiplicity counts).

    tolerance: relative coefficient error that is allowed in making them common. distance: how far
    apart two matched roots may lie (multiple roots scatter under rounding).
    """
    found: list[complex] = []
    left = list(roots(d))
    for z in roots(c):
        if not left:
            break
        k = int(np.argmin([abs(z - other) for other in left]))
        near = abs(z - left[k]) <= distance * max(1.0, abs(z))
        if near and min(root_error(d, z), root_error(c, left[k])) <= tolerance:
            found.append((z + left.pop(k)) / 2)
    return np.array(found, dtype=np.complex128)
