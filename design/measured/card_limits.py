"""`[limits]` of a card: what `axis-test` holds its machine to.

A limit is a pair of numbers in SI, or of texts with a unit, as `["10 N", "16 N"]`.
"""

from collections.abc import Mapping
from typing import Annotated

from pydantic import Strict

from design.machine.card_table import CardTable, InUnit
from design.machine.readable import Display
from identification.errors import BadCard
from identification.log import Rig
from identification.model.plant import units_of

Bound = Annotated[float, Strict()] | str
Pair = tuple[Bound, Bound]
LIMITED_SHARES = ("explained",)
LIMITED_LENGTHS, LIMITED_FORCES = ("backlash",), ("constant_force", "along_travel")


class LimitsSection(CardTable):
    """`[limits]` as a card writes it."""

    F_cp: Pair | None = None
    """Coulomb friction in positive direction, lowest and highest: N (N m) or texts"""
    F_cn: Pair | None = None
    """the same in negative direction"""
    F_vp: Pair | None = None
    """viscous friction in positive direction, N s/m"""
    F_vn: Pair | None = None
    """the same in negative direction"""
    F_sp: Pair | None = None
    """breakaway force in positive direction, N"""
    F_sn: Pair | None = None
    """its size in negative direction, N"""
    m: Pair | None = None
    """moving mass, kg (kg m²)"""
    constant_force: Pair | None = None
    """a force that is always there, towards +y: weight, offset, N"""
    backlash: Pair | None = None
    """width of the play, m (rad)"""
    explained: Pair | None = None
    """share of the force that mass and friction explain, 0 to 1"""
    along_travel: Pair | None = None
    """largest deviation of friction along the travel from its mean, N"""

    def value(self, rig: Rig, in_unit: InUnit) -> Mapping[str, tuple[float, float]]:
        """Lowest and highest in SI, by name; in_unit: what reads a text with its unit.

        Raises BadCard where one is none of its kind.
        """
        units = limit_units(rig)
        found = {}
        for name, unit in units.items():
            pair: Pair | None = getattr(self, name)
            if pair is None:
                continue
            low, high = (in_unit(one, unit, f"limits.{name}") for one in pair)
            if low is None or high is None or not low < high:
                raise BadCard(f"limits.{name} = {list(pair)}: the lower limit first needed")
            found[name] = (low, high)
        return found


def limit_units(rig: Rig) -> Mapping[str, str]:
    """Unit of each quantity that may have limits, by name."""
    plain = Display.of(rig)
    nine = units_of(rig.motion, rig.command_unit)
    return {
        **{name: nine[name] for name in ("m", "F_cp", "F_cn", "F_vp", "F_vn", "F_sp", "F_sn")},
        **dict.fromkeys(LIMITED_FORCES, plain.force),
        **dict.fromkeys(LIMITED_LENGTHS, plain.position),
        **dict.fromkeys(LIMITED_SHARES, "1"),
    }
