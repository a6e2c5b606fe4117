"""Units of a machine's parameters, and estimates written in other units brought to them."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

from identification.errors import BadCard, BadModel
from identification.model.estimates import Estimate
from identification.model.karnopp import ROTARY_UNITS, UNITS
from identification.model.plant import over
from workbench.cards.units import Motion, conversion


class Shown(NamedTuple):
    """Units of a machine's numbers, in which tables and axes show them and results hold them.

    force_gain: of a force loop's k_i.
    """

    position: str
    velocity: str
    force: str
    stiffness: str
    force_gain: str
    command: str

    @property
    def friction(self) -> Mapping[str, str]:
        """Units of the nine, by name."""
        return friction_units("rotary" if self.position == "rad" else "linear")

    def by_name(self, quantities: Mapping[str, str]) -> dict[str, str]:
        """The unit of each number, of a unit or of a quantity whose unit hangs on the machine."""
        return {name: self.named(one) for name, one in quantities.items()}

    def named(self, quantity: str) -> str:
        """The unit of a quantity, or the unit that is given itself."""
        own: dict[str, str] = {
            **self._asdict(),
            "acceleration": f"{self.position}/s^2",
            "damping": f"{self.force} s/{self.position}",
            "force_per_command": over(self.force, self.command),
            "viscous": self.friction["F_vp"],
            "mass": self.friction["m"],
        }
        return own.get(quantity, quantity)


def shown(rotary: bool, command: str = "V") -> Shown:
    """The units of a linear or a rotary machine whose command has the unit `command`."""
    if rotary:
        return Shown("rad", "rad/s", "N m", "N m/rad", over(command, "N m"), command)
    return Shown("m", "m/s", "N", "N/m", over(command, "N"), command)


def friction_units(motion: Motion) -> Mapping[str, str]:
    """Units of the nine, by name."""
    return ROTARY_UNITS if motion == "rotary" else UNITS


def in_unit(estimate: Estimate, unit: str, where: str) -> Estimate:
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

    return scaled(estimate, unit, found.factor, found.shift)


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
