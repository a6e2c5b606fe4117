"""A load that swings behind a motor at rest, looked for where friction hides the force.

Where a motor is stuck its friction is whatever holds it: inertia's force is 0, but a load behind an
elastic shaft still pulls. Of a load with anti-resonance w, damping z and a share of the mass, at
rest and in slow motion,

    F = m a + share m (a_L - a),    a_L = (2 z w s + w^2)/(s^2 + 2 z w s + w^2) a.

The second term is a further input of the body, whose response over that of the force is the
constant share m. Frequencies are tried in turn, and the one is taken at which the force so made
leaves least of the motion; a load is reported only where it leaves much less than none.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.arrays import Array, BoolArray
from identification.frequency.estimate import (
    Spectra,
    cross_spectra,
    left_over,
    responses_with_reach,
)
from identification.frequency.machine import (
    Recording,
    coefficients_of,
    cut,
    instruments_of,
)
from identification.frequency.stretches import (
    REACHES,
    Band,
    ComplexArray,
    coefficients,
    hold,
)
from identification.model.resonance import load_acceleration
from identification.thresholds import EARNS

LOAD_HERTZ_TRIED = 20  # anti-resonances tried, on a scale of ratios
DAMPING_TRIED = 0.02
FINER, FINER_STEPS = (0.5, 0.25, 0.12), (-1.0, 1.0)  # of their distance, around the best
DAMPINGS_TRIED = (0.005, 0.01, 0.04, 0.08)
FROM_LOWEST = 4.0  # times the lowest frequency, from which on
BANDS_TRIED = 2  # of the longest stretches
SAMPLES_TRIED = 150_000  # of the longest runs, after which no further one is
SHARE_BOUNDS = (0.02, 0.98)  # of the mass, that is a load


@dataclass(frozen=True)
class Load:
    """A load behind a spring: anti-resonance [Hz] and damping, and its share of the whole mass."""

    anti_resonance: float
    damping: float
    share: float

    def beyond(self, a: Array, h: float) -> Array:
        """Its acceleration less that of the motor, (n,), every h [s]."""
        f = self.anti_resonance
        return np.asarray(load_acceleration(a, h, f, f, self.damping) - a)


@dataclass(frozen=True, eq=False)
class Rests:
    """Where a body rests or is slow, and its acceleration [m/s^2], (n,) each."""

    where: BoolArray
    a: Array


def swinging_load(runs: Sequence[Recording], rests: Sequence[Rests], mass: float) -> Load | None:
    """The load that the runs show behind their motor at rest, None where they show none.

    runs: their `linear` force that of one mass [kg] where they rest.
    """
    if not any(np.any(one.where) for one in rests):
        return None
    names = ("a", "linear", *instruments_of(runs))
    both = _longest(list(zip(runs, rests, strict=True)))
    runs = [one for one, _ in both]
    bands = [
        _Band(band, names, [[coefficients_of(one, band, k) for k in names] for one in runs], both)
        for band in cut(runs)[:BANDS_TRIED]
    ]
    first, last = bands[0].band.f, bands[-1].band.f
    low, high = FROM_LOWEST * float(first[first > 0.0][0]), float(last[-1]) / 2.0
    if not low < high:
        return None
    none = float(np.mean(np.log(np.concatenate([one.left() for one in bands]))))
    every = np.geomspace(low, high, LOAD_HERTZ_TRIED)
    tried = [_tried(bands, f, DAMPING_TRIED, mass) for f in every]
    best = min(tried, key=lambda one: one[0])
    step = float(np.log(every[1] / every[0]))
    for finer in FINER:
        for way in FINER_STEPS:
            f = best[1].anti_resonance * np.exp(way * finer * step)
            best = min(best, _tried(bands, f, best[1].damping, mass), key=lambda one: one[0])
    for damping in DAMPINGS_TRIED:
        f = best[1].anti_resonance
        best = min(best, _tried(bands, f, damping, mass), key=lambda one: one[0])
    left, load = best
    inside = SHARE_BOUNDS[0] < load.share < SHARE_BOUNDS[1]
    return load if inside and leaves_less(left, none) else None


def leaves_less(left: float, none: float) -> bool:
    """Whether a load leaves clearly less than none, mean logarithms both."""
    return left < none + float(np.log(EARNS))


def _longest(both: list[tuple[Recording, Rests]]) -> list[tuple[Recording, Rests]]:
    """The longest runs, up to so many samples together."""
    ordered = sorted(both, key=lambda one: -len(one[0].y))
    before = np.cumsum([0, *(len(one.y) for one, _ in ordered[:-1])])
    return [one for one, n in zip(ordered, before, strict=True) if n < SAMPLES_TRIED]


@dataclass(frozen=True, eq=False)
class _Band:
    """A band of frequencies, the coefficients of the signals `names` of every run in it, the runs
    and where they rest."""

    band: Band
    names: tuple[str, ...]
    known: list[list[ComplexArray]]
    runs: list[tuple[Recording, Rests]]

    @property
    def instruments(self) -> tuple[str, ...]:
        """The reference, where there is one."""
        return self.names[2:]

    def left(self) -> Array:
        """What one mass leaves of the motion, as a share of it, (k,)."""
        spectra = cross_spectra(self.band, self.names, self.known)
        return left_over(spectra, "a", ["linear"], self.instruments)

    def with_pull(self, load: Load) -> Spectra:
        """The spectra with the pull of a load of the whole mass as a further signal."""
        each = [
            [*known, _pull(run, rest, load, self.band)]
            for known, (run, rest) in zip(self.known, self.runs, strict=True)
        ]
        return cross_spectra(self.band, (*self.names, "pull"), each)


def _tried(bands: Sequence[_Band], f: float, damping: float, mass: float) -> tuple[float, Load]:
    """What a load of this anti-resonance leaves (mean logarithm), its share of the mass found."""
    unit = Load(f, damping, 1.0)
    every = [one.with_pull(unit) for one in bands]
    above = below = 0.0
    for one, spectra in zip(bands, every, strict=True):
        Z = (*one.instruments, "pull") if one.instruments else ()
        force, pull = responses_with_reach(spectra, "a", ["linear", "pull"], Z, REACHES[1])
        weight = np.where(pull.averages > 0.0, pull.coherence / np.maximum(pull.sd, 1e-3) ** 2, 0.0)
        ratio = np.real(pull.H / np.where(force.H != 0.0, force.H, 1.0))
        above += float(np.sum(weight * ratio))
        below += float(np.sum(weight))
    share = float(np.clip(above / max(below, 1e-300) / mass, 0.0, 1.0))
    left = [
        left_over(_pulled(spectra, share * mass), "a", ["linear"], one.instruments)
        for one, spectra in zip(bands, every, strict=True)
    ]
    return float(np.mean(np.log(np.concatenate(left)))), Load(f, damping, share)


def _pulled(spectra: Spectra, size: float) -> Spectra:
    """The spectra with a pull of this size [kg] in the force."""
    change = np.eye(len(spectra.names))
    at = spectra.names.index
    change[at("linear"), at("pull")] = size
    return Spectra(spectra.f, spectra.names, change @ spectra.S @ change.T, spectra.stretches)


def _pull(run: Recording, rest: Rests, load: Load, band: Band) -> ComplexArray:
    """Coefficients (s, k) of what the load pulls with at rest, of a mass of 1 kg."""
    pull = np.where(rest.where, load.beyond(rest.a, run.h), 0.0)
    zoh = hold(band.f, run.h) if run.zoh else 1.0
    return coefficients(pull[1:-1], run.h, band) * zoh
