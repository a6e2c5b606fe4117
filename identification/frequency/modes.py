"""Resonances and anti-resonances of a measured frequency response, by a fit of its modes.

    H(s) = e^(-s tau) [ s b_0/(s + c) + sum_i b_i s^2/(s^2 + 2 z_i w_i s + w_i^2) + b_r s^2 ]

is acceleration over force: a rigid body with viscous friction, elastic modes, and what modes beyond
the range give way. Given tau, c, w_i and z_i the rest is linear and solved within (variable
projection). Modes are added one by one while each explains more than chance; reported are those
that stand out where the logs reach, and apart from these those in a gap of the points, which what
lies below and above shows. The zeros of the sum are the anti-resonances. Sources: modal
form, Ewins, Modal Testing, 2nd ed. (2000), chapter 4; variable projection, Golub, Pereyra, SIAM J.
Numer. Anal. 10 (1973) 413.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.optimize import least_squares

from identification.arrays import Array
from identification.frequency.estimate import Response
from identification.frequency.stretches import ComplexArray
from identification.model.estimates import NORMAL_95
from identification.model.size import Size
from identification.thresholds import EVENTS_NEEDED, HALF, PENALTY

MOST_MODES = 4
HERTZ_BEGUN = 48  # frequencies with which a mode's search begins
DAMPING_BEGUN = (0.01, 0.05)
SEARCHED_FROM = 3  # of these, the best
STRUCTURE_ERROR = 0.02  # of the magnitude, that the form itself may be off
AROUND_PEAK = 0.1  # of its frequency, within which points on either side show a peak
BEYOND = 2.0  # times the highest frequency seen, up to which a mode may lie that is felt
OF_A_MODE = 3  # parameters: w_i, z_i, b_i
SHARED = 16.0  # points that are of the same stretches and neighbours, and count as one
OF_A_BIN = 0.5  # by which windows may shift a peak
LONGEST_MODE_LAG = 0.05  # s


Kind = Literal["resonance", "anti-resonance"]


@dataclass(frozen=True)
class Peak:
    """A resonance or an anti-resonance: frequency [Hz] (undamped) and damping ratio."""

    kind: Kind
    frequency: Size
    damping: Size


@dataclass(frozen=True, eq=False)
class Modes:
    """A fit of the modes: `peaks` in the order of their frequency; mass [kg] of the rigid body,
    viscous rate c [1/s], lag tau [s]; misfit: chi-square a point; felt: peaks in a gap, with points
    on either side of it."""

    peaks: tuple[Peak, ...]
    nonlinear: Array
    linear: Array
    misfit: float
    felt: tuple[Peak, ...] = ()

    @property
    def lag(self) -> float:
        """[s]"""
        return float(self.nonlinear[0])

    def response(self, f: Array) -> ComplexArray:
        """Acceleration over force at f [Hz], (k,)."""
        return np.asarray(_columns(self.nonlinear, f) @ self.linear, dtype=np.complex128)

    def undelayed(self, f: Array) -> ComplexArray:
        """The same without the lag."""
        ahead = np.exp(2j * np.pi * f * self.lag)
        return np.asarray(self.response(f) * ahead, dtype=np.complex128)


def fit_modes(response: Response) -> Modes | None:
    """The modes that a response (acceleration over force) shows; None where it shows too little."""
    use = response.seen
    if np.count_nonzero(use) < SHARED * EVENTS_NEEDED:
        return None
    f, H = response.f[use], response.H[use]
    weight = 1.0 / (np.abs(H) * np.hypot(response.sd[use], STRUCTURE_ERROR))
    data = _Data(response.f, f, H, weight)
    best = _best(data, [np.array([0.0, np.log(2.0 * np.pi * f[0])])])
    while (len(best) - 2) // 2 < MOST_MODES:
        more = _one_more(data, best)
        if more is None or not _earns(data, best, more):
            break
        best = more
    return _reported(data, best)


@dataclass(frozen=True, eq=False)
class _Data:
    """Points at f (k,) of all that might be seen, and one over their deviations."""

    every: Array
    f: Array
    H: ComplexArray
    weight: Array

    def left(self, p: Array) -> Array:
        """What the modes leave at every point, real and imaginary parts (2 k,), in deviations."""
        return self.solved(p)[0]

    def solved(self, p: Array) -> tuple[Array, Array]:
        X = _columns(p, self.f) * self.weight[:, None]
        b = self.H * self.weight
        A, rhs = np.concatenate([X.real, X.imag]), np.concatenate([b.real, b.imag])
        size = np.maximum(np.linalg.norm(A, axis=0), 1e-300)
        theta = np.linalg.lstsq(A / size, rhs, rcond=1e-12)[0] / size
        return np.asarray(A @ theta - rhs), np.asarray(theta)

    def chi(self, p: Array) -> float:
        return float(np.sum(self.left(p) ** 2))


def _columns(p: Array, f: Array) -> ComplexArray:
    """Rigid body, each mode, and the rest, (k, modes + 2), at f [Hz]; p: tau, ln c, then ln w and
    ln z of each mode."""
    s = 2j * np.pi * f
    columns = [s / (s + np.exp(p[1]))]
    for w, z in np.exp(p[2:]).reshape(-1, 2):
        columns.append(s**2 / (s**2 + 2.0 * z * w * s + w**2))
    columns.append(s**2)
    return np.asarray(np.column_stack(columns) * np.exp(-s * p[0])[:, None], dtype=np.complex128)


def _best(data: _Data, starts: Sequence[Array]) -> Array:
    """The best of the fits that begin so."""
    w = 2.0 * np.pi * data.f[[0, -1]]
    found = []
    for p in starts:
        modes = (len(p) - 2) // 2
        low = [
            -LONGEST_MODE_LAG,
            np.log(1e-4 * w[0]),
            *([np.log(0.5 * w[0]), np.log(1e-4)] * modes),
        ]
        high = [LONGEST_MODE_LAG, np.log(10.0 * w[1]), *([np.log(3.0 * w[1]), np.log(1.5)] * modes)]
        scale = [1e-4, 1.0, *([0.05, 0.5] * modes)]
        fit = least_squares(
            data.left, np.clip(p, low, high), bounds=(low, high), x_scale=scale, max_nfev=60
        )
        found.append((float(fit.cost), fit.x))
    return np.asarray(min(found, key=lambda one: one[0])[1])


def _one_more(data: _Data, p: Array) -> Array | None:
    """The fit with another mode."""
    low, high = data.f[0], BEYOND * data.f[-1]
    tried = [
        np.append(p, [np.log(2.0 * np.pi * f), np.log(z)])
        for f in np.geomspace(low, high, HERTZ_BEGUN)
        for z in DAMPING_BEGUN
    ]
    starts = sorted(tried, key=data.chi)[:SEARCHED_FROM]
    return _best(data, starts)


def _earns(data: _Data, before: Array, after: Array) -> bool:
    """Whether the last mode explains more than chance."""
    was, now = data.chi(before), data.chi(after)
    free = 2 * len(data.f) - 3 - 3 * ((len(after) - 2) // 2)
    apart = all(_apart(after[-2:], after[k : k + 2]) for k in range(2, len(before), 2))
    return apart and explains_more(was, now, free)


def explains_more(was: float, now: float, free: int) -> bool:
    """Whether chi-square falls by more than chance; free: points less parameters."""
    gained = (was - now) / max(now / max(free, 1), 1.0) / SHARED
    return gained > PENALTY * OF_A_MODE


def _apart(one: Array, other: Array) -> bool:
    """Whether two modes, ln w and ln z each, are more than one that is reported twice."""
    return bool(abs(one[0] - other[0]) > max(np.exp(one[1]), np.exp(other[1])))


def _stands_out(p: Array, theta: Array, k: int) -> bool:
    """Whether a mode is a resonance."""
    w = np.exp(p[2 + 2 * k])
    parts = (_columns(p, np.array([w / (2.0 * np.pi)])) * theta)[0]
    own, rest = abs(parts[1 + k]), abs(np.sum(np.delete(parts, 1 + k)))
    return is_large(own, rest)


def is_large(own: float, rest: float) -> bool:
    """Whether what a mode adds stands out of the rest of the response."""
    return bool(own > HALF * rest)


def is_deep(left: float, rigid: float) -> bool:
    """Whether an anti-resonance leaves little of the rigid body's response."""
    return bool(left < HALF * rigid)


def is_sharp(one: Peak) -> bool:
    """Whether the 95 % interval of a peak's frequency lies where points show it."""
    return NORMAL_95 * one.frequency.sd < AROUND_PEAK * one.frequency.value


def _shown(data: _Data, f: float) -> bool:
    """Whether points lie close to a frequency on either side."""
    for low, high in (((1.0 - AROUND_PEAK) * f, f), (f, (1.0 + AROUND_PEAK) * f)):
        if np.count_nonzero((data.f >= low) & (data.f <= high)) < EVENTS_NEEDED:
            return False
    return True


def _felt(data: _Data, f: float) -> bool:
    """Whether points lie below and above a frequency."""
    return all(np.count_nonzero(side) >= EVENTS_NEEDED for side in (data.f < f, data.f > f))


def _reported(data: _Data, p: Array) -> Modes:
    """The fit with its peaks and their deviations."""
    left, theta = data.solved(p)
    misfit = float(np.mean(left**2))
    sd = _deviations(data, p, misfit)
    modes = (len(p) - 2) // 2
    peaks = []
    for k in range(modes):
        if not _stands_out(p, theta, k):
            continue
        w, z = np.exp(p[2 + 2 * k : 4 + 2 * k])
        at = slice(2 + 2 * k, 4 + 2 * k)
        spread = np.exp(p[at]) * sd[at] / np.array([2.0 * np.pi, 1.0])
        where = float(w / (2.0 * np.pi)), float(z)
        peaks.append(_peak(data, "resonance", where, (float(spread[0]), float(spread[1]))))
    peaks += _anti_resonances(data, p, theta, misfit)
    sure = sorted(filter(is_sharp, peaks), key=lambda one: one.frequency.value)
    shown = tuple(one for one in sure if _shown(data, one.frequency.value))
    felt = [one for one in sure if one not in shown and _felt(data, one.frequency.value)]
    return Modes(shown, p, theta, misfit, tuple(felt))


def _deviations(data: _Data, p: Array, misfit: float) -> Array:
    """Standard deviations of the nonlinear parameters, (n,)."""
    step = 1e-5
    J = np.column_stack(
        [(data.left(p + step * e) - data.left(p - step * e)) / (2.0 * step) for e in np.eye(len(p))]
    )
    size = np.maximum(np.linalg.norm(J, axis=0), 1e-300)
    inverse = np.linalg.pinv((J / size).T @ (J / size), rcond=1e-10)
    return np.asarray(np.sqrt(np.diag(inverse) * SHARED * max(misfit, 1.0)) / size)


def _peak(
    data: _Data, kind: Kind, where: tuple[float, float], sd: tuple[float, float]
) -> Peak:  # fmt: skip
    """A peak at a frequency [Hz] and of a damping, with their deviations by the fit."""
    k = int(np.clip(np.searchsorted(data.every, where[0]), 1, len(data.every) - 1))
    blur = OF_A_BIN * float(data.every[k] - data.every[k - 1])
    frequency = Size(where[0], float(np.hypot(sd[0], blur)))
    return Peak(kind, frequency, Size(where[1], float(np.hypot(sd[1], blur / where[0]))))


def _zeros(p: Array, theta: Array) -> ComplexArray:
    """Zeros [rad/s] of the modes' sum, those in the upper half plane."""
    modes = np.exp(p[2:]).reshape(-1, 2)
    below = [np.array([1.0, 2.0 * z * w, w**2]) for w, z in modes]
    rigid = np.array([1.0, np.exp(p[1])])
    # Over s: b_0 / (s + c) + sum b_i s/(...) + b_r s
    total = theta[0] * _product(below)
    for k, one in enumerate(theta[1 : 1 + len(modes)]):
        others = _product([rigid, *below[:k], *below[k + 1 :]])
        total = np.polyadd(total, one * np.convolve([1.0, 0.0], others))
    total = np.polyadd(total, theta[-1] * np.convolve([1.0, 0.0], _product([rigid, *below])))
    found = np.roots(total)
    return np.asarray(found[found.imag > 0.0], dtype=np.complex128)


def _product(factors: Sequence[Array]) -> Array:
    out = np.ones(1)
    for one in factors:
        out = np.convolve(out, one)
    return out


def _anti_resonances(data: _Data, p: Array, theta: Array, misfit: float) -> list[Peak]:
    """The deep zeros, with deviations by those of the parameters."""
    out = []
    for zero in _zeros(p, theta):
        f, damping = abs(zero) / (2.0 * np.pi), -zero.real / abs(zero)
        parts = (_columns(p, np.array([f])) * theta)[0]
        if not is_deep(abs(np.sum(parts)), abs(parts[0])):
            continue
        near = _zero_spread(data, p, zero, misfit)
        out.append(Peak("anti-resonance", Size(float(f), near[0]), Size(float(damping), near[1])))
    return out


def _zero_spread(data: _Data, p: Array, zero: complex, misfit: float) -> tuple[float, float]:
    """Deviations of a zero's frequency [Hz] and damping."""
    sd = _deviations(data, p, misfit)
    total = np.zeros(2)
    for j in range(len(p)):
        moved = p + sd[j] * np.eye(len(p))[j] * 0.1
        zeros = _zeros(moved, data.solved(moved)[1])
        if not len(zeros):
            continue
        one = zeros[np.argmin(np.abs(zeros - zero))]
        change = [
            (abs(one) - abs(zero)) / (2.0 * np.pi), -one.real / abs(one) + zero.real / abs(zero)
        ]  # fmt: skip
        total += (np.array(change) * 10.0) ** 2
    return float(np.sqrt(total[0])), float(np.sqrt(total[1]))
