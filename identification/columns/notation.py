"""How logs of machines write their headers and units, as a floor without their words and without
conversions asks for it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from identification.columns.header import Header, Quantity, WrittenUnit

Factor = Callable[[str], float]


@dataclass(frozen=True)
class Notation:
    """The words and units of logs, made by whoever has them.

    header: a header, of its text and the field of a row of units below it (empty: none); meaning:
    the weight of each quantity that a word means by itself; says_purpose: whether a word says what
    a signal is for, not what it is; unit: the unit of a spelling, None where it is none; factor:
    what one of a unit is in SI, raises BadCard where it is unknown.
    """

    header: Callable[[str, str], Header]
    meaning: Callable[[str], Mapping[Quantity, float]]
    says_purpose: Callable[[str], bool]
    unit: Callable[[str], WrittenUnit | None]
    factor: Factor
