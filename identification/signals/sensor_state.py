"""What a log's clock and sensors are like, as they are recorded."""

from dataclasses import dataclass

import numpy as np

from identification.arrays import Array
from identification.signals.differentiate import resolution
from identification.signals.even_clock import LONGEST_GAP, rows_lost
from identification.signals.noise import local_noise
from identification.signals.offsets import ROUNDED_OFF


@dataclass(frozen=True)
class Clock:
    """Rows, duration and period [s], jitter (of a period, rms, gaps apart), gaps and the longest
    [s]; lost: rows that an even clock has lost."""

    rows: int
    duration: float
    h: float
    jitter: float
    gaps: int
    longest_gap: float
    lost: int


@dataclass(frozen=True)
class SensorState:
    """A signal in SI: range, white noise (one sigma) and step, 0 where it has none."""

    name: str
    low: float
    high: float
    noise: float
    step: float


def clock_of(t: Array) -> Clock:
    """The clock of times t [s], (n,), as they are recorded."""
    step = np.diff(t)
    step = step[np.isfinite(step)]
    h = float(np.median(step)) if len(step) else 0.0
    usual = step[(step > 0.0) & (step < LONGEST_GAP * h)]
    jitter = float(np.std(usual)) / h if h > 0.0 and len(usual) else 0.0
    gaps = step[step > LONGEST_GAP * h] if h > 0.0 else step[:0]
    longest = float(np.max(gaps)) if len(gaps) else 0.0
    return Clock(len(t), float(t[-1] - t[0]), h, jitter, len(gaps), longest, rows_lost(t, h))


def sensor_state(name: str, x: Array) -> SensorState:
    """The state of a signal x (n,) in SI; zeros where hardly a sample is a number."""
    good = x[np.isfinite(x)]
    if len(good) < 4:
        return SensorState(name, 0.0, 0.0, 0.0, 0.0)
    low, high, step = float(good.min()), float(good.max()), resolution(good)
    white = float(np.sqrt(max(local_noise(good) ** 2 - step**2 / 12.0, 0.0)))  # but for rounding
    shown = white if white > ROUNDED_OFF * (high - low) else 0.0
    return SensorState(name, low, high, shown, step)
