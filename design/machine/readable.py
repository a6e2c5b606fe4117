"""Units in which a machine's numbers are kept, estimates in other units brought to them, and
numbers as an engineer reads them: no exponents, lengths in mm, digits that say something."""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Self

from identification.errors import BadCard, BadModel
from identification.log import Motion, Rig
from identification.model.estimates import Estimate
from identification.model.karnopp import ROTARY_UNITS, UNITS
from identification.model.plant import over

# Of two units: by what a number in the first is multiplied, and what is added to it, to have it in
# the other; None where they are unlike. It raises BadCard where it does not know one.
Conversion = Callable[[str, str], tuple[float, float] | None]


def no_conversion(unit: str, _target: str) -> None:
    """Of who converts no units: raises BadCard."""
    raise BadCard(f"unit {unit!r} is another one, and no conversion of units is given")


def in_unit(estimate: Estimate, unit: str, where: str, conversion: Conversion) -> Estimate:
    """The estimate in `unit`; raises BadModel, naming `where`, if its own is of another kind."""
    if estimate.unit == unit:
        return estimate
    try:
        found = conversion(estimate.unit, unit)
    except BadCard as error:
        raise BadModel(f"{where} {error}; {unit!r} needed") from None
    if found is None:
        raise BadModel(
            f"{where} unit {estimate.unit!r} is of another kind than {unit!r}; write the value in"
            f" {unit!r}, or run 'workbench identify' again"
        )
    return scaled(estimate, unit, *found)


def scaled(estimate: Estimate, unit: str, factor: float, shift: float = 0.0) -> Estimate:
    """The estimate in `unit`: factor times its numbers, and `shift` for those that are no width."""
    shifts = dict.fromkeys(("value", "low", "high", "assumed"), shift)
    shifts |= {"sd": 0.0, "at_most": 0.0}
    numbers = {name: (getattr(estimate, name), by) for name, by in shifts.items()}
    found: dict[str, Any] = {n: factor * x + by for n, (x, by) in numbers.items() if x is not None}
    return replace(estimate, unit=unit, **found)


def converted(written: Estimate, found: Estimate, where: str) -> str | None:
    """What to say of an estimate that was written in another unit and is `found` in ours.

    None where both units are one, however they are spelt.
    """
    raw, value = (e.assumed if e.value is None else e.value for e in (written, found))
    if raw is None or value is None or abs(raw - value) <= 1e-9 * abs(value):
        return None
    factor = abs(value / raw) if raw else 0.0
    times = f"{factor:.4g}" if factor >= 1 or not factor else f"1/{1 / factor:.4g}"
    return (
        f"{where} is written in {written.unit!r}, where our commands write {found.unit!r}: read as"
        f" {value:.4g} {found.unit}, {times} of the number that stands there; if only the unit was"
        f" changed, write {found.unit!r} again"
    )


SHOWN_DIGITS = 6
SHOWN_UNITS = {"m": ("mm", 1e3), "m/s": ("mm/s", 1e3), "N/Pa": ("N/bar", 1e5)}
MICROMETRES_BELOW = 0.1  # mm


class Unit(NamedTuple):
    """A unit in which something is shown, and what SI is multiplied by."""

    name: str
    factor: float


def shown_unit(unit: str) -> Unit:
    """The unit in which a value in an SI unit is shown."""
    return Unit(*SHOWN_UNITS.get(unit, (unit, 1.0)))


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


@dataclass(frozen=True)
class Display:
    """In which units a machine's numbers are held, and in which they are shown.

    motion: of the machine; command: unit of its command. Made once of its rig, and handed on to
    whatever writes numbers.
    """

    motion: Motion = "linear"
    command: str = "V"

    @classmethod
    def of(cls, rig: Rig) -> Self:
        """That of the machine on a rig."""
        return cls(rig.motion, rig.command_unit)

    @property
    def rotary(self) -> bool:
        """Whether positions are angles [rad]."""
        return self.motion == "rotary"

    @property
    def position(self) -> str:
        return "rad" if self.rotary else "m"

    @property
    def velocity(self) -> str:
        return f"{self.position}/s"

    @property
    def force(self) -> str:
        return "N m" if self.rotary else "N"

    @property
    def stiffness(self) -> str:
        return over(self.force, self.position)

    @property
    def force_gain(self) -> str:
        """Of a force loop's k_i."""
        return over(self.command, self.force)

    @property
    def friction(self) -> Mapping[str, str]:
        """Units of the nine, by name."""
        return ROTARY_UNITS if self.rotary else UNITS

    @property
    def mass(self) -> str:
        return self.friction["m"]

    def by_name(self, quantities: Mapping[str, str]) -> dict[str, str]:
        """The unit of each number, of a unit or of a quantity whose unit hangs on the machine."""
        return {name: self.named(one) for name, one in quantities.items()}

    def named(self, quantity: str) -> str:
        """The unit of a quantity, or the unit that is given itself."""
        own: dict[str, str] = {
            "position": self.position,
            "velocity": self.velocity,
            "force": self.force,
            "stiffness": self.stiffness,
            "force_gain": self.force_gain,
            "command": self.command,
            "acceleration": f"{self.position}/s^2",
            "damping": f"{self.force} s/{self.position}",
            "force_per_command": over(self.force, self.command),
            "viscous": self.friction["F_vp"],
            "mass": self.mass,
        }
        return own.get(quantity, quantity)

    def shown(self, quantity: str) -> Unit:
        """The unit in which tables and charts show a quantity."""
        return shown_unit(self.named(quantity))

    def length_text(self, value: float) -> str:
        """A length [m] in mm, in µm where mm would need zeros; an angle [rad] in rad."""
        unit, factor = self.shown("position")
        size = factor * value
        if unit == "mm" and 0 < abs(size) < MICROMETRES_BELOW:
            return f"{number(1e3 * size)} µm"
        return f"{number(size)} {unit}"

    def force_text(self, value: float) -> str:
        """A force [N] or torque [N m], with three digits."""
        return f"{number(value)} {self.force}"


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
