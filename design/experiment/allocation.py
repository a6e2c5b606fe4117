"""How a run's time is best shared among segments, whose information adds up: two convex programs.

Continuous D- and T-optimal designs (Fedorov, Theory of Optimal Experiments, 1972; Atkinson,
Fedorov, Biometrika 62 (1975) 57), solved by CasADi with IPOPT. What they reach bounds what any whole
number of these segments does.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from identification.arrays import Array, IntArray

MOST_REPEATS = 6.0  # of one segment
RIDGE = 1e-9  # of the mean information, added to every parameter: what a run says nothing of
IPOPT = {
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "print_time": False,
    "ipopt.hessian_approximation": "limited-memory",
    "ipopt.max_iter": 200,
    "ipopt.tol": 1e-5,
}


@dataclass(frozen=True, eq=False)
class Allocation:
    """times (k,): how often each segment is repeated; value: of the criterion."""

    times: Array
    value: float


@dataclass(frozen=True, eq=False)
class Divergence:
    """What tells one plant from a rival, in units of the noise, segment by segment.

    square (k,): of the difference of their runs; b (k, d), M (k, d, d): its products with the
    rival's sensitivities, and theirs, which take away what other parameters of the rival mend.
    """

    square: Array
    b: Array
    M: Array

    def left(self, times: Array) -> float:
        """What no parameters of the rival mend, with each segment repeated so often."""
        M = np.tensordot(times, self.M, 1)
        b = times @ self.b
        size = np.sqrt(np.maximum(np.diag(M), 0.0))
        scale = np.where(size > 0.0, size, 1.0)
        solved = np.linalg.lstsq(
            M / np.outer(scale, scale) + RIDGE * np.eye(len(b)), b / scale, rcond=None
        )[0]
        return max(float(times @ self.square - (b / scale) @ solved), 0.0)


def d_optimal(
    matrices: Sequence[Array], asked: IntArray, seconds: Array, total: float
) -> Allocation:
    """The times that make the mean log-determinant of the asked parameters' information largest.

    matrices: of each plant in question, information (k, d, d) of k segments; asked: places of the
    parameters in question, all others being unknown too; seconds (k,), total: of time [s].
    """
    import casadi as ca

    w = ca.SX.sym("w", len(seconds))
    value = 0.0
    for M in matrices:
        value += _log_det(ca, w, M, asked) / len(matrices)
    return _solved(ca, w, value, None, seconds, total)


def t_optimal(pairs: Sequence[Divergence], seconds: Array, total: float) -> Allocation:
    """The times with which the pair of plants that is hardest to tell apart differs most."""
    import casadi as ca

    w, least = ca.SX.sym("w", len(seconds)), ca.SX.sym("least")
    bounds = []
    for pair in pairs:
        k, d = pair.b.shape
        size = np.sqrt(np.maximum(np.einsum("kii->i", pair.M), 0.0))
        scale = np.where(size > 0.0, size, 1.0)
        M = ca.reshape(
            ca.mtimes(ca.DM((pair.M / np.outer(scale, scale)).reshape(k, d * d).T), w), d, d
        )
        b = ca.mtimes(ca.DM((pair.b / scale).T), w)
        R = ca.chol(M + RIDGE * ca.SX.eye(d))
        half = ca.solve(R.T, b)
        left = ca.dot(ca.DM(pair.square), w) - ca.dot(half, half)
        bounds.append(ca.log(ca.fmax(left, 0.0) + 1.0) - least)
    return _solved(ca, w, least, bounds, seconds, total)


def _log_det(ca: Any, w: Any, M: Array, asked: IntArray) -> Any:
    """Log-determinant of the asked parameters' information, the others being unknown too."""
    k, d, _ = M.shape
    size = np.sqrt(np.maximum(np.mean(np.einsum("kii->ki", M), axis=0), 1e-300))
    scaled = M / np.outer(size, size)
    every = np.concatenate([asked, np.setdiff1d(np.arange(d), asked)])
    # The others first: the determinant of the whole is that of their block times the wanted one.
    order = every[::-1]
    mixed = ca.mtimes(ca.DM(scaled[:, order][:, :, order].reshape(k, d * d).T), w)
    R = ca.chol(ca.reshape(mixed, d, d) + RIDGE * ca.SX.eye(d))
    return 2.0 * ca.sum1(ca.log(ca.diag(R)[d - len(asked) :]))


def _solved(
    ca: Any, w: Any, value: Any, above: list[Any] | None, seconds: Array, total: float
) -> Allocation:
    """The largest value under the time; above: expressions that are not negative, and `value` is
    then an unknown of its own."""
    k = len(seconds)
    begin = np.full(k, total / float(np.sum(seconds)))
    begin = np.minimum(begin, MOST_REPEATS)
    used = ca.dot(ca.DM(seconds), w)
    x, x0, low, high = w, begin, np.zeros(k), np.full(k, MOST_REPEATS)
    g, g_low, g_high = used, [0.0], [total]
    if above is not None:
        x, g = ca.vertcat(w, value), ca.vertcat(used, *above)
        x0, low, high = np.append(begin, 0.0), np.append(low, -1.0), np.append(high, 1e3)
        g_low, g_high = [0.0] + [0.0] * len(above), [total] + [np.inf] * len(above)
    solver = ca.nlpsol("allocation", "ipopt", {"x": x, "f": -value, "g": g}, IPOPT)
    found = solver(x0=x0, lbx=low, ubx=high, lbg=g_low, ubg=g_high)
    times = np.clip(np.array(found["x"]).ravel()[:k], 0.0, MOST_REPEATS)
    return Allocation(times, -float(found["f"]))
