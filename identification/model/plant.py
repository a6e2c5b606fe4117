"""The plant as one value: mass with Karnopp friction, its actuator, and chosen effects."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from identification.effects._base import Acting
from identification.errors import BadModel
from identification.model.karnopp import ROTARY_UNITS, UNITS, Karnopp


@dataclass(frozen=True)
class Actuator:
    """Linear electro-pneumatic actuator dF/dt = k1 u - k2 v; k1 [N/(V s)], k2 [N/m]."""

    k1: float
    k2: float

    def __post_init__(self) -> None:
        if not (self.k1 > 0 and self.k2 >= 0):
            raise BadModel(f"actuator k1 = {self.k1:g}, k2 = {self.k2:g}: need k1 > 0 and k2 >= 0")


@dataclass(frozen=True)
class Motor:
    """Motor with negligible dynamics, F = k_a u; k_a [N/V, or N per unit of u] (paper, fig. 1)."""

    k_a: float


@dataclass(frozen=True)
class Plant:
    """Mass and friction, the actuator where the command is known, and the effects it has."""

    friction: Karnopp
    actuator: Actuator | Motor | None = None
    effects: tuple[Acting, ...] = ()


def over(unit: str, under: str) -> str:
    """The unit `unit` for each `under`, as "N/A"; a share ("1") leaves no trace."""
    if unit == under:
        return "1"
    if under == "1":
        return unit
    return f"{unit}/({under})" if " " in under else f"{unit}/{under}"


def actuator_units(motion: Literal["linear", "rotary"], command: str = "V") -> Mapping[str, str]:
    """Units of k1 and k2, and of a motor's k_a, where the command has the unit `command`."""
    force, length = ("N m", "rad") if motion == "rotary" else ("N", "m")
    rate = "s" if command == "1" else f"{command} s"
    return {"k1": over(force, rate), "k2": over(force, length), "k_a": over(force, command)}


def units_of(motion: Literal["linear", "rotary"], command: str = "V") -> Mapping[str, str]:
    """Units of the nine parameters and of the actuator's, by name."""
    nine = ROTARY_UNITS if motion == "rotary" else UNITS
    return {**nine, **actuator_units(motion, command)}
