"""Reference and command signals as values: steps, random steps, ramps, multisine, and sums."""

from dataclasses import dataclass

import numpy as np

from identification.arrays import Array, IntArray
from identification.errors import BadSpecification


@dataclass(frozen=True)
class Steps:
    """The `levels` in turn, each held for `dwell` [s], again from the first after the last."""

    levels: tuple[float, ...]
    dwell: float

    def __post_init__(self) -> None:
        _need(len(self.levels) > 0, "steps without levels; name at least one")
        _positive("steps", dwell=self.dwell)


@dataclass(frozen=True)
class RandomSteps:
    """Levels drawn evenly from [-amplitude, amplitude], each held for `dwell` [s]."""

    amplitude: float
    dwell: float

    def __post_init__(self) -> None:
        _positive("random_steps", amplitude=self.amplitude, dwell=self.dwell)


@dataclass(frozen=True)
class Ramps:
    """Triangle of period 4 amplitude/rate between -amplitude and amplitude; rate [1/s]."""

    amplitude: float
    rate: float

    def __post_init__(self) -> None:
        _positive("ramps", amplitude=self.amplitude, rate=self.rate)


@dataclass(frozen=True)
class Multisine:
    """`lines` sines from `low` to `high` [Hz], of equal size, with the power of one of `amplitude`.

    The phases are Schroeder's, so the crest factor is small and the signal needs no seed.
    """

    amplitude: float
    low: float
    high: float
    lines: int = 20

    def __post_init__(self) -> None:
        _positive("multisine", amplitude=self.amplitude, low=self.low, lines=self.lines)
        _need(self.high > self.low, f"multisine from {self.low:g} to {self.high:g} Hz; high > low")


@dataclass(frozen=True)
class Sum:
    """The sum of its parts."""

    parts: "tuple[ReferenceSpec, ...]"

    def __post_init__(self) -> None:
        _need(len(self.parts) > 0, "sum without parts; name at least one")


ReferenceSpec = Steps | RandomSteps | Ramps | Multisine | Sum


def reference_signal(spec: ReferenceSpec, t: Array, rng: np.random.Generator) -> Array:
    """The signal that `spec` describes at the times `t` [s], in the unit of its levels, shape (n,).

    t: increasing; the signal starts at t[0]. Only random steps draw from `rng`. Source: phases of
    the multisine after Schroeder, IEEE Trans. Inf. Theory 16 (1970).
    """
    t = np.asarray(t, dtype=np.float64)
    time = t - t[0]
    match spec:
        case Steps(heights, dwell):
            return np.array(heights, dtype=np.float64)[_slot(time, dwell) % len(heights)]
        case RandomSteps(amplitude, dwell):
            slot = _slot(time, dwell)
            levels = rng.uniform(-amplitude, amplitude, int(slot[-1]) + 1)
            return np.asarray(levels[slot], dtype=np.float64)
        case Ramps(amplitude, rate):
            phase = np.mod(time * rate / amplitude + 1.0, 4.0)
            return np.asarray(amplitude * (1.0 - np.abs(phase - 2.0)), dtype=np.float64)
        case Multisine():
            return _multisine(spec, time)
        case Sum(parts):
            total = np.zeros_like(t)
            for part in parts:
                total += reference_signal(part, t, rng)
            return total


def _slot(time: Array, dwell: float) -> IntArray:
    """Number of the dwell in which each time lies; a sample on the border opens the next."""
    return np.floor(time / dwell + 1e-9).astype(np.int64)


def _multisine(spec: Multisine, time: Array) -> Array:
    out = np.zeros_like(time)
    for k, frequency in enumerate(np.linspace(spec.low, spec.high, spec.lines)):
        phase = -np.pi * k * (k + 1) / spec.lines
        out += np.sin(2.0 * np.pi * frequency * time + phase)
    return np.asarray(out * (spec.amplitude / np.sqrt(spec.lines)), dtype=np.float64)


def _positive(what: str, **values: float) -> None:
    for name, value in values.items():
        _need(bool(np.isfinite(value) and value > 0), f"{what}: {name} = {value:g}; must be > 0")


def _need(holds: bool, message: str) -> None:
    if not holds:
        raise BadSpecification(message)
