"""Lagged products of an input and an output: all that ARX estimation needs of a log.

With `y(t-i)` and `u(t-j)` as regressors nearly all entries of their Gram matrix are one lagged
product seen from another lag, so one pass over `na + nb + ...` products replaces the matrix.
"""

from typing import Any

import numpy as np
from numba import types
from numba.extending import intrinsic

from identification.arrays import Array, IntArray
from identification.compiled import compiled, compiled_fast, compiled_inline

BLOCK = 8192
LANES = 512


@intrinsic  # type: ignore[untyped-decorator]
def fused(_context: Any, a: Any, b: Any, c: Any) -> Any:
    """a b + c with one rounding, whatever the optimiser thinks of it."""
    double = types.float64

    def generate(_target: Any, builder: Any, _signature: Any, values: Any) -> Any:
        return builder.fma(*values)

    return double(double, double, double), generate


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
    z: tuple[Array, Array, Array, Array, Array, Array, Array, Array],
) -> tuple[float, float, float, float, float, float, float, float]:
    """Eight sums of x z at the price of three: x is read once and the sums overlap."""
    z0, z1, z2, z3, z4, z5, z6, z7 = z
    a = b = c = d = e = f = g = h = 0.0
    for i in range(x.shape[0]):
        v = x[i]
        a += v * z0[i]
        b += v * z1[i]
        c += v * z2[i]
        d += v * z3[i]
        e += v * z4[i]
        f += v * z5[i]
        g += v * z6[i]
        h += v * z7[i]
    return a, b, c, d, e, f, g, h


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
def _lagged(y: Array, u: Array, s: int, e: int, lags: IntArray, row: int, target: int) -> Array:
    """The `target`-th factor of y (row 0) or u (row 1): lags of the same signal, then the other."""
    own = lags[row, 1]
    k = lags[row, 0] + target if target < own else lags[row + 2, 0] + target - own
    if (row == 0) == (target < own):
        return y[s - k : e - k]
    return u[s - k : e - k]


@compiled
def _add_plain(
    y: Array, u: Array, s: int, e: int, lags: IntArray, row: int, high: Array, low: Array
) -> None:
    x = y[s:e] if row == 0 else u[s:e]
    count = lags[row, 1] + lags[row + 2, 1]
    i = 0
    while i < count:
        if count - i < 4:
            add_to_pair(high, low, i, plain_dot(x, _lagged(y, u, s, e, lags, row, i)), 0.0)
            i += 1
            continue
        last = count - 1
        eight = (
            _lagged(y, u, s, e, lags, row, i),
            _lagged(y, u, s, e, lags, row, i + 1),
            _lagged(y, u, s, e, lags, row, i + 2),
            _lagged(y, u, s, e, lags, row, i + 3),
            _lagged(y, u, s, e, lags, row, min(i + 4, last)),
            _lagged(y, u, s, e, lags, row, min(i + 5, last)),
            _lagged(y, u, s, e, lags, row, min(i + 6, last)),
            _lagged(y, u, s, e, lags, row, min(i + 7, last)),
        )
        sums = plain_dots(x, eight)
        for j in range(min(8, count - i)):
            add_to_pair(high, low, i + j, sums[j], 0.0)
        i += 8
    add_to_pair(high, low, count, plain_sum(x), 0.0)


@compiled
def add_lagged_products(
    y: Array, u: Array, first: int, lags: IntArray, exact: bool, high: Array, low: Array
) -> None:
    """Add sum_s a(s) b(s-k), s from `first` to the end, to the pairs `high + low`.

    y, u: shape (n,). lags: shape (4, 2), the first lag and the number of lags of y y, u u, y u and
    u y in turn; no lag above `first`. high, low: shape (sum of the numbers + 2,): y y, y u, the
    sum of y, then u u, u y, the sum of u. exact: products by `exact_dot`, else by `plain_dot`;
    the sum over blocks is compensated in both.
    """
    ones = np.ones(BLOCK)
    work_high = np.zeros(LANES)
    work_low = np.zeros(LANES)
    norms = np.ones(2)
    n = y.shape[0]
    for s in range(first, n, BLOCK):
        e = min(s + BLOCK, n)
        if exact:
            norms[0] = np.sqrt(plain_dot(y[s - first : e], y[s - first : e]))
            norms[1] = np.sqrt(plain_dot(u[s - first : e], u[s - first : e]))
        at = 0
        for row in range(2):
            x = y[s:e] if row == 0 else u[s:e]
            own = lags[row, 1]
            count = own + lags[row + 2, 1]
            if exact:
                for i in range(count):
                    z = _lagged(y, u, s, e, lags, row, i)
                    sigma = 2.0 * norms[row] * norms[row if i < own else 1 - row]
                    value, rest = exact_dot(x, z, sigma, work_high, work_low)
                    add_to_pair(high, low, at + i, value, rest)
                sigma = 2.0 * norms[row] * np.sqrt(float(e - s))
                value, rest = exact_dot(x, ones[: e - s], sigma, work_high, work_low)
                add_to_pair(high, low, at + count, value, rest)
            else:
                _add_plain(y, u, s, e, lags, row, high[at:], low[at:])
            at += count + 1
