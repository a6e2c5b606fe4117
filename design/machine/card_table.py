"""What every table of a card is: its keys are known, its numbers such as machines have.

The text below a field says what it is; the card's page of the documentation is made of them.
"""

import math
from collections.abc import Callable, Mapping
from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator
from pydantic_core import PydanticCustomError

from identification.signals.check import ABSURD


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


InUnit = Callable[[float | str | None, str, str], float | None]
"""The number in a unit, of a number which is in it or a text with its own; raises BadCard, by the
name of the place, where it is of another kind."""

Divisor = Annotated[float, AfterValidator(_more_than_nothing)]
Positive = Annotated[Divisor, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
