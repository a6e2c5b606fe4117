"""The plant that a position controller sees, sampled: sliding mass, actuator, force loop inside."""

import numpy as np
from scipy.linalg import expm

from design.force_pi import ForcePI
from design.polynomial import check_period, trim
from identification.arrays import Array
from identification.errors import BadSpecification
from identification.model.plant import Actuator

FORCE_LOOP = 0.3  # part of the force error that one sample of the force loop removes
FORCE_RESET = 10.0  # integral time of the force loop, in its own time constants


def force_gains(actuator: Actuator, h: float) -> ForcePI:
    """A PI force loop for dF/dt = k1 u, sampled at h [s]: time constant h/0.3, ten of them T_i.

    Ours: the paper prints k_i = 0.02 V/N, T_i = 0.05 s for k1 = 19530 N/(V s), h = 1 ms, which is
    0.39 of the error a sample.
    """
    h = check_period(h)
    return ForcePI(FORCE_LOOP / (actuator.k1 * h), FORCE_RESET * h / FORCE_LOOP)


def linear_plant(
    m: float,
    f: float,
    h: float,
    actuator: Actuator | None = None,
    force: ForcePI | None = None,
    ratio: int = 1,
) -> tuple[Array, Array]:
    """(A, B) in z^-1 from the force reference [N] to the position [m] of a sliding body, zero-order
    hold.

    m [kg], f [N s/m], h [s]. With an actuator dF/dt = k1 u - k2 v the force loop `force` is part
    of it, run `ratio` times in every h; without, the force is the reference. Coulomb friction is
    left out: it is a bounded disturbance. Raises BadSpecification where m or h is not positive,
    f is negative, or the force loop is unstable.
    """
    h = check_period(h)
    if not (m > 0 and f >= 0):
        raise BadSpecification(f"m = {m:g} kg, f = {f:g} N s/m: need m > 0 and f >= 0")
    if actuator is None or force is None:
        body = np.array([[0.0, 1.0], [0.0, -f / m]])
        step, entry = zoh_step(body, np.array([0.0, 1.0 / m]), h)
        return transfer(step, entry)
    fast = h / ratio
    step, entry = zoh_step(_driven_body(m, f, actuator), np.array([0.0, 0.0, actuator.k1]), fast)
    return transfer(*force_loop(step, entry, fast, force, ratio))


def commanded_plant(m: float, f: float, h: float, actuator: Actuator) -> tuple[Array, Array]:
    """(A, B) in z^-1 from the zero-order-hold command to the position, without a force loop; see
    above.

    Raises BadSpecification where m or h is not positive, or f is negative.
    """
    h = check_period(h)
    if not (m > 0 and f >= 0):
        raise BadSpecification(f"m = {m:g} kg, f = {f:g} N s/m: need m > 0 and f >= 0")
    entry = np.array([0.0, 0.0, actuator.k1])
    return transfer(*zoh_step(_driven_body(m, f, actuator), entry, h))


def _driven_body(m: float, f: float, actuator: Actuator) -> Array:
    """y, v, F of a sliding body and its actuator, in continuous time (3, 3)."""
    return np.array([[0.0, 1.0, 0.0], [0.0, -f / m, 1.0 / m], [0.0, -actuator.k2, 0.0]])


def force_loop(
    step: Array, entry: Array, h: float, force: ForcePI, ratio: int
) -> tuple[Array, Array]:
    """`ratio` samples of a machine (n, n) under its force loop, and what the reference enters by.

    step, entry: of h [s], under a zero-order-hold command; the force is the last state. The
    integral of the force error comes behind it. Raises BadSpecification where the loop is unstable.
    """
    n = len(entry)
    error = np.zeros(n + 1)
    error[n - 1] = -1.0
    command = force.k_i * (error + np.eye(n + 1)[n])
    one = np.zeros((n + 1, n + 1))
    one[:n, :n] = step
    one[:n] += np.outer(entry, command)
    one[n] = np.eye(n + 1)[n] + h / force.T_i * error
    enters = np.append(entry * force.k_i, h / force.T_i)
    loop, drive = np.eye(n + 1), np.zeros(n + 1)
    for _ in range(ratio):
        loop, drive = one @ loop, one @ drive + enters
    worst = float(np.sort(np.abs(np.linalg.eigvals(loop)))[-2])
    if worst >= 1:
        raise BadSpecification(
            f"the force loop k_i = {force.k_i:.3g} V/N, T_i = {force.T_i:.3g} s is unstable at"
            f" {h:.3g} s (|z| = {worst:.3g}); lower k_i or sample faster"
        )
    return loop, drive


def zoh_step(a: Array, b: Array, h: float) -> tuple[Array, Array]:
    """Step of x' = a x + b u over h with u constant."""
    n = len(b)
    block = np.zeros((n + 1, n + 1))
    block[:n, :n], block[:n, n] = a, b
    exact = np.asarray(expm(block * h), dtype=np.float64)
    return exact[:n, :n], exact[:n, n]


def transfer(step: Array, entry: Array, out: Array | None = None) -> tuple[Array, Array]:
    """(A, B) of y = out x, by default the first state, in ascending powers of z^-1."""
    a = np.real(np.poly(step))
    seen = np.eye(1, len(entry)) if out is None else out[np.newaxis]
    b = np.real(np.poly(step - np.outer(entry, seen[0]))) - a
    b[0] = 0.0
    return a, trim(b, 1e-14)
