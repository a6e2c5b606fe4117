"""Frequency responses from averaged spectra, by least squares in a few neighbouring frequencies.

    out = sum_i H_i x_i + noise,    H_i(f + d) = H_i0 + H_i1 d + H_i2 d^2 for |d| up to a reach
    theta = (X'^H X)^-1 X'^H out,   X' = Z (Z^H Z)^-1 Z^H X,

The reach is the shortest of `REACHES` bins at which the 95 % band is narrow, else the longest.
x_i the inputs, X' what of them follows instruments Z, or X where there are none. With one input and
the reference r as its instrument H_0 is S_ry / S_ru, which no noise biases that goes round a loop;
one input alone gives S_uy / S_uu. All sums are of averaged cross spectra. The coherence of an input
is

    gamma^2 = |H|^2 S_x'x' / (|H|^2 S_x'x' + S_ee),

S_x'x' what of the input follows the instruments and no other input, e what the responses leave. Of
one input without instrument it is the usual one. Sources: Bendat, Piersol, Random Data, 4th ed.
(2010), chapters 6, 7 and 9; local polynomials, Pintelon, Schoukens, System Identification, 2nd ed.
(2012), chapter 7; instruments in closed loop, Soderstrom, Stoica, System Identification (1989),
chapter 8, and Wellstead, Automatica 17 (1981) 55.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from identification.arrays import Array, BoolArray
from identification.frequency.stretches import INDEPENDENT, REACHES, Band, ComplexArray
from identification.thresholds import CHANCE_LEVEL, COHERENCE_SURE, EVENTS_NEEDED, HALF, MATERIAL

DEGREE = 2  # of a response over its neighbours
RIDGE = 1e-12  # of the diagonal, that keeps what is all but singular from being so
BINS_OF_ONE = 1.5  # bins that Hann's window makes one of
NARROW_BAND = 0.06  # half of a 95 % band (0.5 dB, 3.4 degrees), from which resolution counts more


@dataclass(frozen=True, eq=False)
class Spectra:
    """Sums over stretches of conj(a) b of signals a, b: S (K, m, m) at f [Hz], with the longest
    reach of neighbours to either side, in the order of `names`; stretches: how many show each."""

    f: Array
    names: tuple[str, ...]
    S: ComplexArray
    stretches: Array


@dataclass(frozen=True, eq=False)
class Response:
    """A frequency response H (k,) at f [Hz], its coherence, and independent averages, (k,) each."""

    f: Array
    H: ComplexArray
    coherence: Array
    averages: Array

    @property
    def sd(self) -> Array:
        """Relative standard deviation of the magnitude, and that of the phase [rad], (k,).

        sqrt((1 - gamma^2) / (2 n gamma^2)); Bendat & Piersol, chapter 9.
        """
        g = np.clip(self.coherence, 1e-12, 1.0)
        return np.sqrt((1.0 - g) / (2.0 * np.maximum(self.averages, 1.0) * g))

    @property
    def half_band(self) -> Array:
        """Half of the 95 % band, relative to the magnitude, and of the phase [rad], (k,)."""
        free = np.maximum(2.0 * self.averages - 2.0, 1.0)
        return np.asarray(student.ppf(0.975, free) * self.sd, dtype=np.float64)

    @property
    def seen(self) -> BoolArray:
        """Where the logs show it: enough averages, and more coherence than chance gives, (k,)."""
        free = np.maximum(self.averages - 1.0, 1e-9)
        by_chance = 1.0 - CHANCE_LEVEL ** (1.0 / free)
        enough = self.averages >= EVENTS_NEEDED
        return np.asarray(enough & (self.coherence >= np.maximum(HALF, by_chance)))

    @property
    def sure(self) -> BoolArray:
        """Where it is relied on, (k,)."""
        return np.asarray(self.seen & (self.coherence > COHERENCE_SURE))

    def times(self, factor: NDArray[Any]) -> "Response":
        """The response in series with one that is known, (k,)."""
        return replace(self, H=np.asarray(self.H * factor, dtype=np.complex128))


def cross_spectra(
    band: Band, names: tuple[str, ...], each: Iterable[Sequence[ComplexArray]]
) -> Spectra:
    """Spectra of the coefficients (s, K) of each signal of each run, summed over the stretches."""
    m = len(names)
    S, stretches = np.zeros((len(band.f), m, m), dtype=np.complex128), np.zeros(len(band.f))
    for signals in each:
        x = np.moveaxis(np.stack(signals), 2, 0)  # (K, m, s)
        stretches += np.count_nonzero(signals[0], axis=0)
        S += np.conj(x) @ np.swapaxes(x, 1, 2)
    return Spectra(band.f, names, S, stretches)


def responses(
    spectra: Spectra, out: str, inputs: Sequence[str], instruments: Sequence[str] = ()
) -> list[Response]:
    """The response of `out` to each of the inputs, by name; see above.

    instruments: at least as many as inputs, or none.
    """
    found = responses_with_reach(spectra, out, inputs, instruments, REACHES[0])
    for reach in REACHES[1:]:
        wider = responses_with_reach(spectra, out, inputs, instruments, reach)
        found = [_narrower(one, other) for one, other in zip(found, wider, strict=True)]
    return found


def _narrower(one: Response, wider: Response) -> Response:
    """The response where its band is narrow, else that by more neighbours."""
    keep = one.half_band <= NARROW_BAND
    names = ("H", "coherence", "averages")
    return Response(
        one.f, *(np.where(keep, getattr(one, name), getattr(wider, name)) for name in names)
    )


@dataclass(frozen=True, eq=False)
class _Solution:
    """Of the normal equations: X'^H X' and its inverse (k, 3q, 3q), theta (k, 3q, 1), what is left
    of the output and the output itself (k,), independent rows (k,)."""

    follows: ComplexArray
    inverse: ComplexArray
    theta: ComplexArray
    left: Array
    whole: Array
    rows: Array


def left_over(
    spectra: Spectra, out: str, inputs: Sequence[str], instruments: Sequence[str] = ()
) -> Array:
    """Share of the power of `out` that the responses to the inputs leave, (k,)."""
    found = _solution(spectra, out, inputs, instruments, REACHES[1])
    share = found.left / np.maximum(found.whole, 1e-300)
    return np.where(found.whole > 0.0, np.maximum(share, 1e-12), 1.0)


def _solution(
    spectra: Spectra, out: str, inputs: Sequence[str], instruments: Sequence[str], reach: int
) -> _Solution:
    M = _moments(spectra.S, reach)
    at = {name: k for k, name in enumerate(spectra.names)}
    x, z, y = [at[name] for name in inputs], [at[name] for name in instruments], at[out]
    XX, Xy = _columns(M, x, x), _columns(M, x, [y])[:, :, :1]
    follows, with_out = XX, Xy
    if z:
        ZX, Zy = _columns(M, z, x), _columns(M, z, [y])[:, :, :1]
        onto = _adjoint(_inverse(_columns(M, z, z)) @ ZX)
        follows, with_out = onto @ ZX, onto @ Zy
    inverse = _inverse(follows)
    theta = inverse @ with_out
    yy = np.real(M[0][:, y, y])
    left = yy - 2.0 * np.real(_inner(theta, Xy)) + np.real(_inner(theta, XX @ theta))
    rows = INDEPENDENT / BINS_OF_ONE * np.sum(_neighbours(spectra.stretches, reach), axis=-1)
    free = np.maximum(rows - (DEGREE + 1) * len(x), 1.0)
    return _Solution(follows, inverse, theta, np.maximum(left, 0.0) * rows / free, yy, rows)


def responses_with_reach(
    spectra: Spectra, out: str, inputs: Sequence[str], instruments: Sequence[str], reach: int
) -> list[Response]:
    """As `responses`, with so many neighbours to either side, one of `REACHES`."""
    s = _solution(spectra, out, inputs, instruments, reach)
    f, step = spectra.f[REACHES[-1] : len(spectra.f) - REACHES[-1]], DEGREE + 1
    found = []
    for j in range(len(inputs)):
        own = slice(step * j, step * (j + 1))
        # What of the input no other one makes; of its averages the slopes take a share.
        alone = np.maximum(np.real(_inverse(s.inverse[:, own, own])[:, 0, 0]), 0.0)
        share = 1.0 / np.maximum(np.real(s.inverse[:, step * j, step * j]) * alone, 1e-300)
        made = np.abs(s.theta[:, step * j, 0]) ** 2 * alone
        coherence = made / np.maximum(made + s.left, 1e-300)
        apart = is_apart(alone, np.real(s.follows[:, step * j, step * j]))
        averages = np.where(apart, np.maximum(s.rows * share - len(inputs) + 1.0, 0.0), 0.0)
        found.append(Response(f, s.theta[:, step * j, 0], coherence, averages))
    return found


def is_apart(alone: Array, power: Array) -> BoolArray:
    """Whether an input makes enough of its power by itself, (k,)."""
    return np.asarray(alone > MATERIAL * power)


def joined(parts: Sequence[Response]) -> Response:
    """Responses of one band of frequencies after the other as one."""
    names = ("f", "H", "coherence", "averages")
    return Response(*(np.concatenate([getattr(one, name) for one in parts]) for name in names))


def in_series(one: Response, other: Response) -> Response:
    """Two responses in series, whose errors have nothing to do with each other."""
    own, others = ((1.0 - r.coherence) / np.maximum(r.coherence, 1e-12) for r in (one, other))
    averages = np.minimum(one.averages, other.averages)
    return Response(one.f, one.H * other.H, 1.0 / (1.0 + own + others), averages)


def _neighbours(x: NDArray[Any], reach: int) -> NDArray[Any]:
    """Every value of the first axis that is estimated, with so many neighbours along a last
    axis."""
    cut = REACHES[-1] - reach
    return np.lib.stride_tricks.sliding_window_view(
        x[cut : len(x) - cut], 2 * reach + 1, axis=0
    )  # fmt: skip


def _moments(S: ComplexArray, reach: int) -> list[ComplexArray]:
    """Sums of S over the neighbours of each frequency, weighted by their distance to the p."""
    view, d = _neighbours(S, reach), np.arange(-reach, reach + 1) / reach
    return [np.asarray(view @ d**p) for p in range(2 * DEGREE + 1)]


def _columns(M: Sequence[ComplexArray], a: Sequence[int], b: Sequence[int]) -> ComplexArray:
    """A^H B (k, 3 len(a), 3 len(b)) of signals and their products with the distance and its
    square."""
    step = DEGREE + 1
    out = np.zeros((len(M[0]), step * len(a), step * len(b)), dtype=np.complex128)
    for i in range(step):
        for j in range(step):
            out[:, i::step, j::step] = M[i + j][:, a][:, :, b]
    return out


def _inner(a: ComplexArray, b: ComplexArray) -> ComplexArray:
    """a^H b of columns (k, n, 1), (k,)."""
    return np.asarray((_adjoint(a) @ b)[:, 0, 0], dtype=np.complex128)


def _adjoint(x: ComplexArray) -> ComplexArray:
    return np.conj(np.swapaxes(x, 1, 2))


def _inverse(a: ComplexArray) -> ComplexArray:
    """Inverse of matrices (k, q, q), each scaled to its diagonal; what has no power gives zeros."""
    size = np.sqrt(np.maximum(np.real(np.einsum("kii->ki", a)), 0.0))
    known = size > 0.0
    unit = np.where(known, 1.0 / np.where(known, size, 1.0), 0.0)
    slack = np.eye(a.shape[1]) * RIDGE + (~known)[:, :, None] * np.eye(a.shape[1])
    whole = np.linalg.inv(a * unit[:, :, None] * unit[:, None, :] + slack)
    return np.asarray(whole * unit[:, :, None] * unit[:, None, :], dtype=np.complex128)
