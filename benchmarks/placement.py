"""Pole placement: our Diophantine solver against state-space placers, in one run.

    python benchmarks/placement.py

Each solver places the same 2n - 1 (ours) or n (theirs: state feedback only, no observer) poles
for the same random plants; times are medians, the error is that of the closed-loop polynomial.
"""

import timeit
import warnings
from collections.abc import Callable

import control
import numpy as np
from scipy.signal import place_poles

from design.place import solve_diophantine
from design.polynomial import add, from_roots
from identification.arrays import Array

REPEATS = 9


def random_poles(n: int, rng: np.random.Generator) -> Array:
    """n distinct stable poles, conjugate pairs and at most one real one."""
    pairs = n // 2
    z = rng.uniform(0.4, 0.95, pairs) * np.exp(1j * np.linspace(0.2, 2.9, pairs))
    return np.concatenate([z, z.conj(), [0.5] * (n % 2)])


def median_us(call: Callable[[], object]) -> float:
    """Median time of one call [us]."""
    timer = timeit.Timer(call)
    number = max(1, round(0.01 / max(timer.timeit(1), 1e-7)))
    return 1e6 * float(np.median(timer.repeat(REPEATS, number))) / number


def numpy_sylvester(A: Array, B: Array, P: Array) -> Array:
    """The bare equation by numpy: no fixed parts, no checks, no refinement."""
    n = A.size - 1
    matrix = np.zeros((2 * n, 2 * n))
    for j in range(n):
        matrix[j : j + n + 1, j] = A
        matrix[j : j + n + 1, n + j] = B
    return np.linalg.solve(matrix, P).astype(np.float64)


def error_of(found: Array, wanted: Array) -> float:
    """Largest coefficient error relative to the largest coefficient."""
    return float(np.abs(add(found, -wanted)).max() / np.abs(wanted).max())


def row(n: int, rng: np.random.Generator) -> str:
    """One line of the table: times [us], ratios to ours, errors."""
    A = from_roots(random_poles(n, rng))
    B = np.concatenate([[0.0], 1e-3 * rng.standard_normal(n)])
    P, P_n = from_roots(random_poles(2 * n - 1, rng)), random_poles(n, rng)
    R, S = solve_diophantine(A, B, P)
    x = numpy_sylvester(A, B, P)
    # Controllable form: the state feedback K places the roots of A + K.
    F, G = np.diag(np.ones(n - 1), -1), np.zeros((n, 1))
    F[0], G[0, 0] = -A[1:], 1.0
    acker: Array = np.ravel(control.acker(F, G, P_n))
    scipy_: Array = np.ravel(place_poles(F, G, P_n).gain_matrix)
    times = [
        median_us(lambda: solve_diophantine(A, B, P)),
        median_us(lambda: numpy_sylvester(A, B, P)),
        median_us(lambda: control.acker(F, G, P_n)),
        median_us(lambda: place_poles(F, G, P_n)),
    ]
    wanted = from_roots(P_n)
    errors = [
        error_of(add(np.convolve(A, S), np.convolve(B, R)), P),
        error_of(add(np.convolve(A, x[:n]), np.convolve(B, x[n:])), P),
        *(error_of(A + np.concatenate([[0.0], K]), wanted) for K in (acker, scipy_)),
    ]
    cells = [f"{t:8.0f} ({t / times[0]:5.1f}) {e:8.1e}" for t, e in zip(times, errors, strict=True)]
    return f"{n:5d}  " + "  ".join(cells)


def main() -> None:
    """Prints the table."""
    names = ("ours", "numpy, bare", "control.acker", "scipy place_poles")
    print("order  " + "  ".join(f"{name:>24}" for name in names))
    print("       " + "  ".join([f"{'us (x ours)   error':>24}"] * 4))
    rng = np.random.default_rng(1)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the placers warn where they lose the poles
        for n in (3, 10, 20, 40):
            print(row(n, rng))


if __name__ == "__main__":
    main()
