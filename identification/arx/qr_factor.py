"""The triangular factor of an ARX regression, from a stream of samples in constant memory.

The factor R is that of QR of `[1, y(t-1).., u(t-nk).., y(t)]`, made from the Gram matrix:

- exact: lagged products as pairs of doubles (relative rounding about 2^-90), edges and Cholesky in
  40 digits. The rounding of R is then 2^-90 cond^2, below that of Householder QR, 2^-53 cond, for
  any cond under 2^37; beyond 1e13 a column counts as a combination of the ones before it.
- plain: products in double, three times as fast; harmless where `Factor.trusted` says so, that is
  where its rounding (1e-14 of the columns' lengths) times cond^2 stays under 1e-8, and is small
  against the part of y that is left over.
"""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from decimal import Decimal, localcontext

import numpy as np

from identification.arrays import Array, IntArray
from identification.arx.lagged_products import INPUT, ONES, OUTPUT, add_lagged_products, add_to_pair
from identification.errors import BadLog, BadModel

EXACT_DIGITS = 40
PIECE_OF_RUN = 1 << 18
CONVERTED = 1 << 19
WORKERS = 4
# Sine of the angle to the columns before it under which a column says nothing of its own.
SMALLEST_ANGLE = 1e-13
# Rounding of a plain sum of products; what it may do to an estimate and to its noise variance.
PLAIN_ROUNDING = 1e-14
PLAIN_ERROR = 1e-8
PLAIN_VARIANCE = 1e-4


@dataclass(frozen=True)
class Order:
    """Degrees and delay of `A(z^-1) y = B(z^-1) u`: na, nb coefficients, nk samples of delay."""

    na: int
    nb: int
    nk: int

    def __post_init__(self) -> None:
        if min(self.na, self.nb, self.nk) < 0 or self.na + self.nb == 0:
            raise BadModel(
                f"ARX orders na={self.na}, nb={self.nb}, nk={self.nk}; none may be negative, "
                "and na + nb must be at least 1"
            )

    @property
    def lag(self) -> int:
        """The oldest sample that a prediction looks at."""
        return max(self.na, self.nk + self.nb - 1 if self.nb else 0)

    @property
    def size(self) -> int:
        """Coefficients na + nb."""
        return self.na + self.nb


@dataclass(frozen=True)
class Factor:
    """R of the columns `1, y(t-1)..y(t-na), u(t-nk)..u(t-nk-nb+1), y(t)` over `rows` samples.

    rounding: of R' R relative to the columns' lengths, where it was not exact; else 0.
    """

    order: Order
    R: Array
    rows: int
    rounding: float

    def trusted(self, condition: float, residual_rms: float) -> bool:
        """Whether rounding does not matter to an estimate of this condition and residual."""
        target = float(np.sum(self.R[:, -1] ** 2))
        estimate = self.rounding * condition**2 <= PLAIN_ERROR
        return estimate and self.rounding * target <= PLAIN_VARIANCE * residual_rms**2 * self.rows

    def columns(self, order: Order, offset: bool) -> IntArray:
        """Places of the columns of a smaller model, the target last."""
        own = self.order
        inside = order.na <= own.na and (
            order.nb == 0 or own.nk <= order.nk <= own.nk + own.nb - order.nb
        )
        if not inside:
            raise BadModel(f"{order} is not a part of {own}; make the factor of a larger model")
        first_u = 1 + own.na + order.nk - own.nk
        places = [0] if offset else []
        places += range(1, 1 + order.na)
        places += range(first_u, first_u + order.nb)
        return np.array([*places, self.R.shape[1] - 1], dtype=np.int64)


class _Run:
    """Lagged products and both ends of one continuous run."""

    def __init__(self, order: Order, exact: bool, number: int) -> None:
        na, nb, nk = order.na, order.nb, order.nk
        self.lag, self.exact, self.number = order.lag, exact, number
        apart = range(max(nk - na, 0), nk + nb) if nb else range(0)
        lags_u = sorted({*range(1, nb), *apart} - {0})
        factors = [(OUTPUT, 0), (INPUT, 0), (ONES, 0), *((OUTPUT, k) for k in range(1, na + 1))]
        factors += [(INPUT, k) for k in lags_u]
        self.factors = np.array(factors, dtype=np.int64)
        back = range(1, na - nk + 1) if nb else range(0)
        own = {ONES: range(1), INPUT: range(nb), OUTPUT: back}
        wanted = [[b != INPUT or k in apart for b, k in factors], [k in own[b] for b, k in factors]]
        self.wanted = np.array(wanted, dtype=np.int64)
        self.high = np.zeros(self.wanted.shape)
        self.low = np.zeros_like(self.high)
        self.head = np.zeros((2, 0))
        self.tail = np.zeros((2, 0))
        self.samples = 0

    def add(self, y: Array, u: Array) -> None:
        """Take the next samples; all or none of them, should one be no number."""
        high, low = self.high.copy(), self.low.copy()
        joint = np.concatenate([self.tail, [y[: self.lag], u[: self.lag]]], axis=1)
        self._add_products(joint[0], joint[1], high, low)
        self._add_products(y, u, high, low)
        ends = np.concatenate([joint, [y[-1:], u[-1:]]], axis=1)
        if not (np.isfinite(high).all() and np.isfinite(low).all() and np.isfinite(ends).all()):
            raise BadLog(f"run {self.number}: {_first_bad(y, u, self.samples)}")
        self.high, self.low = high, low
        if self.head.shape[1] < self.lag:
            self.head = np.concatenate([self.head, joint[:, self.tail.shape[1] :]], axis=1)
            self.head = self.head[:, : self.lag]
        last = np.array([y[max(len(y) - self.lag, 0) :], u[max(len(u) - self.lag, 0) :]])
        self.tail = np.concatenate([self.tail, last], axis=1)
        self.tail = self.tail[:, max(self.tail.shape[1] - self.lag, 0) :]
        self.samples += len(y)

    def _add_products(self, y: Array, u: Array, high: Array, low: Array) -> None:
        """Add to `high + low` what the samples after the first `lag` give, in threads."""

        def part(start: int) -> tuple[Array, Array]:
            own = slice(start - self.lag, start + PIECE_OF_RUN)
            sums = np.zeros_like(high), np.zeros_like(low)
            views = _read_only(y[own]), _read_only(u[own])
            add_lagged_products(*views, self.lag, self.factors, self.wanted, self.exact, *sums)
            return sums

        starts = range(self.lag, len(y), PIECE_OF_RUN)
        with ThreadPoolExecutor(max(min(len(starts), WORKERS), 1)) as pool:
            for more in (pool.map if len(starts) > 1 else map)(part, starts):
                for row, k in np.ndindex(high.shape):
                    value, rest = float(more[0][row, k]), float(more[1][row, k])
                    add_to_pair(high[row], low[row], k, value, rest)

    def _product(self, a: int, b: int, k: int) -> Decimal:
        """sum a(s) b(s-k), s from `lag` on; 0 for one that is not wanted."""
        at = np.flatnonzero((self.factors == (b, k)).all(axis=1) & (self.wanted[a] != 0))
        return sum((Decimal(self.high[a, i]) + Decimal(self.low[a, i]) for i in at), Decimal(0))

    def energy(self) -> Array:
        """Sums of y^2 and u^2 that no column of this run exceeds, shape (2,)."""
        squares = np.array(
            [self._product(OUTPUT, OUTPUT, 0), self._product(INPUT, INPUT, 0)], dtype=np.float64
        )
        return np.asarray(squares + np.sum(self.head**2, axis=1), dtype=np.float64)

    def gram(self, order: Order) -> list[list[Decimal]]:
        """Gram matrix of the columns of Factor, in the current decimal context."""
        ends = [
            ([*map(Decimal, self.head[a])], [*map(Decimal, self.tail[a])]) for a in (OUTPUT, INPUT)
        ]
        table: dict[tuple[int, int, int, int], Decimal] = {}
        sums: dict[tuple[int, int], Decimal] = {}
        for a, at in zip(*np.nonzero(self.wanted), strict=True):
            b, k = self.factors[at].tolist()
            total = self._product(int(a), b, k)
            (head, tail), other = ends[a], ends[b] if b != ONES else None
            for i in range(self.lag - k + 1):
                if other is None:
                    sums[int(a), i] = total
                else:
                    table[int(a), i, b, i + k] = table[b, i + k, int(a), i] = total
                if i + k < self.lag:
                    total += head[-1 - i] * (other[0][-1 - i - k] if other else 1)
                    total -= tail[-1 - i] * (other[1][-1 - i - k] if other else 1)
        own = [(OUTPUT, i) for i in range(1, order.na + 1)]
        own += [(INPUT, order.nk + j) for j in range(order.nb)] + [(OUTPUT, 0)]
        one = [Decimal(self.samples - self.lag), *(sums[c] for c in own)]
        return [one, *([sums[c], *(table[c + d] for d in own)] for c in own)]


def _read_only(values: Array) -> Array:
    view = values.view()
    view.flags.writeable = False
    return view


def _first_bad(y: Array, u: Array, before: int) -> str:
    for name, values in (("y", y), ("u", u)):
        bad = np.flatnonzero(~np.isfinite(values))
        if len(bad):
            return (
                f"{name} is {values[bad[0]]} at sample {before + int(bad[0])} ({len(bad)} such "
                "from there); ARX needs finite samples: close the gap or split the run there"
            )
    largest = max(float(np.abs(y).max()), float(np.abs(u).max()))
    return f"values up to {largest:.3g} overflow when squared; use other units"


class ArxAccumulator:
    """Takes runs in chunks of any size and gives the factor of their ARX regression.

    Chunks of one run join as if they had come whole; `new_run` begins another one, whose first
    samples are not explained by the last of the run before. Memory does not grow with the log.
    exact: see the module; a stream that cannot be read twice should keep it.
    """

    def __init__(self, na: int, nb: int, nk: int, *, exact: bool = True) -> None:
        self.order = Order(na, nb, nk)
        self.exact = exact
        size = na + nb + 2
        self._sum = [[Decimal(0)] * size for _ in range(size)]
        self._rows = 0
        self._energy = np.zeros(2)
        self._run = _Run(self.order, exact, 1)

    def update(self, u: Array, y: Array) -> None:
        """Take the next samples of the present run: input `u` and output `y`, shape (n,).

        Raises BadLog where the lengths differ or a sample is no number.
        """
        u, y = np.asarray(u), np.asarray(y)
        if u.ndim != 1 or u.shape != y.shape:
            found = f"run {self._run.number}: u of shape {u.shape} and y of shape {y.shape}"
            raise BadLog(f"{found}; both must be (n,) with the same n")
        if u.dtype.kind not in "fiu" or y.dtype.kind not in "fiu":
            found = f"run {self._run.number}: u of type {u.dtype} and y of type {y.dtype}"
            raise BadLog(f"{found}; both must be real numbers")
        ready = all(x.dtype == np.float64 and x.flags.c_contiguous for x in (u, y))
        step = max(len(y), 1) if ready else CONVERTED
        for start in range(0, len(y), step):
            piece = slice(start, start + step)
            self._run.add(
                np.ascontiguousarray(y[piece], dtype=np.float64),
                np.ascontiguousarray(u[piece], dtype=np.float64),
            )

    def new_run(self) -> None:
        """End the present run; the next samples belong to another one."""
        with localcontext(prec=EXACT_DIGITS):
            self._sum, self._rows, self._energy = self._total()
        self._run = _Run(self.order, self.exact, self._run.number + 1)

    def _total(self) -> tuple[list[list[Decimal]], int, Array]:
        run = self._run
        if run.samples <= run.lag:
            return self._sum, self._rows, self._energy
        pairs = zip(self._sum, run.gram(self.order), strict=True)
        total = [[a + b for a, b in zip(old, new, strict=True)] for old, new in pairs]
        return total, self._rows + run.samples - run.lag, self._energy + run.energy()

    def factor(self) -> Factor:
        """The factor of all samples so far; more may follow."""
        with localcontext(prec=EXACT_DIGITS):
            gram, rows, energy = self._total()
            R = _cholesky(gram)
            squares = np.array([float(gram[i][i]) for i in range(1, len(gram))])
        if self.exact:
            return Factor(self.order, R, rows, 0.0)
        # A column much shorter than the signal it is cut from is a small difference of products.
        signal = energy[[0] * self.order.na + [1] * self.order.nb + [0]]
        cut = np.divide(signal, squares, out=np.ones_like(signal), where=squares > 0.0)
        return Factor(self.order, R, rows, PLAIN_ROUNDING * max(float(cut.max()), 1.0))


def _cholesky(gram: Sequence[Sequence[Decimal]]) -> Array:
    """Upper R with R' R = gram, shape (d, d); a dependent column gets a zero pivot."""
    size = len(gram)
    R = [[Decimal(0)] * size for _ in range(size)]
    smallest = Decimal(SMALLEST_ANGLE) ** 2
    for j in range(size):
        pivot = gram[j][j] - sum((R[i][j] ** 2 for i in range(j)), Decimal(0))
        if pivot <= smallest * gram[j][j]:
            continue
        R[j][j] = pivot.sqrt()
        for k in range(j + 1, size):
            inner = sum((R[i][j] * R[i][k] for i in range(j)), Decimal(0))
            R[j][k] = (gram[j][k] - inner) / R[j][j]
    return np.array([[float(value) for value in row] for row in R])
