"""How logs of machines write headers and units, handed to the floors below."""

from functools import cache

from identification.columns.notation import Notation
from identification.errors import BadCard
from workbench.cards.headers import meaning, read_header, says_purpose
from workbench.cards.units import conversion
from workbench.cards.written_units import written_unit


@cache
def _factor(unit: str) -> float:
    """What one of the unit is in SI; raises BadCard where it is unknown."""
    found = conversion(unit, None)
    if found is None:
        raise BadCard(f"unit {unit!r} has no SI base")
    return found.factor


NOTATION = Notation(read_header, meaning, says_purpose, written_unit, _factor)
