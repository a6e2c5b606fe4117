"""A loop in a drive engineer's words: crossover, and up to where it rejects and follows."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from design.margins import sensitivities
from design.polynomial import evaluate
from design.rst import RST
from design.specification import normalised_plant
from identification.arrays import Array

POINTS_EVALUATED = 4000  # of the frequencies looked at
LOWEST_SHARE = 1e-5  # of half the sampling rate, from which on
HALF_POWER = 1.0 / np.sqrt(2.0)  # -3 dB


@dataclass(frozen=True)
class LoopFrequencies:
    """crossover: the highest frequency at which |L| falls through 1; rejection: up to which |S_yp|
    stays below -3 dB; bandwidth: at which the position first falls 3 dB below a slow reference, the
    reference's filter and feed-forward of speed included [Hz]; None: nowhere below half the rate.
    """

    crossover: float | None
    bandwidth: float | None
    rejection: float | None


def loop_frequencies(A: ArrayLike, B: ArrayLike, controller: RST) -> LoopFrequencies:
    """Crossover, bandwidth and rejection of the plant (A, B), ascending in z^-1, under a law."""
    f = 0.5 / controller.h * np.geomspace(LOWEST_SHARE, 1.0, POINTS_EVALUATED)
    curves = sensitivities(A, B, controller, 2.0 * np.pi * f)
    closed = np.abs(curves.S_yr)
    through = _falls(f, np.abs(open_loop_response(A, B, controller, f)), 1.0)
    below = _falls(f, closed, HALF_POWER * float(closed[0]))
    rejected = _falls(f, 1.0 / np.maximum(np.abs(curves.S_yp), 1e-300), 1.0 / HALF_POWER)
    return LoopFrequencies(
        float(through[-1]) if len(through) else None,
        *(float(at[0]) if len(at) else None for at in (below, rejected)),
    )


def open_loop_response(
    A: ArrayLike, B: ArrayLike, controller: RST, f: Array
) -> NDArray[np.complex128]:
    """L = B R/(A S) at f [Hz], (k,)."""
    A, B = normalised_plant(A, B)
    z = np.exp(2j * np.pi * f * controller.h)
    forward = evaluate(B, z) * evaluate(controller.R, z)
    back = evaluate(A, z) * evaluate(controller.S, z)
    return np.asarray(forward / back, dtype=np.complex128)


def _falls(f: Array, size: Array, level: float) -> Array:
    """Frequencies at which a curve falls through a level, over logarithms of both."""
    logs = np.log(np.maximum(size, 1e-300)) - np.log(level)
    at = np.flatnonzero((logs[:-1] > 0.0) & (logs[1:] <= 0.0))
    share = logs[at] / (logs[at] - logs[at + 1])
    return np.asarray(np.exp(np.log(f[at]) + share * (np.log(f[at + 1]) - np.log(f[at]))))
