"""Causal filters: the rig's A and C, windowed low-passes B, and the velocity (5)."""

from dataclasses import dataclass

import numpy as np

from identification.arrays import Array
from identification.errors import BadSpecification


@dataclass(frozen=True)
class Filter:
    """Discrete filter b(z^-1)/a(z^-1), a[0] = 1."""

    b: tuple[float, ...]
    a: tuple[float, ...] = (1.0,)


def velocity(y: Array, h: float, N_d: int = 5) -> Array:
    """Least-squares slope over the last `N_d` positions [m/s], shape of `y`.

    y: position [m], shape (n,), filtered by A; h: sampling period [s]. Before the log the body is
    taken to rest at y[0]. Causal: it lags by (N_d - 1)/2 samples. Source: paper, eq. (5).
    """
    return apply_filter(slope_filter(h, N_d), y)


def slope_filter(h: float, N_d: int = 5) -> Filter:
    """The velocity (5) as a filter: least-squares slope over the last `N_d` positions, h [s].

    Raises BadSpecification where N_d < 2 or h is not positive. Source: paper, eq. (5).
    """
    if N_d < 2 or h <= 0:
        raise BadSpecification(f"velocity: N_d = {N_d}, h = {h:g} s; need N_d >= 2, h > 0")
    j = np.arange(N_d) - 0.5 * (N_d - 1)
    return Filter(tuple(float(w) for w in j[::-1] / (h * np.sum(j**2))))


RIG_A = Filter((0.5,), (1.0, -0.5))
"""The rig's filter A, 0.5/(1 - 0.5 z^-1)."""

RIG_C = Filter((0.2,), (1.0, -0.8))
"""The rig's filter C, 0.2/(1 - 0.8 z^-1)."""


def fir_lowpass(cutoff: float, h: float, order: int = 40) -> Filter:
    """Windowed FIR low-pass of `order`, `cutoff` [Hz] (6 dB), sampling period `h` [s].

    Simulation A, B, C: 5 Hz; rig B: 10 Hz; order 40. Raises BadSpecification where the cut-off is
    not below half the sampling rate.
    """
    from scipy.signal import firwin

    if not 0 < cutoff < 0.5 / h:
        raise BadSpecification(f"cut-off {cutoff:g} Hz, must lie between 0 and {0.5 / h:g} Hz")
    return Filter(tuple(float(b) for b in firwin(order + 1, cutoff, fs=1.0 / h)))


def apply_filter(filt: Filter, x: Array) -> Array:
    """`x` through the filter, causal, at the steady state of x[0] at the start; shape of `x`."""
    from scipy.signal import lfilter, lfilter_zi

    x = np.asarray(x, dtype=np.float64)
    if len(filt.b) == 1 and len(filt.a) == 1:
        return filt.b[0] * x
    out, _ = lfilter(filt.b, filt.a, x, zi=lfilter_zi(filt.b, filt.a) * x[0])
    return np.asarray(out, dtype=np.float64)
