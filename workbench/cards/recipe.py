"""A recipe: plant, loop, reference, noise and seed from which `workbench simulate` makes a log.

Values only. In a card it stands under `[recipe]`; levels and amplitudes are in m (rad) where the
loop is closed and in V where `drive = "command"`; noise is a standard deviation in SI. A parameter
of an effect is a number in SI or a text with its unit; one that has a default may be left out.

    [recipe]
    duration_s = 40.0
    h_s = 1e-3
    seed = 1
    noise_F = 1e-2
    noise_y = 1e-5
    drive = "loop"                          # or "command": reference is u, open loop
    friction = { m = 1.0, F_cp = 12.0, ... }            # the nine
    actuator = { k1 = 19530.0, k2 = 10405.0 }           # or motor = { k_a = 35.15 }
    reference = { kind = "steps", levels = [0.0, 0.1], dwell_s = 5.0 }
    effects.stribeck = { F_s = 5.0, v_s = "20 mm/s" }   # effect key -> its parameters
    mean_pressure_pa = 3e5                  # of the two chambers; default: half the supply's
    [recipe.loop]
    position = { kind = "PID", k_R = 1754.0, T_d = 0.018, T_i = 0.072, eps = 0.2 }
    force = { k_i = 0.02, T_i = 0.05 }                  # none with a motor: the force is exact
    control_limit_v = 5.0
    compensator = { N_c = 2.0, e_T = 0.003 }            # (4); friction = { m = ..., ... }: others

Where no position is given, the card's [controller] runs the machine, with its own force loop.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator
from pydantic_core import PydanticCustomError

from identification.arrays import Array
from identification.effects._base import Acting
from identification.effects._library import Library, built_in
from identification.errors import BadModel
from identification.model.karnopp import Karnopp
from identification.model.plant import Actuator, Motor, Plant
from identification.signals.check import SHORTEST_LOG
from identification.signals.excitation import (
    Multisine,
    Ramps,
    RandomSteps,
    ReferenceSpec,
    Steps,
    Sum,
)
from workbench.cards.effect_values import written_effect
from workbench.cards.units import Motion
from workbench.files import ABSURD

LONGEST_RECIPE = 1e8  # samples of a recipe: a gigabyte a signal


@dataclass(frozen=True)
class RecipePD:
    """k_d (1 + T_d s/(eps s + 1)); k_d [N/m], times [s]."""

    k_d: float
    T_d: float
    eps: float


@dataclass(frozen=True)
class RecipePID:
    """k_R (1 + 1/(T_i s) + T_d s/(eps s + 1)); k_R [N/m], times [s]."""

    k_R: float
    T_d: float
    T_i: float
    eps: float


@dataclass(frozen=True)
class RecipeRST:
    """Polynomials in z^-1: S(z^-1) F_ref = T(z^-1) r - R(z^-1) y."""

    R: tuple[float, ...]
    S: tuple[float, ...]
    T: tuple[float, ...]


@dataclass(frozen=True)
class RecipeForcePI:
    """The force loop C_F = k_i (1 + 1/(T_i s)); k_i [V/N], T_i [s]."""

    k_i: float
    T_i: float


@dataclass(frozen=True)
class RecipeCompensator:
    """The compensator (4): N_c [-], e_T [m]; friction: that it knows, None: the plant's."""

    N_c: float
    e_T: float
    friction: Karnopp | None = None


@dataclass(frozen=True)
class LoopSpec:
    """Position controller (`None`: that of the card), force controller (`None` for a motor), limit
    of the command [V] and friction compensator (`None` for none)."""

    position: RecipePD | RecipePID | RecipeRST | None
    force: RecipeForcePI | None = None
    control_limit: float | None = None
    compensator: RecipeCompensator | None = None


@dataclass(frozen=True)
class Recipe:
    """Everything that makes a log but the code; `loop` is `None` where `drive` is "command", and
    where the card's controller runs the machine with nothing beside it.

    `reference` is r [m] in the loop, and the command u [V] without it. Noise: standard deviations
    of force [N], position [m], pressures [Pa]. duration, h in s. mean_pressure [Pa]: of the two
    chambers, None for half the supply pressure.
    """

    plant: Plant
    duration: float
    h: float
    loop: LoopSpec | None
    reference: ReferenceSpec
    noise_F: float = 0.0
    noise_y: float = 0.0
    noise_p: float = 0.0
    seed: int = 0
    drive: Literal["loop", "command"] = "loop"
    mean_pressure: float | None = None

    @property
    def by_card(self) -> bool:
        """Whether the controller of the card runs the machine."""
        return self.drive == "loop" and (self.loop is None or self.loop.position is None)

    @property
    def t(self) -> Array:
        """Sampling instants [s], from 0 to the duration."""
        return self.h * np.arange(round(self.duration / self.h) + 1, dtype=np.float64)


class CardTable(BaseModel):
    """A table of a card: unknown keys are refused with the nearest right one."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _known_keys(cls, values: object) -> object:
        if isinstance(values, Mapping):
            for key in values:
                if key not in cls.model_fields:
                    raise PydanticCustomError("unknown_key", "{key}", {"key": str(key)})
                _refuse_absurd(str(key), values[key])
                if isinstance(values[key], bool) and not _takes_bool(cls, str(key)):
                    raise ValueError(f"{key} needs a value, not true or false")
        return values


def _refuse_absurd(key: str, value: object) -> None:
    """Raises ValueError where the value, or one in the list, is a number that no machine has."""
    for one in value if isinstance(value, list) else [value]:
        if isinstance(one, int | float) and ABSURD < abs(one) < math.inf:
            raise ValueError(
                f"{key!r} = {str(one)[:20]} is a number that no machine has; correct it"
            )


def _takes_bool(section: type[CardTable], key: str) -> bool:
    annotation = section.model_fields[key].annotation
    return annotation is bool or bool in getattr(annotation, "__args__", ())


def _more_than_nothing(value: float) -> float:
    """The value; raises ValueError where it is so small that what is divided by it overflows."""
    if 0.0 < value < 1.0 / ABSURD:
        raise ValueError(f"is nothing, {1.0 / ABSURD:.0e} or more needed")
    return value


Divisor = Annotated[float, AfterValidator(_more_than_nothing)]
Positive = Annotated[Divisor, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]


class StepsSection(CardTable):
    """`Steps` as a card writes it."""

    kind: Literal["steps"]
    levels: tuple[float, ...] = Field(min_length=1)
    dwell_s: Positive

    def value(self) -> Steps:
        """The specification."""
        return Steps(self.levels, self.dwell_s)


class RandomStepsSection(CardTable):
    """`RandomSteps` as a card writes it."""

    kind: Literal["random_steps"]
    amplitude: Positive
    dwell_s: Positive

    def value(self) -> RandomSteps:
        """The specification."""
        return RandomSteps(self.amplitude, self.dwell_s)


class RampsSection(CardTable):
    """`Ramps` as a card writes it."""

    kind: Literal["ramps"]
    amplitude: Positive
    rate: Positive

    def value(self) -> Ramps:
        """The specification."""
        return Ramps(self.amplitude, self.rate)


class MultisineSection(CardTable):
    """`Multisine` as a card writes it."""

    kind: Literal["multisine"]
    amplitude: Positive
    low_hz: Positive
    high_hz: Positive
    lines: int = Field(default=20, ge=1)

    @model_validator(mode="after")
    def _ordered(self) -> "MultisineSection":
        if self.high_hz <= self.low_hz:
            raise ValueError("high_hz must be above low_hz")
        return self

    def value(self) -> Multisine:
        """The specification."""
        return Multisine(self.amplitude, self.low_hz, self.high_hz, self.lines)


class SumSection(CardTable):
    """`Sum` as a card writes it."""

    kind: Literal["sum"]
    parts: "tuple[ReferenceSection, ...]" = Field(min_length=1)

    def value(self) -> Sum:
        """The specification."""
        return Sum(tuple(part.value() for part in self.parts))


ReferenceSection = Annotated[
    StepsSection | RandomStepsSection | RampsSection | MultisineSection | SumSection,
    Field(discriminator="kind"),
]


def _multisines(reference: ReferenceSection) -> list[MultisineSection]:
    """The multisines among a reference and its parts."""
    if isinstance(reference, SumSection):
        return [found for part in reference.parts for found in _multisines(part)]
    return [reference] if isinstance(reference, MultisineSection) else []


class PDSection(CardTable):
    """`RecipePD` as a card writes it."""

    kind: Literal["PD"]
    k_d: Positive
    T_d: NotNegative
    eps: Positive

    def value(self) -> RecipePD:
        """The controller."""
        return RecipePD(self.k_d, self.T_d, self.eps)


class PIDSection(CardTable):
    """`RecipePID` as a card writes it."""

    kind: Literal["PID"]
    k_R: Positive
    T_d: NotNegative
    T_i: Positive
    eps: Positive

    def value(self) -> RecipePID:
        """The controller."""
        return RecipePID(self.k_R, self.T_d, self.T_i, self.eps)


class RSTSection(CardTable):
    """`RecipeRST` as a card writes it."""

    kind: Literal["RST"]
    R: tuple[float, ...] = Field(min_length=1)
    S: tuple[float, ...] = Field(min_length=1)
    T: tuple[float, ...] = Field(min_length=1)

    def value(self) -> RecipeRST:
        """The controller."""
        return RecipeRST(self.R, self.S, self.T)


class ForceSection(CardTable):
    """`RecipeForcePI` as a card writes it."""

    k_i: Positive
    T_i: Positive


class FrictionSection(CardTable):
    """The nine parameters; signs are checked by `Karnopp`."""

    m: Divisor
    F_cp: float
    F_cn: float
    F_vp: float
    F_vn: float
    dv_p: float
    dv_n: float
    F_sp: float
    F_sn: float


class CompensatorSection(CardTable):
    """`RecipeCompensator` as a card writes it."""

    N_c: Annotated[float, Field(gt=1)] = 2.0
    e_T: Positive
    friction: FrictionSection | None = None

    def value(self) -> RecipeCompensator:
        """The compensator."""
        known = Karnopp(**self.friction.model_dump()) if self.friction else None
        return RecipeCompensator(self.N_c, self.e_T, known)


class LoopSection(CardTable):
    """`LoopSpec` as a card writes it."""

    position: Annotated[PDSection | PIDSection | RSTSection, Field(discriminator="kind")] | None = (
        None
    )
    force: ForceSection | None = None
    control_limit_v: Positive | None = None
    compensator: CompensatorSection | None = None

    def value(self) -> LoopSpec:
        """The loop."""
        force = RecipeForcePI(self.force.k_i, self.force.T_i) if self.force else None
        beside = self.compensator.value() if self.compensator else None
        position = self.position.value() if self.position else None
        return LoopSpec(position, force, self.control_limit_v, beside)


class ActuatorSection(CardTable):
    """The linear electro-pneumatic actuator."""

    k1: Positive
    k2: NotNegative


class MotorSection(CardTable):
    """The motor without dynamics."""

    k_a: float


class RecipeSection(CardTable):
    """`[recipe]` of a card."""

    duration_s: Positive
    h_s: Positive
    friction: FrictionSection
    reference: ReferenceSection
    actuator: ActuatorSection | None = None
    motor: MotorSection | None = None
    effects: dict[str, dict[str, Any]] = Field(default_factory=dict)
    loop: LoopSection | None = None
    drive: Literal["loop", "command"] = "loop"
    noise_F: NotNegative = 0.0
    noise_y: NotNegative = 0.0
    noise_p: NotNegative = 0.0
    mean_pressure_pa: Positive | None = None
    seed: int = Field(default=0, ge=0)

    @model_validator(mode="after")
    def _consistent(self) -> "RecipeSection":
        if (self.actuator is None) == (self.motor is None):
            raise ValueError("needs one of 'actuator' and 'motor'")
        if self.drive == "command" and self.loop is not None:
            raise ValueError("needs no 'loop' where drive is \"command\"")
        own = self.loop is not None and self.loop.position is not None
        if self.loop and own and (self.loop.force is None) != (self.actuator is None):
            raise ValueError("needs loop.force with an actuator, and none with a motor")
        if self.loop and not own and self.loop.force is not None:
            raise ValueError("needs loop.position above loop.force; or the card's controller.force")
        samples = self.duration_s / self.h_s
        if not SHORTEST_LOG <= samples <= LONGEST_RECIPE:
            raise ValueError(
                f"duration_s = {self.duration_s:g} at h_s = {self.h_s:g} makes {samples:.4g}"
                f" samples, {SHORTEST_LOG} to {LONGEST_RECIPE:.0e} needed"
            )
        for part in _multisines(self.reference):
            if part.high_hz >= 0.5 / self.h_s:
                raise ValueError(
                    f"reference.high_hz = {part.high_hz:g} is not below half the sampling rate"
                    f" ({0.5 / self.h_s:g} Hz at h_s = {self.h_s:g})"
                )
        return self

    def value(
        self, library: Library | None = None, motion: Motion = "linear", command: str = "V"
    ) -> Recipe:
        """The recipe; raises BadModel where a parameter has the wrong sign or an effect is unknown.

        library: the effects that it may name, by default all but a user's own files; command: the
        unit of the command.
        """
        drive = (
            Actuator(self.actuator.k1, self.actuator.k2)
            if self.actuator
            else Motor(self.motor.k_a if self.motor else 0.0)
        )
        known = library or (_installed() if self.effects else built_in())
        effects = tuple(self._effect(key, known, motion, command) for key in self.effects)
        plant = Plant(Karnopp(**self.friction.model_dump()), drive, effects)
        return Recipe(
            plant=plant,
            duration=self.duration_s,
            h=self.h_s,
            loop=self.loop.value() if self.loop else None,
            reference=self.reference.value(),
            noise_F=self.noise_F,
            noise_y=self.noise_y,
            noise_p=self.noise_p,
            seed=self.seed,
            drive=self.drive,
            mean_pressure=self.mean_pressure_pa,
        )

    def _effect(self, key: str, library: Library, motion: Motion, command: str) -> Acting:
        try:
            return written_effect(key, self.effects[key], library, motion, command)
        except BadModel as error:
            raise BadModel(f"effects: {error}") from None


def _installed() -> Library:
    from workbench.cards.own_effects import library

    return library()
