"""How a run's time is best shared among segments, whose information adds up: two convex programs.

Continuous D- and T-optimal designs (Fedorov, Theory of Optimal Experiments, 1972; Atkinson,
Fedorov, Biometrika 62 (1975) 57), solved by CasADi with IPOPT. What they reach bounds what any
whole number of these segments does.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from identification.arrays import Array, IntArray

MOST_REPEATS = 6.0  # of one segment
INFORMATION_RIDGE = (
    1e-9  # of the mean information, added to every parameter: what a run says nothing of
)
IPOPT_OPTIONS = {
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


class PairLike(Protocol):
    """Places of an effect in the information, and of all that its rival can change instead."""

    @property
    def one(self) -> int: ...

    @property
    def others(self) -> tuple[int, ...]: ...


def d_optimal(
    matrices: Sequence[Array], asked: IntArray, seconds: Array, total: float
) -> Allocation:
    """The times that make the mean log-determinant of the asked parameters' information largest.

    matrices: of each plant in question, information (k, d, d) of k segments; asked: places of the
    parameters in question, all others being unknown too; seconds (k,), total: of time [s].
    """
    import casadi as ca

    w = ca.SX.sym("w", len(seconds))
    value: Any = 0.0
    for M in matrices:
        value += _log_det(ca, w, M, asked) / len(matrices)
    return _solved(ca, w, value, seconds, total)


def t_optimal(
    matrices: Array, pairs: Sequence[PairLike], seconds: Array, total: float
) -> Allocation:
    """The times that make the mean log of what discriminates the pairs largest.

    matrices (k, d, d): information of k segments, of parameters and effects; seconds (k,), total:
    of time [s]. What discriminates a pair is the square of what one effect changes, in units of the
    noise, and the other places do not make up for.
    """
    import casadi as ca

    w = ca.SX.sym("w", len(seconds))
    k, d, _ = matrices.shape
    size = np.sqrt(np.maximum(np.mean(np.einsum("kii->ki", matrices), axis=0), 1e-300))
    scaled = matrices / np.outer(size, size)
    M = ca.reshape(ca.mtimes(ca.DM(scaled.reshape(k, d * d).T), w), d, d)
    value: Any = 0.0
    for pair in pairs:
        at = list(pair.others)
        R = ca.chol(M[at, at] + INFORMATION_RIDGE * ca.SX.eye(len(at)))
        half = ca.solve(R.T, M[at, pair.one])
        left = ca.fmax(M[pair.one, pair.one] - ca.dot(half, half), 0.0)
        value += ca.log(left * float(size[pair.one]) ** 2 + 1.0) / len(pairs)
    return _solved(ca, w, value, seconds, total)


def _log_det(ca: Any, w: Any, M: Array, asked: IntArray) -> Any:
    """Log-determinant of the asked parameters' information, the others being unknown too."""
    k, d, _ = M.shape
    size = np.sqrt(np.maximum(np.mean(np.einsum("kii->ki", M), axis=0), 1e-300))
    scaled = M / np.outer(size, size)
    every = np.concatenate([asked, np.setdiff1d(np.arange(d), asked)])
    # The others first: the determinant of the whole is that of their block times the wanted one.
    order = every[::-1]
    mixed = ca.mtimes(ca.DM(scaled[:, order][:, :, order].reshape(k, d * d).T), w)
    R = ca.chol(ca.reshape(mixed, d, d) + INFORMATION_RIDGE * ca.SX.eye(d))
    return 2.0 * ca.sum1(ca.log(ca.diag(R)[d - len(asked) :]))


def _solved(ca: Any, w: Any, value: Any, seconds: Array, total: float) -> Allocation:
    """The times with the largest value within the total time."""
    k = len(seconds)
    begin = np.minimum(np.full(k, total / float(np.sum(seconds))), MOST_REPEATS)
    program = {"x": w, "f": -value, "g": ca.dot(ca.DM(seconds), w)}
    solver = ca.nlpsol("allocation", "ipopt", program, IPOPT_OPTIONS)
    found = solver(x0=begin, lbx=0.0, ubx=MOST_REPEATS, lbg=0.0, ubg=total)
    times = np.clip(np.array(found["x"]).ravel(), 0.0, MOST_REPEATS)
    return Allocation(times, -float(found["f"]))
