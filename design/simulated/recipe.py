"""A recipe: plant, loop, reference, noise and seed from which `workbench simulate` makes a log.

Values only. In a card it stands under `[recipe]`; levels and amplitudes are in m (rad) where the
loop is closed and in V where `drive = "command"`; noise is a standard deviation in SI. A parameter
of an effect is a number in SI or a text with its unit; one that has a default may be left out.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from design.machine.card_table import CardTable, Divisor, NotNegative, Positive
from design.machine.controller import Polynomials
from identification.arrays import Array
from identification.effects._base import Acting
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


class StepsSection(CardTable):
    """`Steps` as a card writes it."""

    kind: Literal["steps"]
    """levels one after the other"""
    levels: tuple[float, ...] = Field(min_length=1)
    """m (rad), or units of the command where `drive = "command"`, one after the other, again and
    again"""
    dwell_s: Positive
    """time at each level, s"""


class RandomStepsSection(CardTable):
    """`RandomSteps` as a card writes it."""

    kind: Literal["random_steps"]
    """levels drawn at random"""
    amplitude: Positive
    """levels are drawn up to this size"""
    dwell_s: Positive
    """time at each level, s"""


class RampsSection(CardTable):
    """`Ramps` as a card writes it."""

    kind: Literal["ramps"]
    """up and down at one speed"""
    amplitude: Positive
    """between minus and plus this size"""
    rate: Positive
    """slope: so much in a second"""


class MultisineSection(CardTable):
    """`Multisine` as a card writes it."""

    kind: Literal["multisine"]
    """sines with phases drawn at random"""
    amplitude: Positive
    """that of one sine of the same power"""
    low_hz: Positive
    """lowest frequency"""
    high_hz: Positive
    """highest frequency, below half the sampling rate"""
    lines: int = Field(default=20, ge=1)
    """number of sines"""

    @model_validator(mode="after")
    def _ordered(self) -> "MultisineSection":
        if self.high_hz <= self.low_hz:
            raise ValueError("high_hz must be above low_hz")
        return self


class SumSection(CardTable):
    """`Sum` as a card writes it."""

    kind: Literal["sum"]
    """several of these added"""
    parts: "tuple[ReferenceSection, ...]" = Field(min_length=1)
    """references that are added"""


ReferenceSection = Annotated[
    StepsSection | RandomStepsSection | RampsSection | MultisineSection | SumSection,
    Field(discriminator="kind"),
]


def specification(written: ReferenceSection) -> ReferenceSpec:
    """The reference that a card writes so."""
    match written:
        case StepsSection():
            return Steps(written.levels, written.dwell_s)
        case RandomStepsSection():
            return RandomSteps(written.amplitude, written.dwell_s)
        case RampsSection():
            return Ramps(written.amplitude, written.rate)
        case MultisineSection():
            return Multisine(written.amplitude, written.low_hz, written.high_hz, written.lines)
    return Sum(tuple(map(specification, written.parts)))


def multisines(reference: ReferenceSection) -> list[MultisineSection]:
    """The multisines among a reference and its parts."""
    if isinstance(reference, SumSection):
        return [found for part in reference.parts for found in multisines(part)]
    return [reference] if isinstance(reference, MultisineSection) else []


_AS_WRITTEN = ("loop", "noise_F", "noise_y", "noise_p", "seed", "drive")  # of a recipe's fields
LONGEST_RECIPE = 1e8  # samples of a recipe: a gigabyte a signal


class RecipePD(CardTable):
    """k_d (1 + T_d s/(eps s + 1)); k_d [N/m], times [s]."""

    kind: Literal["PD"]
    """k_d (1 + T_d s/(eps s + 1))"""
    k_d: Positive
    """N/m"""
    T_d: NotNegative
    """s"""
    eps: Positive
    """s"""


class RecipePID(CardTable):
    """k_R (1 + 1/(T_i s) + T_d s/(eps s + 1)); k_R [N/m], times [s]."""

    kind: Literal["PID"]
    """k_R (1 + 1/(T_i s) + T_d s/(eps s + 1))"""
    k_R: Positive
    """N/m"""
    T_d: NotNegative
    """s"""
    T_i: Positive
    """s"""
    eps: Positive
    """s"""


class RecipeRST(Polynomials):
    """Polynomials in z^-1: S(z^-1) F_ref = T(z^-1) r - R(z^-1) y."""

    kind: Literal["RST"]
    """S F_ref = T r - R y, in z^-1"""


class RecipeForcePI(CardTable):
    """The force loop C_F = k_i (1 + 1/(T_i s)); k_i [V/N], T_i [s]."""

    k_i: Positive
    """V/N"""
    T_i: Positive
    """s"""


class FrictionSection(CardTable):
    """The nine parameters; signs are checked by `Karnopp`."""

    m: Divisor
    """moving mass, kg"""
    F_cp: float
    """Coulomb level of motion towards +y, N"""
    F_cn: float
    """Coulomb level of motion towards -y, N"""
    F_vp: float
    """viscous friction towards +y, N s/m"""
    F_vn: float
    """viscous friction towards -y, N s/m"""
    dv_p: float
    """upper end of the band in which the body may stick, m/s"""
    dv_n: float
    """its lower end, m/s, negative"""
    F_sp: float
    """stick limit towards +y, N"""
    F_sn: float
    """stick limit towards -y, N, negative"""

    @property
    def value(self) -> Karnopp:
        """The nine; raises BadModel where one has the wrong sign."""
        return Karnopp(**self.model_dump())


class RecipeCompensator(CardTable):
    """The compensator (4): N_c [-], e_T [m]; friction: that it knows, None: the plant's."""

    N_c: Annotated[float, Field(gt=1)] = 2.0
    """by which the band is divided for its term near standstill"""
    e_T: Positive
    """position error at which that term is at the stick limit, m (rad)"""
    friction: FrictionSection | None = None
    """the nine that it knows; without it those of the plant"""


class LoopSpec(CardTable):
    """Position controller (`None`: that of the card), force controller (`None` for a motor), limit
    of the command [V] and friction compensator (`None` for none)."""

    position: Annotated[RecipePD | RecipePID | RecipeRST, Field(discriminator="kind")] | None = None
    """the position controller; without one the card's [controller] runs the machine"""
    force: RecipeForcePI | None = None
    """the force loop below it; none with a motor"""
    control_limit_v: Positive | None = None
    """of the size of the command"""
    compensator: RecipeCompensator | None = None
    """of friction, eq. (4)"""


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


class ActuatorSection(CardTable):
    """The linear electro-pneumatic actuator."""

    k1: Positive
    """dF/dt = k1 u - k2 v: N/(V s)"""
    k2: NotNegative
    """N/m"""


class MotorSection(CardTable):
    """The motor without dynamics."""

    k_a: float
    """F = k_a u: N for each unit of the command"""


class RecipeSection(CardTable):
    """`[recipe]` of a card."""

    duration_s: Positive
    """length of the log, s"""
    h_s: Positive
    """sampling period, s"""
    friction: FrictionSection
    """the nine"""
    reference: ReferenceSection
    """of the position, or the command itself where the loop is open"""
    actuator: ActuatorSection | None = None
    """this or `motor`"""
    motor: MotorSection | None = None
    """this or `actuator`"""
    effects: dict[str, dict[str, Any]] = Field(default_factory=dict)
    """by key of an effect its parameters, numbers in SI or texts with a unit"""
    loop: LoopSpec | None = None
    """the closed loop"""
    drive: Literal["loop", "command"] = "loop"
    """whether the loop is closed, or the reference is the command"""
    noise_F: NotNegative = 0.0
    """standard deviation of the force's noise, N"""
    noise_y: NotNegative = 0.0
    """of the position's, m"""
    noise_p: NotNegative = 0.0
    """of each pressure's, Pa"""
    mean_pressure_pa: Positive | None = None
    """of both chambers, Pa; without it half the supply pressure"""
    seed: int = Field(default=0, ge=0)
    """of noise and random references"""

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
        for part in multisines(self.reference):
            if part.high_hz >= 0.5 / self.h_s:
                raise ValueError(
                    f"reference.high_hz = {part.high_hz:g} is not below half the sampling rate"
                    f" ({0.5 / self.h_s:g} Hz at h_s = {self.h_s:g})"
                )
        return self

    def value(self, effect: Callable[[str, Mapping[str, Any]], Acting]) -> Recipe:
        """The recipe; raises BadModel where a parameter has the wrong sign or an effect is unknown.

        effect: what a key and its written parameters make.
        """
        drive = (
            Actuator(self.actuator.k1, self.actuator.k2)
            if self.actuator
            else Motor(self.motor.k_a if self.motor else 0.0)
        )
        beside = self.loop.compensator if self.loop else None
        if beside and beside.friction:
            _ = beside.friction.value  # refused here, not in the simulation
        try:
            effects = tuple(effect(key, written) for key, written in self.effects.items())
        except BadModel as error:
            raise BadModel(f"effects: {error}") from None
        return Recipe(
            plant=Plant(self.friction.value, drive, effects),
            duration=self.duration_s,
            h=self.h_s,
            reference=specification(self.reference),
            mean_pressure=self.mean_pressure_pa,
            **{name: getattr(self, name) for name in _AS_WRITTEN},
        )
