"""The plant as one value: mass with Karnopp friction, its actuator, and chosen effects."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from identification.effects._base import Acting
from identification.errors import BadModel
from identification.model.karnopp import ROTARY_UNITS, UNITS, Karnopp

ACTUATOR_UNITS = {"k1": "N/(V s)", "k2": "N/m", "k_a": "N/V"}
ROTARY_ACTUATOR_UNITS = {"k1": "N m/(V s)", "k2": "N m/rad", "k_a": "N m/V"}


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
    """Motor with negligible dynamics, F = k_a u; k_a [N/V] (paper, figure 1, upper part)."""

    k_a: float


@dataclass(frozen=True)
class Plant:
    """Mass and friction, the actuator where the command is known, and the effects it has."""

    friction: Karnopp
    actuator: Actuator | Motor | None = None
    effects: tuple[Acting, ...] = ()


def units_of(motion: Literal["linear", "rotary"]) -> Mapping[str, str]:
    """Units of the nine parameters and of the actuator's, by name."""
    if motion == "rotary":
        return {**ROTARY_UNITS, **ROTARY_ACTUATOR_UNITS}
    return {**UNITS, **ACTUATOR_UNITS}
