"""Numbers as an engineer reads them: no exponents, lengths in mm, digits that say something."""

import math
from collections.abc import Iterable
from typing import NamedTuple

from identification.model.estimates import Estimate
from workbench.cards.parameter_units import scaled, shown

SHOWN_DIGITS = 6
SHOWN_UNITS = {"m": ("mm", 1e3), "m/s": ("mm/s", 1e3), "N/Pa": ("N/bar", 1e5)}
MICROMETRES_BELOW = 0.1  # mm


class Unit(NamedTuple):
    """A unit in which something is shown, and what SI is multiplied by."""

    name: str
    factor: float


class Units(NamedTuple):
    """Units of what charts show."""

    position: Unit
    velocity: Unit
    force: Unit


def shown_unit(unit: str) -> Unit:
    """The unit in which a value in an SI unit is shown."""
    return Unit(*SHOWN_UNITS.get(unit, (unit, 1.0)))


def units_of(rotary: bool) -> Units:
    """Millimetres and newtons, or radians and newton metres."""
    plain = shown(rotary)
    return Units(*map(shown_unit, plain[:3]))


def number(value: float, digits: int = 3) -> str:
    """A number with so many digits, written out: 0.00012, 5540."""
    if not math.isfinite(value) or value == 0:
        return f"{value:g}"
    after = digits - 1 - math.floor(math.log10(abs(value)))
    said = f"{round(value, after):.{max(after, 0)}f}"
    return said.rstrip("0").rstrip(".") if "." in said else said


def small(value: float, least: float = 1e-4) -> str:
    """A number in a column of one unit, of which a reader needs no less than `least`."""
    return f"< {least:.4f}" if 0 < abs(value) < least else number(value)


def length(value: float, rotary: bool = False) -> str:
    """A length [m] in mm, in µm where mm would need zeros; an angle [rad] in rad."""
    if rotary:
        return f"{number(value)} rad"
    mm = 1e3 * value
    if 0 < abs(mm) < MICROMETRES_BELOW:
        return f"{number(1e3 * mm)} µm"
    return f"{number(mm)} mm"


def force(value: float, rotary: bool = False) -> str:
    """A force [N] or torque [N m], with three digits."""
    return f"{number(value)} {shown(rotary).force}"


def times(value: float) -> str:
    """How many times: "1.4 times", "5500 times"."""
    return f"{number(value, 2)} times"


def as_shown(estimate: Estimate) -> Estimate:
    """The estimate in the unit in which tables show it; one without a value as it is, since its
    reason speaks of SI."""
    unit, factor = shown_unit(estimate.unit)
    if estimate.value is None or factor == 1.0:
        return estimate
    return scaled(estimate, unit, factor)


def in_digits(values: Iterable[float], size: float, sd: float | None) -> list[str]:
    """Numbers with as many digits as their standard deviation leaves meaning to."""
    digits = 4
    if sd and size and math.isfinite(sd):
        digits = max(2, math.ceil(math.log10(abs(size) / sd)) + 1)
    place = math.floor(math.log10(abs(size))) if size and math.isfinite(size) else 0
    after = max(min(digits, SHOWN_DIGITS) - 1 - place, 0)
    return [f"{value:.{after}f}" for value in values]
