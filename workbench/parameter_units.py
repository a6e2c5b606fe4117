"""Units of a machine's parameters, and estimates written in other units brought to them."""

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

from identification.errors import BadCard, BadModel
from identification.karnopp import ROTARY_UNITS, UNITS
from identification.plant import ACTUATOR_UNITS, ROTARY_ACTUATOR_UNITS
from identification.result import Estimate
from workbench.units import Motion, conversion


class Shown(NamedTuple):
    """Units of what tables and axes show."""

    position: str
    velocity: str
    force: str
    stiffness: str
    force_gain: str


def shown(rotary: bool) -> Shown:
    """The units in which a linear or a rotary machine is shown."""
    if rotary:
        return Shown("rad", "rad/s", "N m", "N m/rad", "V/(N m)")
    return Shown("m", "m/s", "N", "N/m", "V/N")


def friction_units(motion: Motion) -> Mapping[str, str]:
    """Units of the nine, by name."""
    return ROTARY_UNITS if motion == "rotary" else UNITS


def actuator_units(motion: Motion) -> Mapping[str, str]:
    """Units of k1 and k2, and of k_a."""
    return ROTARY_ACTUATOR_UNITS if motion == "rotary" else ACTUATOR_UNITS


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

    def si(value: float | None) -> float | None:
        return None if value is None else found.factor * value + found.shift

    return replace(
        estimate,
        value=si(estimate.value),
        unit=unit,
        sd=None if estimate.sd is None else found.factor * estimate.sd,
        low=si(estimate.low),
        high=si(estimate.high),
        assumed=si(estimate.assumed),
    )
