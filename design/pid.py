"""PID, PI and PD controllers as RST, from their gains and by pole placement."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from design.dominant_pid import DominantPID
from design.place import solve_diophantine
from design.polynomial import (
    INTEGRATOR,
    add,
    check_period,
    describe_root,
    divide,
    roots,
    trim,
)
from design.rst import RST, closed_loop, closed_loop_poles
from design.specification import (
    Tracking,
    auxiliary_polynomial,
    dominant_polynomial,
    normalised_plant,
    tracking_polynomial,
)
from identification.arrays import Array
from identification.errors import BadSpecification

Sampling = Literal["zoh", "tustin"]
TORN = 1e-5  # by which rounding tears a double pole apart, at most


@dataclass(frozen=True)
class PIDGains:
    """k_R (b r - y + (r - y)/(T_i s) + T_d s/(eps s + 1) (c r - y)), sampled by zero-order hold.

    k_R [N/m] for a position loop with a force command; times T_i, T_d, eps [s]; set-point weights
    b, c [-], 1 for a PID on the error (Astrom & Hagglund, Advanced PID Control, section 3.4).
    """

    k_R: float
    T_i: float
    T_d: float
    eps: float
    b: float = 1.0
    c: float = 1.0


@dataclass(frozen=True)
class PID:
    """A digital PID with filtered derivative, S = (1 - z^-1)(1 + s1 z^-1), deg R = 2.

    gains: its parallel form, or None with the `reason`. exact: all closed-loop poles are as asked;
    if not, the dominant ones are, and rst.P says where the others lie; note: the slowest of them,
    where it is slower than the dominant ones, else None.
    """

    rst: RST
    gains: PIDGains | None
    reason: str | None
    exact: bool
    note: str | None = None


def pid_to_rst(
    k_R: float,
    T_i: float,
    T_d: float,
    eps: float,
    h: float,
    method: Sampling = "zoh",
    *,
    b: float = 1.0,
    c: float = 1.0,
) -> RST:
    """The PID of `PIDGains`, sampled at h, as RST; on the error (T = R) for b = c = 1.

    k_R [command/output unit], T_i, T_d, eps, h [s]; b, c: set-point weights [-]. method: "zoh"
    (step-invariant, the paper's rig forms: h z^-1/(T_i (1 - z^-1)) and
    T_d (1 - z^-1)/(eps (1 - e^(-h/eps) z^-1))) or "tustin" (bilinear), for both terms. Raises
    BadSpecification where a time is not positive (T_d may be 0).
    Source: paper, simulation section; its rig section for the sampled form.
    """
    integral, i_den = _integral(T_i, h, method)
    derivative, d_den = _derivative(T_d, eps, h, method)
    k_R = _gain("k_R", k_R)

    def weighted(b: float, c: float) -> Array:
        on_error = add(b * np.convolve(i_den, d_den), np.convolve(integral, d_den))
        return add(on_error, c * np.convolve(derivative, i_den)) * k_R

    return RST(weighted(1.0, 1.0), np.convolve(i_den, d_den), weighted(b, c), h)


def pi_to_rst(k_i: float, T_i: float, h: float, method: Sampling = "zoh") -> RST:
    """The PI k_i (1 + 1/(T_i s)) on the error, sampled at h [s], as RST (T = R).

    "zoh" gives the paper's C_F(z) = k_i (1 + h z^-1/(T_i (1 - z^-1))), k_i [V/N], T_i [s].
    Raises BadSpecification where T_i or h is not positive. Source: paper, eq. (9).
    """
    integral, i_den = _integral(T_i, h, method)
    R = add(i_den, integral) * _gain("k_i", k_i)
    return RST(R, i_den, R, h)


def pd_to_rst(k_d: float, T_d: float, eps: float, h: float, method: Sampling = "zoh") -> RST:
    """The PD k_d (1 + T_d s/(eps s + 1)) on the error, sampled at h [s], as RST (T = R).

    "zoh" gives the paper's C_y(z) = k_d (1 + T_d (1 - z^-1)/(eps (1 - e^(-h/eps) z^-1))),
    k_d [N/m], T_d, eps [s]. Raises BadSpecification where eps or h is not positive or T_d < 0.
    Source: paper, rig section.
    """
    derivative, d_den = _derivative(T_d, eps, h, method)
    R = add(d_den, derivative) * _gain("k_d", k_d)
    return RST(R, d_den, R, h)


def pid_gains(controller: RST) -> PIDGains:
    """The gains whose "zoh" form is the controller; the inverse of `pid_to_rst`.

    Raises BadSpecification where R and S are not of PID form, the derivative filter is not
    0 < e^(-h/eps) < 1, k_R = 0, T_i <= 0 or T_d < 0, or T is more than set-point weighting.
    """
    R, S = controller.R / controller.S[0], controller.S / controller.S[0]
    if S.size > 3 or R.size > 3 or abs(S.sum()) > 1e-9 * np.abs(S).sum():
        raise BadSpecification(
            f"deg R = {R.size - 1}, deg S = {S.size - 1}, S(1) = {S.sum():.3g}: a PID has degrees "
            "of at most 2 and S(1) = 0"
        )
    r0, _, r2 = np.pad(R, (0, 3 - R.size)).tolist()
    a = float(S[2]) if S.size == 3 else 0.0
    if not 0 < a < 1:
        raise BadSpecification(
            f"the derivative filter has its pole at z = {a:.4g}: no eps gives e^(-h/eps) there; "
            "keep the digital form, or move the auxiliary poles"
        )
    k_i = float(R.sum()) / (1 - a)
    k_R = (r0 - r2 - a * k_i) / (1 - a)
    eps = -controller.h / math.log(a)
    if k_R == 0 or k_i == 0:
        raise BadSpecification(f"k_R = {k_R:.4g}, k_i = {k_i:.4g}: no parallel form; both needed")
    derivative = r0 / k_R - 1
    if abs(derivative) < 1e-6:  # rounding of a PI
        derivative = 0.0
    T_i, T_d = controller.h * k_R / k_i, eps * derivative
    if T_i <= 0 or T_d < 0:
        raise BadSpecification(
            f"T_i = {T_i:.4g} s, T_d = {T_d:.4g} s: a parallel PID needs T_i > 0 and T_d >= 0; keep"
            " the digital form"
        )
    b, c = _weights(controller.T / controller.S[0], PIDGains(k_R, T_i, T_d, eps), controller.h)
    return PIDGains(k_R, T_i, T_d, eps, b, c)


def _weights(T: Array, gains: PIDGains, h: float) -> tuple[float, float]:
    """Set-point weights b, c with which the PID of these gains has this T."""
    plain = pid_to_rst(gains.k_R, gains.T_i, gains.T_d, gains.eps, h, b=0.0, c=0.0)
    first = pid_to_rst(gains.k_R, gains.T_i, gains.T_d, gains.eps, h, b=1.0, c=0.0)
    full = pid_to_rst(gains.k_R, gains.T_i, gains.T_d, gains.eps, h)
    goal = add(T, -plain.T)
    terms = np.zeros((max(goal.size, 3), 2))
    terms[:3, 0], terms[:3, 1] = first.T - plain.T, full.T - first.T
    goal = np.pad(goal, (0, len(terms) - goal.size))
    found = np.asarray(np.linalg.lstsq(terms, goal, rcond=None)[0], dtype=np.float64)
    if float(np.abs(terms @ found - goal).max()) > 1e-6 * float(np.abs(T).max()):
        raise BadSpecification("T is more than set-point weights b and c; keep the digital form")
    b, c = found.tolist()
    return b, c if gains.T_d > 0 else 1.0


def design_pid(
    A: ArrayLike,
    B: ArrayLike,
    h: float,
    *,
    dominant: Sequence[float],
    auxiliary: ArrayLike = (),
    T: Tracking = "R",
    freedom: Callable[[], DominantPID] | None = None,
) -> PID:
    """The digital PID that places the closed-loop poles, or only the dominant ones.

    A, B: plant in ascending powers of z^-1, h [s]. dominant: (w_n [rad/s], zeta). auxiliary:
    values of z, at most 2 for a plant of order 2 or less, where all poles are placed. For other
    plants the dominant pair is placed exactly and the rest by least squares on their polynomial;
    if that is unstable, by a search for the smallest radius. T: see `tracking_polynomial`. freedom:
    the PIDs that place this dominant pair, which designs with other auxiliary poles share.

    Raises BadSpecification where the poles cannot be placed or the loop would be unstable, naming
    the pole. Source: our own for higher orders; Landau & Zito, section 3.2 for order 2.
    """
    h = check_period(h)
    A, B = normalised_plant(A, B)
    P_d, P_a = dominant_polynomial(dominant, h), auxiliary_polynomial(auxiliary, h)
    if B[0] != 0.0:
        raise BadSpecification(
            f"B[0] = {B[0]:g}: the PID would act on an output that its own command moves at once; "
            "put the computing delay into B (a leading 0)"
        )
    exact = A.size <= 3 and B.size <= 3
    if exact:
        R, S = _place_all(A, B, P_d, P_a, h)
    else:
        R, S = (freedom() if freedom else DominantPID.of(A, B, P_d, h)).placed(P_a)
    P = trim(closed_loop(A, B, RST(R, S, R, h)), 1e-14)
    others = P_a if exact else divide(P, P_d)[0]
    rst = RST(R, S, tracking_polynomial(T, R, B, P_d, others), h, P)
    slowest = complex(closed_loop_poles(A, B, rst)[0])
    text = f"{describe_root(slowest, h)}, |z| = {abs(slowest):.4g}"
    if abs(slowest) >= 1:
        raise BadSpecification(
            "no PID found with these dominant poles keeps the loop stable: its best leaves a pole "
            f"at {text}; choose slower or better damped dominant poles, or design an RST"
        )
    slow = not exact and abs(slowest) > float(np.abs(roots(P_d)).max()) + TORN
    note = f"slower than the dominant poles: {text}; ask for slower ones" if slow else None
    try:
        return PID(rst, pid_gains(rst), None, exact, note)
    except BadSpecification as error:
        return PID(rst, None, str(error), exact, note)


def _place_all(A: Array, B: Array, P_d: Array, P_a: Array, h: float) -> tuple[Array, Array]:
    """R and S of a PID for a plant of order 2 or less: every pole as asked."""
    most = A.size - 1  # then S keeps its degree 2
    if P_a.size - 1 > most:
        raise BadSpecification(
            f"{P_a.size - 1} auxiliary poles asked, a PID on this plant places {most} besides the "
            "dominant ones; give fewer, or design an RST"
        )
    return solve_diophantine(A, B, np.convolve(P_d, P_a), H_S=INTEGRATOR, h=h)


def _gain(name: str, value: float) -> float:
    if not (math.isfinite(value) and value != 0):
        raise BadSpecification(f"{name} = {value:g}, must be finite and not 0")
    return value


def _integral(T_i: float, h: float, method: Sampling) -> tuple[Array, Array]:
    """Numerator and denominator of 1/(T_i s) sampled at h."""
    h = check_period(h)
    if not (math.isfinite(T_i) and T_i > 0):
        raise BadSpecification(f"T_i = {T_i:g} s, must be finite and > 0; without it, use a PD")
    if method not in get_args(Sampling):
        raise BadSpecification(f"method {method!r} unknown; choose one of {get_args(Sampling)}")
    rise = np.array([0.0, 1.0]) if method == "zoh" else np.array([0.5, 0.5])
    return rise * (h / T_i), INTEGRATOR


def _derivative(T_d: float, eps: float, h: float, method: Sampling) -> tuple[Array, Array]:
    """Numerator and denominator of T_d s/(eps s + 1) sampled at h."""
    h = check_period(h)
    if not (math.isfinite(T_d) and T_d >= 0 and math.isfinite(eps) and eps > 0):
        raise BadSpecification(f"T_d = {T_d:g} s, eps = {eps:g} s: need T_d >= 0 and eps > 0")
    if method not in get_args(Sampling):
        raise BadSpecification(f"method {method!r} unknown; choose one of {get_args(Sampling)}")
    if method == "zoh":
        return INTEGRATOR * (T_d / eps), np.array([1.0, -math.exp(-h / eps)])
    gain = 2 * T_d / (2 * eps + h)
    return INTEGRATOR * gain, np.array([1.0, (h - 2 * eps) / (2 * eps + h)])
