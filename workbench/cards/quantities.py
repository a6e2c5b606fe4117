"""Numbers of a card that may be texts with a unit, as "8 A/mm", brought to the unit in which the
machine's numbers are held."""

import math
import re

from identification.errors import BadCard
from workbench.cards.units import LONGEST_UNIT, conversion

NUMBER_AND_UNIT = re.compile(
    r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*", re.DOTALL
)


def in_unit_of(written: float | str | None, unit: str, where: str) -> float | None:
    """The number in `unit`, of a number (which is in it) or a text with a unit of its own.

    Raises BadCard, naming `where`, where the text is no number with a unit of that kind.
    """
    if written is None or not isinstance(written, str):
        return written
    found = NUMBER_AND_UNIT.fullmatch(written) if len(written) <= LONGEST_UNIT else None
    if found is None:
        raise BadCard(
            f"{where} = {written[:40]!r}: a number needed, or one with a unit as {unit!r}"
        )
    number, own = float(found[1]), found[2]
    if not math.isfinite(number):
        raise BadCard(f"{where} = {written[:40]!r}: a finite number needed")
    try:
        scale = conversion(own, unit) if own and own != unit else None
    except BadCard as error:
        raise BadCard(f"{where}: {error}; {unit!r} needed") from None
    if own and own != unit and scale is None:
        raise BadCard(f"{where}: unit {own!r} is of another kind than {unit!r}")
    return number if scale is None else scale.factor * number + scale.shift
