"""Filters A, B, C and the velocity (5) around the compensator, in the paper's two versions.

A smooths the position of which the velocity is taken, B that of the position error, C what the
compensator gives. The paper says of the rig that a filter of order 40 delays the velocity by
0.21 s, and names it B, while its text takes the velocity behind A: `rig_filters` has both readings.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from identification.arrays import Array
from identification.compiled import compiled_exact
from identification.errors import BadSpecification
from identification.signals.filters import RIG_A, RIG_C, Filter, fir_lowpass

N_D = 5  # positions of the slope (5)
SHORTEST_SLOPE = 2
CUTOFF, RIG_CUTOFF = 5.0, 10.0  # Hz
RIG_PERIOD = 10e-3  # s
QUICK_SLOPE, LONGEST_SLOPE = 3, 20
QUICK_SHARE = 0.4  # of the band, to which the slope's noise may come before its filter
QUICK_SAMPLES = (2.0, 1.0)  # time constants of velocity and error, in samples
PASS = Filter((1.0,))


@dataclass(frozen=True)
class CompensatorFilters:
    """velocity: of the position before its slope (5); error: of the position in r - y; force: C."""

    velocity: Filter = PASS
    error: Filter = PASS
    force: Filter = PASS
    N_d: int = N_D


def simulation_filters(h: float) -> CompensatorFilters:
    """A, B, C: FIR of order 40, 5 Hz, sampled at h [s]. Source: paper, section 3.2."""
    low = fir_lowpass(CUTOFF, h)
    return CompensatorFilters(low, low, low)


def rig_filters(h: float, *, as_lettered: bool = False) -> CompensatorFilters:
    """0.5/(1 - 0.5 z^-1), FIR of order 40 at 10 Hz, C = 0.2/(1 - 0.8 z^-1). Source: section 3.3.2.

    The FIR smooths the velocity's position, as the delay that the paper states asks for;
    as_lettered: the error's, as its letters A and B ask for.
    """
    low = fir_lowpass(RIG_CUTOFF, h)
    velocity, error = (RIG_A, low) if as_lettered else (low, RIG_A)
    return CompensatorFilters(velocity, error, RIG_C)


def filters_at(h: float) -> CompensatorFilters:
    """The rig's A (velocity and error) and C with their time constants, sampled at any h [s].

    At 10 ms they are the paper's 0.5/(1 - 0.5 z^-1) and 0.2/(1 - 0.8 z^-1).
    """
    return scaled_filters(h, 1.0)


def scaled_filters(h: float, times: float) -> CompensatorFilters:
    """`filters_at` with time constants and the slope's length `times` theirs.

    Raises BadSpecification where h [s] or `times` is not positive.
    """
    if not (h > 0 and times > 0):
        raise BadSpecification(f"sampling period {h:g} s, filters times {times:g}; need both > 0")
    first, last = (
        _first_order((-one.a[1]) ** (h / (times * RIG_PERIOD))) for one in (RIG_A, RIG_C)
    )
    return CompensatorFilters(first, first, last, max(round(times * N_D), SHORTEST_SLOPE))


def quick_filters(h: float, noise: float, band: float) -> CompensatorFilters:
    """Filters for a compensator that acts within a stick: as short as the position's noise lets.

    The slope (5) is over the fewest positions, of noise [m], that leave of it a share of the band
    [m/s]; no filter C. Raises BadSpecification where h [s] or the band is not positive.
    """
    if not (h > 0 and band > 0):
        raise BadSpecification(f"sampling period {h:g} s, band {band:g} m/s; need both > 0")
    most = QUICK_SHARE * band * h / noise if noise > 0 else math.inf
    spans = range(QUICK_SLOPE, LONGEST_SLOPE)
    n = next((n for n in spans if n * (n * n - 1) * most**2 >= 12.0), LONGEST_SLOPE)
    velocity, error = (_first_order(math.exp(-1.0 / samples)) for samples in QUICK_SAMPLES)
    return CompensatorFilters(velocity, error, PASS, n)


def _first_order(pole: float) -> Filter:
    return Filter((1.0 - pole,), (1.0, -pole))


class Sampled(NamedTuple):
    """A filter as the kernels take it, a[0] = 1: b, a of one length, or a = (1) of a FIR filter."""

    b: Array
    a: Array


def sampled(one: Filter, slope: Filter | None = None) -> Sampled:
    """The filter, in series with `slope`, for the kernels.

    Raises BadSpecification where a[0] is not 1, or the filter has no gain at rest.
    """
    b, a = np.array(one.b), np.array(one.a)
    if slope is not None:
        b, a = np.convolve(b, slope.b), np.convolve(a, slope.a)
    if a[0] != 1.0 or not (np.all(np.isfinite(b)) and np.all(np.isfinite(a))) or a.sum() == 0.0:
        raise BadSpecification(f"filter b = {one.b}, a = {one.a}: need a[0] = 1, a(1) not 0")
    if not np.any(a[1:]):
        return Sampled(b, np.ones(1))
    size = max(b.size, a.size)
    return Sampled(np.pad(b, (0, size - b.size)), np.pad(a, (0, size - a.size)))


def steady_state(one: Sampled, x: float) -> Array:
    """The state of the filter, of the length of b, last entry 0, that a past of `x` leaves."""
    b, a = one.b, np.pad(one.a, (0, one.b.size - one.a.size))
    left = b - a * float(b.sum() / a.sum())
    return np.asarray(x * np.append(np.cumsum(left[:0:-1])[::-1], 0.0), dtype=np.float64)


@compiled_exact
def filtered(b: Array, a: Array, z: Array, x: float) -> float:
    """Next value of the filter at input x; z (n,), last entry 0, is its state."""
    out = b[0] * x + z[0]
    if len(a) == 1:
        for j in range(len(z) - 1):
            z[j] = z[j + 1] + b[j + 1] * x
    else:
        for j in range(len(z) - 1):
            z[j] = z[j + 1] + b[j + 1] * x - a[j + 1] * out
    return float(out)
