"""Runs cut into stretches that overlap by half, windowed, and their Fourier coefficients (Welch).

A stretch is as long as so many cycles of the frequency need, so that the resolution is much the
same share of every frequency: long stretches at low frequencies, which leave few averages, ever
shorter ones, of which there are more, above. Source: Welch, IEEE Trans. Audio Electroacoustics 15
(1967) 70; stretches by frequency, Troebs, Heinzel, Measurement 39 (2006) 120.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import CZT
from scipy.signal.windows import hann

from identification.arrays import Array
from identification.errors import BadSpecification, NotIdentifiable
from identification.thresholds import EVENTS_NEEDED

ComplexArray = NDArray[np.complex128]

REACHES = (4, 8, 16)  # neighbouring frequencies to either side by which one is estimated
LOWEST_BIN = 2  # of a stretch that is read: the first has what is left of its mean
CYCLES_IN_STRETCH = 320.0  # of a frequency in its stretch, at least, where the logs are long enough
LEAST_CYCLES_SEEN = float(LOWEST_BIN + REACHES[0])  # of a frequency in its stretch
STRETCHES_LONG = 8.0  # the longest stretch in all logs, so often
LONGEST_STRETCH = 20.0  # s
FEWEST_IN_STRETCH = 64  # in a stretch
HIGHEST_SHARE_SEEN = 0.4  # of the sampling rate
STRETCH_OVERLAP = 0.5
# Share of the stretches that count as independent: neighbours under Hann's window share 1/6.
INDEPENDENT = 1.0 / (1.0 + 2.0 / 36.0)


@dataclass(frozen=True, eq=False)
class Band:
    """Stretches of one length [s] and the frequencies f [Hz], (k,), that are read from them: those
    wanted and the longest reach of neighbours to either side, of which some
    are none."""

    length: float
    f: Array


def bands(durations: Sequence[float], periods: Sequence[float], lowest: float | None) -> list[Band]:
    """The stretches for logs of so many seconds, sampled every so many, longest first.

    lowest [Hz]: that is asked for, which sets the longest; by default an eighth of all logs. Raises
    BadSpecification where the logs are too short for it, NotIdentifiable where they are for any.
    """
    whole, longest_run = sum(durations), max(durations)
    fastest = min(periods)
    most = HIGHEST_SHARE_SEEN / fastest
    length = min(whole / STRETCHES_LONG, longest_run / 2.0, LONGEST_STRETCH)
    if lowest is not None:
        length = LEAST_CYCLES_SEEN / lowest
        there = sum(max(0.0, d / length - 1.0) / (1.0 - STRETCH_OVERLAP) + 1.0 for d in durations
                    if d >= length)  # fmt: skip
        if there < EVENTS_NEEDED:
            raise BadSpecification(
                f"lowest frequency {lowest:g} Hz: stretches of {length:.3g} s needed, {there:.0f}"
                f" in {whole:.3g} s of logs, at least {EVENTS_NEEDED} needed; log longer, or ask"
                f" for at least {LEAST_CYCLES_SEEN * EVENTS_NEEDED / whole:.2g} Hz"
            )
    if length < FEWEST_IN_STRETCH * fastest:
        raise NotIdentifiable(
            f"{whole:.3g} s of logs every {1e3 * fastest:.3g} ms: stretches of"
            f" {FEWEST_IN_STRETCH} samples needed, {STRETCHES_LONG:.0f} of them; log longer"
        )
    out, begin = list[Band](), LEAST_CYCLES_SEEN / length
    while begin < most:
        shortest = 0.5 * length < FEWEST_IN_STRETCH * fastest
        end = most if shortest else min(max(2.0 * CYCLES_IN_STRETCH / length, begin), most)
        k = np.arange(np.ceil(begin * length - 1e-9), np.ceil(end * length - 1e-9))
        if len(k):
            with_neighbours = np.arange(k[0] - REACHES[-1], k[-1] + REACHES[-1] + 1)
            out.append(Band(length, with_neighbours / length))
        begin, length = end, 0.5 * length
    return out


def coefficients(x: Array, h: float, band: Band) -> ComplexArray:
    """Fourier coefficients [unit s] of every stretch of x (n,), sampled every h [s]: (s, k).

    Zero beyond the frequencies that the log can show; no row where it is shorter than a stretch.
    """
    n = max(FEWEST_IN_STRETCH // 2, round(band.length / h))
    out = np.zeros((0, len(band.f)), dtype=np.complex128)
    if len(x) < n or not len(band.f):
        return out
    frames = np.lib.stride_tricks.sliding_window_view(x, n)[
        :: max(1, round((1.0 - STRETCH_OVERLAP) * n))
    ]
    frames = (frames - frames.mean(axis=1, keepdims=True)) * hann(n, sym=False)
    step = band.f[1] - band.f[0] if len(band.f) > 1 else 1.0
    turn = 2j * np.pi * h
    transform = CZT(n, len(band.f), np.exp(-turn * step), np.exp(turn * band.f[0]))
    out = h * np.asarray(transform(frames), dtype=np.complex128)
    out[:, (band.f > HIGHEST_SHARE_SEEN / h) | (band.f * band.length < LOWEST_BIN - 0.5)] = 0.0
    return out


def second_derivative(x: Array, h: float, band: Band) -> ComplexArray:
    """Coefficients (s, k) of the second derivative of x (n,), from its second difference.

    The difference whitens a motion's steep spectrum before the window, whose leakage would bury
    what is fast in it; its own frequency response is divided out, so nothing is approximated.
    """
    return coefficients(np.diff(x, 2) / h**2, h, band) / np.sinc(band.f * h) ** 2


def hold(f: Array, h: float) -> ComplexArray:
    """What holding every sample over its period h [s] does to a signal at f [Hz]."""
    return np.asarray(np.exp(-1j * np.pi * f * h) * np.sinc(f * h), dtype=np.complex128)
