"""Units that signals usually have, and the sizes of servo machines, as log-probabilities."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np

from identification.errors import BadCard
from workbench.cards.units import conversion

USUAL: Mapping[str, Mapping[str, float]] = {  # signal: unit and how usual it is
    "t": {"s": 0.0, "ms": 0.0, "us": -0.7, "ns": -1.5},
    "y": {"m": 0.0, "mm": 0.5, "um": -1.0},
    "y rotary": {"rad": 0.3, "deg": 0.0, "turn": -1.5},
    "F": {"N": 0.0, "kN": -1.5, "mN": -3.0},
    "F rotary": {"N m": 0.0, "mN m": -2.5},
    "p": {"Pa": 0.0, "bar": 0.5, "kPa": -0.7, "MPa": -0.7, "mbar": -2.0, "psi": -2.0},
    "v": {"m/s": 0.0, "mm/s": 0.3},
    "v rotary": {"rad/s": 0.0, "deg/s": 0.0, "rpm": -0.5},
    "temperature": {"degC": 0.0, "K": -1.0},
}
# Middle of what machines have [SI], and by which factor most lie beside it.
SIZES: Mapping[str, tuple[float, float]] = {
    "period": (2e-3, 4.0),
    "duration": (20.0, 6.0),
    "travel": (0.08, 8.0),
    "speed": (0.1, 10.0),
    "force": (80.0, 12.0),
    "pressure": (5e5, 4.0),
    "mass": (3.0, 12.0),
    "travel rotary": (2.0, 6.0),
    "speed rotary": (5.0, 10.0),
    "force rotary": (1.0, 15.0),
    "mass rotary": (1e-3, 50.0),
    "travel rotor": (20.0, 20.0),  # of a motor's own shaft
    "speed rotor": (30.0, 10.0),
}


@dataclass(frozen=True)
class UnitGuess:
    """Unit of a column as cards write it, its gain ("1000 count/mm") or None, whether it is sure,
    and why; rival: the next likely unit or gain."""

    unit: str
    gain: str | None
    sure: bool
    why: str
    rival: str = ""


@cache
def factor(unit: str) -> float:
    """What one of the unit is in SI; raises BadCard where it is unknown."""
    found = conversion(unit, None)
    if found is None:
        raise BadCard(f"unit {unit!r} has no SI base")
    return found.factor


def metre(unit: str, guess: UnitGuess | None) -> float:
    """What one of the position's unit is in SI, its gain reckoned with."""
    if guess is None or guess.gain is None:
        return factor(unit)
    number, _, per = guess.gain.partition(" ")
    above, _, below = per.partition("/")
    return factor(unit) * factor(below) / (factor(above) * abs(float(number)))


def near(quantity: str, value: float, machine: str) -> float:
    """Log-probability of a size, of the normal spread of its logarithm.

    machine: linear, rotary, or rotor where the motor's own shaft is logged.
    """
    keys = {"linear": (quantity,), "rotor": (f"{quantity} rotor", f"{quantity} rotary", quantity)}
    key = next(one for one in keys.get(machine, (f"{quantity} rotary", quantity)) if one in SIZES)
    middle, by = SIZES[key]
    if not value > 0.0:
        return 0.0
    return -0.5 * float((np.log(value / middle) / np.log(by)) ** 2)


def likeliest(
    quantity: str, value: float, usual: Mapping[str, float], machine: str
) -> tuple[str, str]:
    """The likeliest unit of a value, and the next one."""
    ranked = sorted(
        usual, key=lambda one: -usual[one] - near(quantity, value * factor(one), machine)
    )
    return ranked[0], ranked[1] if len(ranked) > 1 else ""
