"""A notch or a low-pass in series with a controller, as drives have them, against a resonance."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy.signal import bilinear

from identification.arrays import Array
from identification.errors import BadSpecification
from identification.signals.filters import Filter

FilterKind = Literal["notch", "low-pass"]
NOTCH_WIDTHS = (0.3, 0.7, 1.2)  # dampings of a notch's poles tried: half its width over its f
DEEPEST_NOTCH = 0.05  # gain: a resonance that is known to 2 % leaves no more of a deeper one
NOTCH_PLACES = (1.0, 0.9, 1.1)  # of a notch, in units of the resonance
CUTS = (1.5, 1.0, 0.7, 0.5)  # of a low-pass, in units of the resonance
LOW_PASS_DAMPING = 0.7
HIGHEST_FILTER = 0.4  # of the sampling rate


@dataclass(frozen=True)
class SeriesFilter:
    """(s^2 + 2 z_n w s + w^2)/(s^2 + 2 z_d w s + w^2), the notch, or w^2 over the same, at
    w = 2 pi frequency, sampled every h [s] by the bilinear rule that keeps this frequency.

    numerator: z_n, 0 for a low-pass; denominator: z_d. Raises BadSpecification where the frequency
    [Hz] is not well below half the sampling rate, or z_d not positive.
    """

    kind: FilterKind
    frequency: float
    numerator: float
    denominator: float
    h: float

    def __post_init__(self) -> None:
        if not 0 < self.frequency <= HIGHEST_FILTER / self.h:
            raise BadSpecification(
                f"{self.kind} at {self.frequency:g} Hz: need more than 0 and at most"
                f" {HIGHEST_FILTER / self.h:g} Hz at a period of {1e3 * self.h:g} ms"
            )
        if not (self.denominator > 0 and self.numerator >= 0):
            raise BadSpecification(
                f"{self.kind}: dampings {self.numerator:g} and {self.denominator:g}; need the"
                " second > 0, the first >= 0"
            )

    @property
    def filter(self) -> Filter:
        """As a filter b/a in z^-1."""
        w = 2.0 / self.h * math.tan(math.pi * self.frequency * self.h)
        above = [w * w] if self.kind == "low-pass" else [1.0, 2.0 * self.numerator * w, w * w]
        sampled: Any = bilinear(above, [1.0, 2.0 * self.denominator * w, w * w], fs=1.0 / self.h)
        b, a = (np.asarray(c, dtype=np.float64) for c in sampled)
        return Filter(tuple((b / a[0]).tolist()), tuple((a / a[0]).tolist()))

    @property
    def depth_db(self) -> float | None:
        """Gain of a notch at its frequency [dB]; None for a low-pass."""
        if self.kind == "low-pass":
            return None
        return 20.0 * math.log10(max(self.numerator, 1e-6) / self.denominator)

    @property
    def width(self) -> float:
        """Of a notch at -3 dB [Hz]; of a low-pass its frequency."""
        return 2.0 * self.denominator * self.frequency if self.kind == "notch" else self.frequency

    def response(self, f: Array) -> Any:
        """At f [Hz], (k,) complex."""
        z = np.exp(-2j * np.pi * f * self.h)
        one = self.filter
        return np.polyval(one.b[::-1], z) / np.polyval(one.a[::-1], z)


def filters_against(resonance: float, damping: float, h: float) -> Iterator[SeriesFilter]:
    """Notches and low-passes to try against a resonance [Hz] of this damping, every h [s]."""
    most = HIGHEST_FILTER / h
    for width in NOTCH_WIDTHS:
        for place in NOTCH_PLACES:
            if place * resonance <= most:
                least = max(DEEPEST_NOTCH * width, damping)
                yield SeriesFilter("notch", place * resonance, least, width, h)
    for cut in CUTS:
        if cut * resonance <= most:
            yield SeriesFilter("low-pass", cut * resonance, 0.0, LOW_PASS_DAMPING, h)
