"""References of a recipe, as a card writes them."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from identification.signals.excitation import Multisine, Ramps, RandomSteps, Steps, Sum
from workbench.cards.table import CardTable, Positive


class StepsSection(CardTable):
    """`Steps` as a card writes it."""

    kind: Literal["steps"]
    """levels one after the other"""
    levels: tuple[float, ...] = Field(min_length=1)
    """m (rad), or units of the command where `drive = "command"`, one after the other, again and
    again"""
    dwell_s: Positive
    """time at each level, s"""

    def value(self) -> Steps:
        """The specification."""
        return Steps(self.levels, self.dwell_s)


class RandomStepsSection(CardTable):
    """`RandomSteps` as a card writes it."""

    kind: Literal["random_steps"]
    """levels drawn at random"""
    amplitude: Positive
    """levels are drawn up to this size"""
    dwell_s: Positive
    """time at each level, s"""

    def value(self) -> RandomSteps:
        """The specification."""
        return RandomSteps(self.amplitude, self.dwell_s)


class RampsSection(CardTable):
    """`Ramps` as a card writes it."""

    kind: Literal["ramps"]
    """up and down at one speed"""
    amplitude: Positive
    """between minus and plus this size"""
    rate: Positive
    """slope: so much in a second"""

    def value(self) -> Ramps:
        """The specification."""
        return Ramps(self.amplitude, self.rate)


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

    def value(self) -> Multisine:
        """The specification."""
        return Multisine(self.amplitude, self.low_hz, self.high_hz, self.lines)


class SumSection(CardTable):
    """`Sum` as a card writes it."""

    kind: Literal["sum"]
    """several of these added"""
    parts: "tuple[ReferenceSection, ...]" = Field(min_length=1)
    """references that are added"""

    def value(self) -> Sum:
        """The specification."""
        return Sum(tuple(part.value() for part in self.parts))


ReferenceSection = Annotated[
    StepsSection | RandomStepsSection | RampsSection | MultisineSection | SumSection,
    Field(discriminator="kind"),
]


def multisines(reference: ReferenceSection) -> list[MultisineSection]:
    """The multisines among a reference and its parts."""
    if isinstance(reference, SumSection):
        return [found for part in reference.parts for found in multisines(part)]
    return [reference] if isinstance(reference, MultisineSection) else []
