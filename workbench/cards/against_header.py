"""A card against the headers of the columns that it names: units that the two do not share."""

from collections.abc import Mapping

import numpy as np

from identification.errors import BadCard
from identification.log import Rig
from workbench.cards.card_tables import SignalSpec
from workbench.cards.headers import read_header
from workbench.cards.units import scale_or_none


def contradicted_units(signals: Mapping[str, SignalSpec], rig: Rig) -> dict[str, str]:
    """A line for each signal, by its name, whose column's header gives another unit than the card.

    A unit that a header may have by chance is none, and a gain of the card says that the column
    is no signal as it stands.
    """
    found = {name: _contradicted(name, spec, rig) for name, spec in signals.items()}
    return {name: line for name, line in found.items() if line}


def _contradicted(name: str, spec: SignalSpec, rig: Rig) -> str:
    header = read_header(str(spec.column))
    gain = spec.written_gain
    if header.unit is None or header.doubtful or isinstance(gain, str) or abs(gain or 1.0) != 1.0:
        return ""
    said = header.unit.card
    try:
        here = scale_or_none(spec.unit, name, rig.motion, None, rig.command_unit)
        there = scale_or_none(said, name, rig.motion, None, rig.command_unit)
    except BadCard:
        return ""
    if here is None or there is None or np.isclose(here.factor, there.factor):
        return ""
    ratio = max(here.factor / there.factor, there.factor / here.factor)
    return (
        f"signals.{name}: the header {spec.column!r} says {said}, the card {spec.unit!r},"
        f" {ratio:.4g} times apart; write unit = {said!r}, unless the header is wrong"
    )
