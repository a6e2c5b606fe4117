"""A P-PI cascade tuned as a structure of its own: position P above a speed PI, as drives have it.

    u = k_p (1 + 1/(T_n s)) (k_v (r - y) + v_ff dr/dt - v),   v = dy/dt behind 1/(eps s + 1),

with a notch or a low-pass behind it where the machine swings. The four numbers are searched on the
machine's own linear plants: the loop with the largest bandwidth, by |S_yp| at -3 dB, that keeps its
goals on all of them. Sources: Schroeder, Elektrische Antriebe - Regelung von Antriebssystemen, 4th
ed., chapters 3, 19; bandwidth, Skogestad, Postlethwaite, Multivariable Feedback Control, 2nd ed.,
section 2.4.5.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from design.filters import PASS
from design.margins import Margins, margins
from design.polynomial import ComplexArray, evaluate, roots
from design.present import cascade_to_rst
from design.rst import RST, closed_loop
from design.series_filters import SeriesFilter
from design.specification import normalised_plant
from design.tracking import Plants, integrates
from design.tune import Goals, goals_missed, worst_modulus
from identification.arrays import Array
from identification.errors import BadSpecification
from identification.signals.filters import Filter

V_FF = 1.0  # of the reference's speed, that is fed forward
CASCADE_SPEEDS = np.geomspace(1.5e-3, 0.9, 33)  # k_p h/m tried
RESETS = (3.0, 4.0, 6.0, 8.0)  # T_n k_p/m tried; 4 is the symmetrical optimum
ABOVE = (2.5, 3.0, 4.0, 6.0)  # k_p/(m k_v) tried
SMOOTHINGS = (0.05, 0.12, 0.25, 0.5)  # eps k_p/m tried
FINER_CASCADE = (1.0, 0.93, 0.87, 1.07, 1.15)  # times the best of these, tried after it
HALF_POWER_S = 1.0 / math.sqrt(2.0)
LOWEST_EVALUATED = 1e-4  # of half the sampling rate
POINTS_EVERYWHERE, POINTS_AT_A_SWING = 260, 60
AROUND_A_SWING = 0.15  # of its frequency
EVALUATED_EXACTLY = 40  # of the best by the grid of frequencies
RESET_COUNTS = 0.1  # logarithm of 1/T_n beside that of the bandwidth


@dataclass(frozen=True)
class CascadeGains:
    """k_v [1/s], k_p [N s/m], T_n, eps [s], v_ff [-]."""

    k_v: float
    k_p: float
    T_n: float
    eps: float
    v_ff: float = V_FF

    def rst(self, h: float) -> RST:
        """The cascade sampled every h [s]."""
        return cascade_to_rst(self.k_v, self.k_p, self.T_n, h, eps=self.eps, v_ff=self.v_ff)


@dataclass(frozen=True, eq=False)
class TunedCascade:
    """A cascade with its filter (None: without one) as one controller, its margins on the nominal
    plant, least modulus margin on all plants (None: unstable on one), its bandwidth [Hz], and the
    goals that it misses."""

    gains: CascadeGains
    series: SeriesFilter | None
    rst: RST
    margins: Margins
    worst: float | None
    bandwidth: float
    missed: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class _Evaluated:
    """Plants over the frequencies f (k,): responses (plants, k), 1 - z^-1 and z^-1 (k,)."""

    plants: Plants
    h: float
    f: Array
    P: ComplexArray
    back: ComplexArray


def in_series(controller: RST, series: Filter) -> RST:
    """The controller with a filter behind it: its output is that of the filter."""
    R, S, T = (
        np.convolve(c, one)
        for c, one in ((controller.R, series.b), (controller.S, series.a), (controller.T, series.b))
    )
    return RST(R, S, T, controller.h)


def bandwidth_of(A: Array, B: Array, controller: RST) -> float:
    """The frequency [Hz] below which |S_yp| is under -3 dB; half the sampling rate if it stays."""
    f = 0.5 / controller.h * np.geomspace(LOWEST_EVALUATED, 1.0, 4000)
    z = np.exp(2j * np.pi * f * controller.h)
    back = evaluate(A, z) * evaluate(controller.S, z)
    S = np.abs(back / (back + evaluate(B, z) * evaluate(controller.R, z)))
    return float(_first_above(f, S[np.newaxis])[0])


def tune_cascade(
    plants: Plants, h: float, m: float, goals: Goals, *,
    filters: Iterable[SeriesFilter | None] = (None,), swings: Sequence[float] = (),
    v_ff: float = V_FF,
) -> TunedCascade:  # fmt: skip
    """The cascade with the largest bandwidth within the goals, or the one that misses fewest.

    plants: (A, B), the nominal one first, on all of which the modulus margin is kept; m: mass [kg],
    by which the gains are tried; filters: to try behind it; swings: frequencies [Hz] of resonances
    and anti-resonances. goals: `fastest` bounds k_p/m. Raises BadSpecification where no cascade of
    the search is stable.
    """
    plants = [normalised_plant(A, B) for A, B in plants]
    seen = _seen(plants, h, swings)
    found: list[tuple[float, CascadeGains, SeriesFilter | None]] = []
    for one in filters:
        found += [(score, gains, one) for score, gains in _tried(seen, m, goals, one, v_ff)]
    found.sort(key=lambda each: -each[0])
    best = _first_admissible(seen, goals, found)
    if best is None:
        raise BadSpecification(
            "no P-PI cascade stabilizes these plants with the margins asked for; ask for less"
        )
    again = [
        (score, gains, best.series)
        for score, gains in _tried(seen, m, goals, best.series, v_ff, near=best.gains)
    ]
    again.sort(key=lambda each: -each[0])
    finer = _first_admissible(seen, goals, again)
    if finer is not None and not finer.missed and finer.bandwidth > best.bandwidth:
        return finer
    return best


def _seen(plants: Plants, h: float, swings: Sequence[float]) -> _Evaluated:
    half = 0.5 / h
    near = np.linspace(1.0 - AROUND_A_SWING, 1.0 + AROUND_A_SWING, POINTS_AT_A_SWING)
    f = [half * np.geomspace(LOWEST_EVALUATED, 1.0, POINTS_EVERYWHERE), *(s * near for s in swings)]
    every = np.unique(np.concatenate(f))
    every = every[every <= half]
    z = np.exp(2j * np.pi * every * h)
    P = np.array([evaluate(B, z) / evaluate(A, z) for A, B in plants], dtype=np.complex128)
    return _Evaluated(plants, h, every, P, np.asarray(1.0 / z, dtype=np.complex128))


def _tried(
    seen: _Evaluated, m: float, goals: Goals, series: SeriesFilter | None, v_ff: float,
    near: CascadeGains | None = None,
) -> list[tuple[float, CascadeGains]]:  # fmt: skip
    """Cascades that keep modulus margin and effort on the grid of frequencies, with their scores.

    near: gains around which to look, in place of the whole grid.
    """
    h, back = seen.h, seen.back
    N = np.ones(1) if series is None else series.response(seen.f)
    difference = (1.0 - back) / h
    out = []
    for w, smoothing, T_n, k_v in _points(h, goals, near, m):
        pole = math.exp(-h / smoothing)
        speed = difference * (1.0 - pole) / (1.0 - pole * back)
        pi = m * w * (1.0 + h / T_n[:, None] * back / (1.0 - back))
        C = N * pi * (k_v[:, None] + speed)  # (tried, k)
        wide = np.full(len(T_n), np.inf)
        for number, P in enumerate(seen.P):
            L = P * C
            distance = np.abs(1.0 + L)
            admissible = np.min(distance, axis=1) >= goals.modulus
            if number == 0:
                admissible &= _delay_borne(seen.f * h, L) >= goals.delay
                if goals.effort is not None:
                    effort = np.max(np.abs(C) / distance, axis=1)
                    admissible &= effort <= 10.0 ** (goals.effort / 20.0)
            C, T_n, k_v = C[admissible], T_n[admissible], k_v[admissible]
            wide = np.minimum(wide[admissible], _first_above(seen.f, 1.0 / distance[admissible]))
            if not len(C):
                break
        for bandwidth, T, k in zip(wide, T_n, k_v, strict=True):
            gains = CascadeGains(float(k), m * w, float(T), smoothing, v_ff)
            out.append((math.log(bandwidth) - RESET_COUNTS * math.log(T), gains))
    return out


def _delay_borne(share: Array, L: ComplexArray) -> Array:
    """Delay margins [samples] of loops L (n, k) at these shares (k,) of the sampling rate."""
    size = np.abs(L)
    crosses = (size[:, :-1] > 1.0) != (size[:, 1:] > 1.0)
    phase = (np.angle(L[:, :-1]) + np.pi) % (2.0 * np.pi)
    borne = np.where(crosses, phase / (2.0 * np.pi * share[:-1]), np.inf)
    return np.asarray(np.min(borne, axis=1), dtype=np.float64)


def _points(
    h: float, goals: Goals, near: CascadeGains | None, m: float
) -> list[tuple[float, float, Array, Array]]:
    """k_p/m, eps, and T_n and k_v (tried,), to try together."""
    if near is not None:
        finer = np.array(FINER_CASCADE)
        T_n, k_v = (
            one.ravel() for one in np.meshgrid(near.T_n * finer, near.k_v * finer, indexing="ij")
        )
        return [(near.k_p / m * a, near.eps * b, T_n, k_v) for a in finer for b in (0.7, 1.0, 1.4)]
    fastest = math.inf if goals.fastest is None else goals.fastest
    resets, above = (one.ravel() for one in np.meshgrid(RESETS, ABOVE, indexing="ij"))
    return [
        (w, smoothing / w, resets / w, w / above)
        for w in CASCADE_SPEEDS / h
        if w <= fastest
        for smoothing in SMOOTHINGS
    ]


def _first_admissible(
    seen: _Evaluated, goals: Goals, found: Sequence[tuple[float, CascadeGains, SeriesFilter | None]]
) -> TunedCascade | None:
    """The first that is stable on all plants and meets the goals, as they are given exactly.

    Where none does, the first that is stable; None where none is.
    """
    spare: TunedCascade | None = None
    tried = 0
    for _, gains, series in found:
        rst = in_series(gains.rst(seen.h), PASS if series is None else series.filter)
        if not all(_stable(A, B, rst) for A, B in seen.plants):
            continue
        tried += 1
        one = _exactly(seen, goals, gains, series, rst)
        if not one.missed:
            return one
        spare = spare or one
        if tried >= EVALUATED_EXACTLY:
            break
    return spare


def _stable(A: Array, B: Array, rst: RST) -> bool:
    z = roots(closed_loop(A, B, rst))
    return bool(np.all(np.abs(z) < 1.0))


def _exactly(
    seen: _Evaluated, goals: Goals, gains: CascadeGains, series: SeriesFilter | None, rst: RST
) -> TunedCascade:
    A, B = seen.plants[0]
    found = margins(A, B, rst)
    worst = worst_modulus(seen.plants, rst)
    missed = goals_missed(found, goals, integrates(A, rst))
    if worst is not None and worst < goals.modulus <= found.modulus:
        missed = (*missed, f"modulus margin {worst:.3f} inside the parameters' intervals")
    return TunedCascade(gains, series, rst, found, worst, bandwidth_of(A, B, rst), missed)


def _first_above(f: Array, S: Array) -> Array:
    """Frequencies [Hz] at which |S| (n, k) first comes to -3 dB, over logarithms of both."""
    if not len(S):
        return np.empty(0)
    above = S > HALF_POWER_S
    at = np.where(np.any(above, axis=1), np.argmax(above, axis=1), len(f) - 1)
    rows, low = np.arange(len(S)), np.maximum(at - 1, 0)
    before, after = np.log(S[rows, low]), np.log(S[rows, at])
    rise = np.where(after > before, after - before, 1.0)
    share = np.clip((math.log(HALF_POWER_S) - before) / rise, 0.0, 1.0)
    return np.asarray(f[low] * (f[at] / f[low]) ** share, dtype=np.float64)
