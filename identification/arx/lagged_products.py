"""Lagged products of an input and an output: all that ARX estimation needs of a log.

With `y(t-i)` and `u(t-j)` as regressors nearly all entries of their Gram matrix are one lagged
product seen from another lag, so one pass over `na + nb + ...` products replaces the matrix.
"""

from collections.abc import Callable
from typing import Any, cast

import numpy as np
from numba import types
from numba.extending import intrinsic

from identification.arrays import Array, IntArray
from identification.compiled import compiled, compiled_fast, compiled_inline

BLOCK = 8192
LANES = 512
OUTPUT, INPUT, ONES = 0, 1, 2


def _fused(_context: Any, a: Any, b: Any, c: Any) -> Any:
    double = types.float64

    def generate(_target: Any, builder: Any, _signature: Any, values: Any) -> Any:
        return builder.fma(*values)

    return double(double, double, double), generate


# a b + c with one rounding, whatever the optimiser thinks of it; within compiled functions only.
fused = cast(Callable[[float, float, float], float], intrinsic(_fused))


@compiled_fast
def plain_dot(x: Array, z: Array) -> float:
    """Sum of x z; its rounding is at most len(x) 2^-53 of |x| |z|."""
    total = 0.0
    for i in range(x.shape[0]):
        total += x[i] * z[i]
    return total


@compiled_fast
def plain_dots(
    x: Array,
    v: Array,
    z: tuple[Array, Array, Array, Array, Array, Array, Array, Array],
    out: Array,
) -> None:
    """Set `out`, shape (2, 11), to the sums of x b and v b, b = x, v, 1 and the eight of z.

    One loop over ten arrays: it is the loads that cost, nearly each across two cache lines, so
    no array is loaded twice.
    """
    z0, z1, z2, z3, z4, z5, z6, z7 = z
    xx = xv = vv = x1 = v1 = 0.0
    a0 = a1 = a2 = a3 = a4 = a5 = a6 = a7 = 0.0
    b0 = b1 = b2 = b3 = b4 = b5 = b6 = b7 = 0.0
    for i in range(x.shape[0]):
        p, q = x[i], v[i]
        xx += p * p
        xv += p * q
        vv += q * q
        x1 += p
        v1 += q
        a0 += p * z0[i]
        b0 += q * z0[i]
        a1 += p * z1[i]
        b1 += q * z1[i]
        a2 += p * z2[i]
        b2 += q * z2[i]
        a3 += p * z3[i]
        b3 += q * z3[i]
        a4 += p * z4[i]
        b4 += q * z4[i]
        a5 += p * z5[i]
        b5 += q * z5[i]
        a6 += p * z6[i]
        b6 += q * z6[i]
        a7 += p * z7[i]
        b7 += q * z7[i]
    out[0] = (xx, xv, x1, a0, a1, a2, a3, a4, a5, a6, a7)
    out[1] = (xv, vv, v1, b0, b1, b2, b3, b4, b5, b6, b7)


@compiled_fast
def plain_sum(x: Array) -> float:
    """Sum of x in any order."""
    total = 0.0
    for i in range(x.shape[0]):
        total += x[i]
    return total


@compiled_inline
def _split_sums(x: Array, z: Array, sigma: float, high: Array, low: Array) -> None:
    for w in range(high.shape[0]):
        t = fused(x[w], z[w], sigma) - sigma
        high[w] += t
        low[w] += fused(x[w], z[w], -t)


@compiled
def exact_dot(x: Array, z: Array, sigma: float, high: Array, low: Array) -> tuple[float, float]:
    """Sum of x z as a pair, rounding about 2^-90 of |x| |z|.

    sigma: at least |x| |z|. It rounds every product to one grid on which the block's sum is exact
    by Cauchy-Schwarz; what the grid cuts off is summed apart. high, low: LANES of work space.
    Source: error-free extraction, Rump, Ogita, Oishi, SIAM J. Sci. Comput. 31 (2008).
    """
    high[:] = 0.0
    low[:] = 0.0
    for q in range(0, x.shape[0], LANES):
        width = min(LANES, x.shape[0] - q)
        _split_sums(x[q : q + width], z[q : q + width], sigma, high[:width], low[:width])
    return plain_sum(high), plain_sum(low)


@compiled
def add_to_pair(high: Array, low: Array, k: int, value: float, rest: float) -> None:
    """Add the pair `value + rest` to the k-th of `high + low`, without loss."""
    total = high[k] + value
    part = total - high[k]
    low[k] += ((high[k] - (total - part)) + (value - part)) + rest
    high[k] = total


@compiled
def _factor(y: Array, u: Array, s: int, e: int, factors: IntArray, i: int) -> Array:
    """The i-th factor over the block; past the last one, the first."""
    i = i if i < factors.shape[0] else 0
    k = factors[i, 1]
    return y[s - k : e - k] if factors[i, 0] == OUTPUT else u[s - k : e - k]


@compiled
def _add_plain(
    y: Array, u: Array, s: int, e: int, factors: IntArray, high: Array, low: Array
) -> None:
    out = np.empty((2, 11))
    m = factors.shape[0]
    for i in range(3, max(m, 4), 8):
        eight = (
            _factor(y, u, s, e, factors, i),
            _factor(y, u, s, e, factors, i + 1),
            _factor(y, u, s, e, factors, i + 2),
            _factor(y, u, s, e, factors, i + 3),
            _factor(y, u, s, e, factors, i + 4),
            _factor(y, u, s, e, factors, i + 5),
            _factor(y, u, s, e, factors, i + 6),
            _factor(y, u, s, e, factors, i + 7),
        )
        plain_dots(y[s:e], u[s:e], eight, out)
        for row in range(2):
            for j in range(0 if i == 3 else 3, min(11, m - i + 3)):
                add_to_pair(high[row], low[row], i - 3 + j, out[row, j], 0.0)


@compiled
def add_lagged_products(
    y: Array,
    u: Array,
    first: int,
    factors: IntArray,
    wanted: IntArray,
    exact: bool,
    high: Array,
    low: Array,
) -> None:
    """Add sum_s a(s) b(s-k), s from `first` to the end, to the pairs `high + low`.

    y, u: shape (n,). a is y in the first row of `high` and `low`, u in the second; shape (2, m).
    factors: shape (m, 2), what b is and its lag k, at most `first`: (OUTPUT, 0), (INPUT, 0),
    (ONES, 0), then any of OUTPUT and INPUT. exact: products by `exact_dot`, and only those where
    `wanted`, shape (2, m), is not 0; else by `plain_dots`, all of them. The sum over blocks is
    compensated in both.
    """
    ones = np.ones(BLOCK)
    work_high = np.zeros(LANES)
    work_low = np.zeros(LANES)
    norms = np.ones(3)
    n = y.shape[0]
    for s in range(first, n, BLOCK):
        e = min(s + BLOCK, n)
        if not exact:
            _add_plain(y, u, s, e, factors, high, low)
            continue
        norms[OUTPUT] = np.sqrt(plain_dot(y[s - first : e], y[s - first : e]))
        norms[INPUT] = np.sqrt(plain_dot(u[s - first : e], u[s - first : e]))
        norms[ONES] = np.sqrt(float(e - s))
        for row in range(2):
            x = y[s:e] if row == OUTPUT else u[s:e]
            for i in range(factors.shape[0]):
                if wanted[row, i] != 0:
                    z = ones[: e - s] if i == 2 else _factor(y, u, s, e, factors, i)
                    sigma = 2.0 * norms[row] * norms[factors[i, 0]]
                    value, rest = exact_dot(x, z, sigma, work_high, work_low)
                    add_to_pair(high[row], low[row], i, value, rest)
