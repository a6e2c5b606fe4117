"""Margins of an open loop that is known at frequencies alone, as logs show it."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from identification.arrays import Array, BoolArray

FLIPPED_DEG = 180.0
CLOSE_TO_MINUS_ONE = 0.35  # distance of L to it, that no loop keeps over an octave
MOST_OF_AN_OCTAVE = 0.8  # of the points in it


@dataclass(frozen=True)
class MeasuredMargins:
    """What the points of an open loop L(jw) show of it; None: not within them.

    crossover: the highest frequency [Hz] at which |L| falls through 1; phase_deg, delay_s: margins
    there (of several crossings the least); gain_db: the least margin of a gain that grows, where
    the phase passes -180 degrees, at gain_at [Hz]; modulus: the least distance of L to -1.
    """

    crossover: float | None
    phase_deg: float | None
    delay_s: float | None
    gain_db: float | None
    gain_at: float | None
    modulus: float | None


def measured_margins(f: Array, L: NDArray[np.complex128], seen: BoolArray) -> MeasuredMargins:
    """The margins by the points (k,) that are seen, straight lines over log f between neighbours.

    A crossing counts where both of its neighbours are seen, next to each other.
    """
    size = np.where(seen, 20.0 * np.log10(np.maximum(np.abs(L), 1e-300)), np.nan)
    phase = np.full(len(f), np.nan)
    phase[seen] = np.degrees(np.unwrap(np.angle(L[seen])))
    through = _crossings(f, size)
    margins = [(FLIPPED_DEG + _wrapped(_at(f, phase, one)), one) for one in through]
    known = [(margin, one) for margin, one in margins if np.isfinite(margin)]
    least = min(known, key=lambda one: abs(one[0]), default=None)
    delay = min((m / 360.0 / one for m, one in known if m > 0.0), default=None)
    turns = [
        one for k in np.unique(np.round((phase[seen] + FLIPPED_DEG) / 360.0))
        for one in _crossings(f, phase + FLIPPED_DEG - 360.0 * k)
    ]  # fmt: skip
    gains = [(-_at(f, size, one), one) for one in turns]
    growing = min(((g, one) for g, one in gains if g > 0.0), default=None)
    return MeasuredMargins(
        crossover=max((one for _, one in known), default=None),
        phase_deg=None if least is None else float(least[0]),
        delay_s=delay,
        gain_db=None if growing is None else float(growing[0]),
        gain_at=None if growing is None else float(growing[1]),
        modulus=float(np.min(np.abs(1.0 + L[seen]))) if np.any(seen) else None,
    )


def is_minus_one(f: Array, L: NDArray[np.complex128], seen: BoolArray) -> BoolArray:
    """The points (k,) of an octave over which an open loop stays close to -1, and what lies between
    two of them less than an octave apart, which follows the reference there by chance.

    There the response from force to position is the controller's inverse: what goes round the loop
    is noise, or a force at its limit, and no answer to the reference. Source: direct and indirect
    estimates of a closed loop's spectra, Ljung, System Identification (1999), section 13.4.
    """
    near = seen & (np.abs(1.0 + L) < CLOSE_TO_MINUS_ONE)
    low, high = (np.searchsorted(f, f * 2.0**half) for half in (-0.5, 0.5))
    counts = [np.concatenate([[0], np.cumsum(one)]) for one in (near, seen)]
    close, every = (one[high] - one[low] for one in counts)
    at = np.flatnonzero(near & (close >= MOST_OF_AN_OCTAVE * np.maximum(every, 1)))
    found = np.zeros(len(f), dtype=np.bool_)
    found[at] = True
    for a, b in pairwise(at):
        found[a:b] |= f[b] < 2.0 * f[a]
    return found


def _crossings(f: Array, y: Array) -> list[float]:
    """Where a curve with gaps (NaN) passes 0, over log f."""
    a, b = y[:-1], y[1:]
    with np.errstate(invalid="ignore"):
        at = np.flatnonzero((np.sign(a) != np.sign(b)) & np.isfinite(a) & np.isfinite(b))
    share = a[at] / (a[at] - b[at])
    logs = np.log(f)
    return [float(x) for x in np.exp(logs[at] + share * (logs[at + 1] - logs[at]))]


def _at(f: Array, y: Array, where: float) -> float:
    """The curve's value between its two neighbours."""
    k = int(np.clip(np.searchsorted(f, where) - 1, 0, len(f) - 2))
    share = np.log(where / f[k]) / np.log(f[k + 1] / f[k])
    return float(y[k] + share * (y[k + 1] - y[k]))


def _wrapped(degrees: float) -> float:
    """The angle within (-360, 0], so that a margin counts from -180."""
    return -float(np.mod(-degrees, 360.0))
