"""Kalman filter and smoother of a chain of up to three states, of which the first is measured.

x_(k+1) = A x_k + c_k + w_k with w_k ~ N(0, Q); z_k = x_k[0] + e_k with
e_k ~ N(0, R_k). In stretches marked `free` another pair A, Q holds. Sources: Kalman, J. Basic Eng.
82 (1960) 35; smoother without an inverse, Bierman, Automatica 9 (1973) 503 (modified Bryson and
Frazier).
"""

from dataclasses import dataclass

import numpy as np

from identification.arrays import Array, BoolArray
from identification.compiled import compiled

N = 3  # states


@dataclass(frozen=True, eq=False)
class Chain:
    """What is known of the states: A, Q (3, 3) of a step, and in free stretches; input c (n, 3);
    mean x0 and variance P0 at first, (3,) each."""

    A: Array
    Q: Array
    A_free: Array
    Q_free: Array
    c: Array
    x0: Array
    P0: Array


@compiled
def _sandwich(A: Array, P: Array, W: Array, half: Array) -> None:
    """P becomes A P A' + W; half (3, 3): room for A P."""
    for i in range(N):
        for j in range(N):
            half[i, j] = A[i, 0] * P[0, j] + A[i, 1] * P[1, j] + A[i, 2] * P[2, j]
    for i in range(N):
        for j in range(i, N):
            P[i, j] = W[i, j] + half[i, 0] * A[j, 0] + half[i, 1] * A[j, 1] + half[i, 2] * A[j, 2]
            P[j, i] = P[i, j]


@compiled
def _times(A: Array, x: Array, c: Array, room: Array) -> None:
    """x becomes A x + c; room: (3,)."""
    for i in range(N):
        room[i] = c[i] + A[i, 0] * x[0] + A[i, 1] * x[1] + A[i, 2] * x[2]
    for i in range(N):
        x[i] = room[i]


@compiled
def _less_measured(P: Array, gain: Array, R: float, S: float) -> None:
    """P after a measurement of the first state: (I - gain H) P."""
    for i in range(1, N):
        for j in range(i, N):
            P[i, j] -= gain[i] * P[0, j]
            P[j, i] = P[i, j]
    for i in range(N):  # the first row without the difference of two large numbers
        P[0, i] *= R / S
        P[i, 0] = P[0, i]


@compiled
def filter_kernel(
    z: Array, R: Array, seen: BoolArray, free: BoolArray, A: Array, Q: Array, A_free: Array,
    Q_free: Array, c: Array, x0: Array, P0: Array, x_out: Array, P_out: Array, e: Array, S: Array,
) -> None:  # fmt: skip
    """Predicted states (n, 3) and their covariances (n, 3, 3), where there is room for them, and
    innovations and their variances (n,), this 0 where nothing is measured."""
    keep = len(x_out) == len(z)
    x, P, gain = np.zeros(N), np.zeros((N, N)), np.zeros(N)
    half, room = np.zeros((N, N)), np.zeros(N)
    for i in range(N):
        x[i] = x0[i]
        P[i, i] = P0[i]
    for k in range(len(z)):
        for i in range(N if keep else 0):
            x_out[k, i] = x[i]
            for j in range(N):
                P_out[k, i, j] = P[i, j]
        e[k], S[k] = 0.0, 0.0
        if seen[k]:
            S[k] = P[0, 0] + R[k]
            e[k] = z[k] - x[0]
            for i in range(N):
                gain[i] = P[i, 0] / S[k]
                x[i] += gain[i] * e[k]
            _less_measured(P, gain, R[k], S[k])
        if free[k]:
            _times(A_free, x, c[k], room)
            _sandwich(A_free, P, Q_free, half)
        else:
            _times(A, x, c[k], room)
            _sandwich(A, P, Q, half)


@compiled
def smoother_kernel(
    R: Array, free: BoolArray, back: Array, back_free: Array, e: Array, S: Array, x: Array,
    P: Array, which: int, mean: Array, variance: Array,
) -> None:  # fmt: skip
    """Smoothed state `which` and its variance into (n,), of what the filter has left; back,
    back_free: A' and A_free'."""
    b, B, C = np.zeros(N), np.zeros((N, N)), np.zeros((N, N))
    half, room, none, nothing = np.zeros((N, N)), np.zeros(N), np.zeros(N), np.zeros((N, N))
    for i in range(N):
        C[i, i] = 1.0
    for k in range(len(e) - 1, -1, -1):
        if S[k] > 0.0:
            C[0, 0] = R[k] / S[k]  # C = (I - gain H)'
            for i in range(1, N):
                C[0, i] = -P[k, i, 0] / S[k]
            _times(C, b, none, room)
            _sandwich(C, B, nothing, half)
            b[0] -= e[k] / S[k]
            B[0, 0] += 1.0 / S[k]
        mean[k], variance[k] = x[k, which], P[k, which, which]
        for i in range(N):
            mean[k] -= P[k, which, i] * b[i]
            for j in range(N):
                variance[k] -= P[k, which, i] * B[i, j] * P[k, j, which]
        variance[k] = max(variance[k], 0.0)
        if k > 0:  # through the step that led here
            step = back_free if free[k - 1] else back
            _times(step, b, none, room)
            _sandwich(step, B, nothing, half)


def innovations(
    z: Array, R: Array, seen: BoolArray, free: BoolArray, of: Chain
) -> tuple[Array, Array]:
    """Each measured z less its mean given those before it, and the variance of that, (n,) each; 0
    and 1 where none is seen.

    R: variance of each; seen, free: (n,). Source: Kalman (1960).
    """
    e, S = np.zeros(len(z)), np.zeros(len(z))
    none, nothing = np.zeros((0, N)), np.zeros((0, N, N))
    filter_kernel(z, R, seen, free, of.A, of.Q, of.A_free, of.Q_free, of.c, of.x0, of.P0,
                  none, nothing, e, S)  # fmt: skip
    return e, np.where(seen, np.maximum(S, R), 1.0)  # which rounding may take below the noise


def log_densities(z: Array, R: Array, seen: BoolArray, free: BoolArray, of: Chain) -> Array:
    """Log density of each measured z (n,) given those before it, (n,); 0 where none is seen.

    R: variance of each; seen, free: (n,). Source: prediction-error decomposition, Schweppe, IEEE
    Trans. Inf. Theory 11 (1965) 61.
    """
    e, S = innovations(z, R, seen, free, of)
    return np.where(seen, -0.5 * (np.log(2.0 * np.pi * S) + e**2 / S), 0.0)


def smoothed(
    z: Array, R: Array, seen: BoolArray, free: BoolArray, of: Chain, which: int
) -> tuple[Array, Array]:
    """State `which` given the whole of z, and its standard deviation, both (n,).

    Source: Bierman (1973).
    """
    n = len(z)
    e, S, x, P = np.zeros(n), np.zeros(n), np.zeros((n, N)), np.zeros((n, N, N))
    filter_kernel(
        z, R, seen, free, of.A, of.Q, of.A_free, of.Q_free, of.c, of.x0, of.P0, x, P, e, S
    )
    mean, variance = np.zeros(n), np.zeros(n)
    back, back_free = np.ascontiguousarray(of.A.T), np.ascontiguousarray(of.A_free.T)
    smoother_kernel(R, free, back, back_free, e, S, x, P, which, mean, variance)
    return mean, np.sqrt(variance)
