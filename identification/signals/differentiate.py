"""Velocity and acceleration from a measured position, with zero phase.

Two ways, the same in use: `butterworth` (low-pass run forward and backward, then central
differences: what the authors of the EMPS benchmark do) and `local_polynomial` (moving least
squares). Where no cut-off is given it is read from the log: twice the frequency at which the
position sinks into its own noise, so that what is signal passes undamped.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy import signal

from identification.arrays import Array
from identification.errors import BadLog

Method = Literal["butterworth", "local"]
MIN_SAMPLES = 64
ORDER = 4
LOCAL_DEGREE = 5
CUTOFF_MARGIN = 2.0
MOST_CUTOFF = 0.4  # of the sampling
# Share of the samples at which it stands, and levels at which it does
RESTED, LEVELS_AT_REST = 0.05, 8
MOST_STEPS = 1e8  # in the range of a position that is counted
SAME_LEVEL = 100.0  # units in the last place of a usual value: rounding makes no other level
WHOLE_STEP = 0.01  # of a step, that a counted position is off a multiple
# The same of one that is printed with few digits, and levels that tell it from any other
WHOLE_STEP_ROUNDED, MANY_LEVELS = 0.1, 20
# Periods of the cut-off after which the filter's start has died out (to 1e-8).
FILTER_RESPONSE = 8.0


@dataclass(frozen=True)
class Motion:
    """Smoothed position [m], velocity [m/s] and acceleration [m/s^2], each of shape (n,).

    `cutoff` [Hz] is the smoothing's, `noise` [m] the measured position's standard deviation,
    `v_noise` [m/s] what the smoothing lets through of it into `v`. `edge` is the number of samples
    at either end to leave out of a fit: there the Butterworth draws `a` to 0, and the local
    polynomial, which is unbiased, carries several times the noise.
    """

    y: Array
    v: Array
    a: Array
    cutoff: float
    noise: float
    v_noise: float
    edge: int


@dataclass(frozen=True)
class Spectrum:
    """What a position's spectrum says: `noise` [m] (one sigma), `cutoff` [Hz] to smooth at.

    `cutoff` is twice the frequency where signal and noise are equal, at most `MOST_CUTOFF`; below
    it the noise is as that of a white one of deviation `slow` [m].
    """

    noise: float
    cutoff: float
    slow: float


def spectrum(y: Array, h: float) -> Spectrum:
    """Noise level of a position and the cut-off for its smoothing.

    y: position [m], shape (n,); h: period [s]. The third difference whitens the spectrum of a
    motion (its acceleration jumps at a reversal); white noise then has the known shape
    (2 sin(w/2))^6, fitted to the upper half of the band. An encoder's counts that come every T
    samples are noise sampled so seldom: all of it lies in a T-th of the band, in which it is T
    times as dense (Bennett, Bell Syst. Tech. J. 27 (1948) 446). Raises BadLog below 64 samples.
    """
    n = _checked(y)
    size = min(2048, 1 << int(np.log2(n // 4)))
    d3 = np.diff(np.asarray(y, dtype=np.float64), 3)
    f, power = signal.welch(d3, fs=1.0, window="hann", nperseg=size, detrend=False)
    f, power = f[1:-1], power[1:-1]
    shape = (2 * np.sin(np.pi * f)) ** 6
    ratio = power / shape
    # A one-sided density of white noise is 2 sigma^2 at fs = 1; the median of a chi-square is low.
    degrees = 2.0 * max(1.0, 1.6 * (n / size))
    low = 1.0 - 2.0 / (9.0 * degrees)
    floor = float(np.median(ratio[f > 0.25])) / low**3
    # At rest a counted position shows no noise at all, and yet is off by a part of its step.
    of_count = 2.0 * resolution(y) ** 2 / 12.0
    floor, slow = max(floor, of_count), max(floor, of_count * _between_counts(y))
    above = np.flatnonzero(_smooth(ratio) > 2.0 * slow)
    cut = min(CUTOFF_MARGIN * float(f[above[-1] if len(above) else 0]), MOST_CUTOFF)
    return Spectrum(float(np.sqrt(floor / 2.0)), cut / h, float(np.sqrt(slow / 2.0)))


def _between_counts(y: Array) -> float:
    """Samples from one change of a position to the next: the median, which rests do not move."""
    changes = np.flatnonzero(np.diff(y))
    return float(np.median(np.diff(changes))) if len(changes) > 1 else 1.0


def is_long_enough(y: Array) -> bool:
    """Whether a position has the samples that its noise needs."""
    return len(y) >= MIN_SAMPLES


def resolution(x: Array) -> float:
    """Step of a signal that takes whole multiples of one only (an encoder's), else 0.

    Put on another clock it has values in between, but stands at its own wherever it rested.
    """
    x = np.asarray(x, dtype=np.float64)
    step = _step_of(np.unique(x))
    stood = x[1:][np.diff(x) == 0.0]
    if step > 0.0 or len(stood) < RESTED * len(x):
        return step
    levels = np.unique(stood)
    return _step_of(levels) if len(levels) >= LEVELS_AT_REST else 0.0


def _step_of(levels: Array) -> float:
    """Step whose whole multiples the levels (k,) are apart, 0 where there is none.

    Printed or stored with fewer digits they are off by a part of it: the smallest distance gives
    the step roughly, larger ones ever better. Levels of no step would be off by anything: that
    very many of them are within a tenth is no chance.
    """
    if len(levels) < 2:
        return 0.0
    same = SAME_LEVEL * np.spacing(np.median(np.abs(levels)))
    apart = np.diff(levels)
    apart = np.sort(apart[apart > same])
    span, step = float(levels[-1] - levels[0]), float(apart[0]) if len(apart) else 0.0
    if step == 0.0 or span / step > MOST_STEPS:
        return 0.0
    reach = 1.5 * step
    while True:
        near = apart[: np.searchsorted(apart, reach, side="right")]
        step = float(np.sum(near) / np.sum(np.round(near / step)))
        if len(near) == len(apart):
            break
        reach *= 2.0
    step = span / round(span / step)
    off = (levels - levels[0]) / step
    off -= np.round(off)
    most = float(np.max(np.abs(off - np.median(off))))
    rounded = len(apart) >= MANY_LEVELS and most < WHOLE_STEP_ROUNDED
    return step if most < WHOLE_STEP or rounded else 0.0


def differentiate(
    y: Array, h: float, cutoff: float | None = None, method: Method = "butterworth"
) -> Motion:
    """Smoothed position, velocity and acceleration on the samples of `y`.

    y: position [m], shape (n,); h: period [s]; cutoff: where the smoothing halves the amplitude
    (butterworth) or nearly so (local) [Hz], from `spectrum` where None. Raises BadLog where `y`
    is too short, or the cut-off lies outside (0, 1/(2h)).
    """
    n = _checked(y)
    found = spectrum(y, h)
    cut = found.cutoff if cutoff is None else cutoff
    if not 0 < cut < 0.5 / h:
        raise BadLog(f"cut-off {cut:g} Hz at {1 / h:g} samples/s: must lie in (0, {0.5 / h:g}) Hz")
    cut = max(cut, 8.0 / (n * h))
    y = np.asarray(y, dtype=np.float64)
    edge = min(int(np.ceil(0.5 / (cut * h))), n // 8)
    if method == "butterworth":
        smooth = low_pass(y, h, cut)
        v = np.gradient(smooth, h, edge_order=2)
        a = np.gradient(v, h, edge_order=2)
    else:
        smooth, v, a = (_local(y, h, cut, order) for order in (0, 1, 2))
    v_noise = found.slow * _velocity_gain(h, cut, method)
    return Motion(smooth, v, a, cut, found.noise, v_noise, edge)


def low_pass(x: Array, h: float, cutoff: float, order: int = ORDER) -> Array:
    """`x` through a Butterworth low-pass run forward and backward: zero phase, shape of `x`.

    The signal is continued at both ends by its odd reflection until the filter's start has died
    out, so that a ramp stays a ramp to its last sample.
    """
    if cutoff * h >= 0.5:
        return np.array(x, dtype=np.float64)
    sections = signal.butter(order, cutoff, fs=1.0 / h, output="sos")
    pad = min(np.shape(x)[-1] - 1, int(np.ceil(FILTER_RESPONSE / (cutoff * h))))
    return np.asarray(signal.sosfiltfilt(sections, x, padlen=pad), dtype=np.float64)


def parallel_filter(x: Array, factor: int) -> Array:
    """The low-pass that would come before taking one sample in `factor`; every sample is kept.

    Put over every column of a regression and over its force alike, it does not bias the fit.
    x: shape (n,) or (n, k), filtered along the first axis. 8th-order Chebyshev, 0.05 dB, zero
    phase: the filter the EMPS authors decimate with.
    """
    if factor <= 1:
        return np.array(x, dtype=np.float64)
    sections = signal.cheby1(8, 0.05, 0.8 / factor, output="sos")
    pad = min(len(x) - 1, 12 * factor)
    return np.asarray(signal.sosfiltfilt(sections, x, axis=0, padlen=pad), dtype=np.float64)


def _checked(y: Array) -> int:
    n = len(y)
    if n < MIN_SAMPLES:
        raise BadLog(f"{n} samples of position, at least {MIN_SAMPLES} needed; log a longer run")
    return n


def _smooth(ratio: Array) -> Array:
    """Running geometric mean over a twelfth of each frequency: single bins are chance."""
    logs = np.concatenate([[0.0], np.cumsum(np.log(np.maximum(ratio, 1e-300)))])
    i = np.arange(len(ratio))
    half = np.maximum(2, i // 12)
    lo, hi = np.maximum(0, i - half), np.minimum(len(ratio), i + half + 1)
    return np.asarray(np.exp((logs[hi] - logs[lo]) / (hi - lo)), dtype=np.float64)


def _window(h: float, cutoff: float) -> int:
    """Odd window of the local polynomial of that cut-off (Schafer, IEEE SPM 2011, eq. (12))."""
    half = ((LOCAL_DEGREE + 1) / (2.0 * cutoff * h) + 4.6) / 3.2
    return 2 * max(round(half), LOCAL_DEGREE // 2 + 1) + 1


def _local(y: Array, h: float, cutoff: float, order: int) -> Array:
    window = _window(h, cutoff)
    if window > len(y):
        raise BadLog(f"cut-off {cutoff:g} Hz needs {window} samples, {len(y)} found; raise it")
    out = signal.savgol_filter(y, window, LOCAL_DEGREE, deriv=order, delta=h, mode="interp")
    return np.asarray(out, dtype=np.float64)


def _velocity_gain(h: float, cutoff: float, method: Method) -> float:
    """Standard deviation of the velocity [1/s] for white position noise of unit deviation."""
    size = int(np.ceil(8.0 / (cutoff * h)))
    if method == "butterworth":
        impulse = np.zeros(2 * size + 1)
        impulse[size] = 1.0
        response = np.gradient(low_pass(impulse, h, cutoff), h)
    else:
        window = _window(h, cutoff)
        response = signal.savgol_coeffs(window, LOCAL_DEGREE, deriv=1, delta=h)
    return float(np.sqrt(np.sum(response**2)))
