"""Pieces that a reference is put together from; each begins and ends at rest at home.

So they may stand in any order, and their information adds up. Each shape carries something of its
own: steps break the body away and stop it, slow triangles do so again and again at the stick limit,
fast strokes identify mass and viscous friction, sines and sweeps all of it in between.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from design.experiment.limits import MotionLimits
from identification.arrays import Array
from identification.signals.excitation import Multisine, reference_signal

Kind = Literal["steps", "strokes", "creep", "sine", "sweep", "stairs", "multisine"]
SEGMENT_DWELL = 0.4  # s of rest after a segment
STROKE_REST = 0.25  # s at a stroke's end
STEP_HOLDS = (0.5, 1.2, 2.5)  # s at a level: in the longer ones an integrator begins to hunt
SINE_FADE = 0.3  # s in which a sine comes and goes
SWEEP_RATIO = 4.0  # ratio of a sweep's last frequency to its first
STAIR_STEPS = 4  # steps up, and as many down
LONGEST_SEGMENT = 8.0  # s of a segment, at most
RATE_COUNT = 6  # speeds tried, evenly spaced on a logarithmic scale
SLOWEST_RATE = 0.01  # of the speed limit
# Of the reach, levels of steps and strokes; of triangles; of sines.
STEP_LEVELS = (-0.9, -0.6, -0.3, 0.3, 0.6, 0.9)
CREEP_SHARES = (0.02, 0.05, 0.12, 0.3)
SINE_SHARES = (0.1, 0.2, 0.4, 0.85)
SEGMENT_FREQUENCIES = (0.3, 0.6, 1.2, 2.4, 4.0)
SEGMENT_CYCLES = 3
SINE_LINES, SINES_SECONDS, LOWEST_LINE = (
    12,
    5.0,
    0.2,
)  # of a multisine: lines, length [s], first [Hz]


@dataclass(frozen=True)
class Segment:
    """A piece of a reference: amplitude [m] (of either sign) about home, and rate: the speed [m/s]
    of strokes and triangles, the frequency [Hz] of sines and sweeps, 1/hold [1/s] of steps."""

    kind: Kind
    amplitude: float
    rate: float

    def signal(self, h: float) -> Array:
        """Deviation from home [m], (n,), sampled every h [s]; it ends with a rest."""
        made = _SHAPES[self.kind](self.amplitude, self.rate, h)
        return np.concatenate([made, np.zeros(round(SEGMENT_DWELL / h))])

    def seconds(self, h: float) -> float:
        """How long it lasts."""
        return h * len(self.signal(h))

    def changed(self, amplitude: float, rate: float) -> "Segment":
        """With amplitude and rate times these factors."""
        return replace(self, amplitude=amplitude * self.amplitude, rate=rate * self.rate)


def _line(knots: Array, speed: float, h: float) -> Array:
    """Through the knots [m] at a constant speed [m/s]."""
    way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(knots)))])
    t = np.arange(0.0, way[-1] / speed, h)
    return np.asarray(np.interp(speed * t, way, knots))


def _steps(amplitude: float, rate: float, h: float) -> Array:
    samples = max(1, round(1.0 / rate / h))
    return np.concatenate([np.full(samples, amplitude), np.zeros(samples)])


def _strokes(amplitude: float, rate: float, h: float) -> Array:
    rest = np.zeros(round(STROKE_REST / h))
    out = _line(np.array([0.0, amplitude]), rate, h)
    back = _line(np.array([amplitude, 0.0]), rate, h)
    return np.concatenate([out, rest + amplitude, back])


def _creep(amplitude: float, rate: float, h: float) -> Array:
    return _line(amplitude * np.array([0.0, 1.0, -1.0, 1.0, -1.0, 0.0]), rate, h)


def _faded(x: Array, h: float) -> Array:
    n = len(x)
    t = h * np.arange(n)
    fade = np.clip(np.minimum(t, t[-1] - t) / SINE_FADE, 0.0, 1.0)
    return np.asarray(x * fade**2 * (3.0 - 2.0 * fade))


def _sine(amplitude: float, rate: float, h: float) -> Array:
    t = np.arange(0.0, SEGMENT_CYCLES / rate, h)
    return _faded(amplitude * np.sin(2.0 * np.pi * rate * t), h)


def _sweep(amplitude: float, rate: float, h: float) -> Array:
    """From rate to SWEEP_RATIO times it, the amplitude falling so that the speed is even."""
    seconds = 2.0 * SEGMENT_CYCLES / rate / np.sqrt(SWEEP_RATIO)
    t = np.arange(0.0, seconds, h)
    growth = np.log(SWEEP_RATIO) / seconds
    phase = 2.0 * np.pi * rate * np.expm1(growth * t) / growth
    return _faded(amplitude * np.exp(-growth * t) * np.sin(phase), h)


def _stairs(amplitude: float, rate: float, h: float) -> Array:
    levels = (
        np.concatenate([np.arange(1, STAIR_STEPS + 1), np.arange(STAIR_STEPS - 1, -1, -1)])
        / STAIR_STEPS
    )
    return np.repeat(amplitude * levels, max(1, round(1.0 / rate / h)))


def _multisine(amplitude: float, rate: float, h: float) -> Array:
    """Sines up to the frequency `rate` [Hz], the largest deviation being the amplitude."""
    t = np.arange(0.0, SINES_SECONDS, h)
    x = reference_signal(Multisine(1.0, LOWEST_LINE, rate, SINE_LINES), t, np.random.default_rng(0))
    return _faded(amplitude * x / float(np.max(np.abs(x))), h)


_SHAPES = {
    "steps": _steps,
    "strokes": _strokes,
    "creep": _creep,
    "sine": _sine,
    "sweep": _sweep,
    "stairs": _stairs,
    "multisine": _multisine,
}


def library(limits: MotionLimits) -> Iterator[Segment]:
    """Segments over what the limits allow, by the speeds of the references alone."""
    reach, fastest = limits.reach, limits.speed
    rates = fastest * np.geomspace(SLOWEST_RATE, 0.9, RATE_COUNT)
    for level in STEP_LEVELS:
        for hold in STEP_HOLDS:
            yield Segment("steps", level * reach, 1.0 / hold)
        for rate in rates[1:]:
            yield Segment("strokes", level * reach, float(rate))
        for hold in (0.25, 0.6):
            yield Segment("stairs", level * reach, 1.0 / hold)
    for share in CREEP_SHARES:
        for rate in rates[:-1]:
            for sign in (1.0, -1.0):
                yield Segment("creep", sign * share * reach, float(rate))
    for share in SINE_SHARES:
        for f in SEGMENT_FREQUENCIES:
            size = min(share * reach, 0.9 * fastest / (2.0 * np.pi * f))
            yield Segment("sine", float(size), f)
            yield Segment("sweep", float(size), f)
        for f in SEGMENT_FREQUENCIES[2:]:
            yield Segment("multisine", share * reach, f)


def allowed(one: Segment, limits: MotionLimits, h: float) -> bool:
    """Whether a segment's reference is within the limits, neither too long nor too fast."""
    if abs(one.amplitude) > limits.reach or one.rate <= 0.0:
        return False
    if one.kind in ("strokes", "creep"):
        if one.rate > limits.speed or 10.0 * abs(one.amplitude) / one.rate > 1e6 * h:
            return False
    elif one.kind in ("sine", "sweep", "multisine") and one.rate * SWEEP_RATIO > 0.1 / h:
        return False
    return one.seconds(h) <= min(LONGEST_SEGMENT, limits.seconds)


def reference(parts: tuple[Segment, ...], limits: MotionLimits, h: float) -> Array:
    """r [m], (n,): a rest at home, then the segments; filled up with rest to the limit's time."""
    n = round(limits.seconds / h)
    pieces = [np.zeros(round(SEGMENT_DWELL / h)), *(one.signal(h) for one in parts)]
    r = np.concatenate(pieces)[:n]
    return limits.home + np.pad(r, (0, n - len(r)))
