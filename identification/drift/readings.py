"""What one log says of each parameter of a machine, beside its active value."""

from dataclasses import dataclass

from scipy.stats import norm

from identification.drift.drift_result import Shift


@dataclass(frozen=True)
class Moved:
    """A parameter that has changed: its unit, active value and now, p-value of the change."""

    name: str
    unit: str
    before: float
    after: float
    p_value: float


@dataclass(frozen=True)
class Reading:
    """A parameter by one log, with its 95 % interval, beside its active value.

    change: relative to that, with its standard deviation.
    """

    name: str
    unit: str
    before: float
    after: float
    low: float
    high: float
    change: float
    sd: float


def reading_of(shift: Shift) -> Reading:
    """The parameter by the log of a shift."""
    half = float(norm.ppf(0.975)) * shift.after_sd
    low, high = shift.after - half, shift.after + half
    return Reading(
        shift.name, shift.unit, shift.before, shift.after, low, high, shift.change, shift.sd
    )


def moved_by(shift: Shift) -> Moved:
    """The parameter that a shift has moved; p-value of both sides."""
    p_value = float(2.0 * norm.sf(abs(shift.change) / shift.sd)) if shift.sd > 0 else 0.0
    return Moved(shift.name, shift.unit, shift.before, shift.after, p_value)
