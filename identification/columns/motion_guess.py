"""Whether a machine turns or slides, what a position's own values say of its unit, and the units
and sizes that servo machines usually have, as log-probabilities."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from identification.arrays import Array
from identification.columns.column import Column, halved_counts
from identification.columns.header import words_of
from identification.columns.notation import Factor
from identification.columns.roles import Roles
from identification.log import Motion
from identification.signals.relations import of_a_weight

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
    "pressure": (5e5, 2.5),
    "mass": (3.0, 12.0),
    "travel rotary": (2.0, 6.0),
    "speed rotary": (5.0, 10.0),
    "force rotary": (1.0, 15.0),
    "mass rotary": (1e-3, 50.0),
    "travel rotor": (20.0, 20.0),  # of a motor's own shaft
    "speed rotor": (30.0, 10.0),
}
OF_OIL = (1e7, 3.0)  # the same of a hydraulic pressure


@dataclass(frozen=True)
class UnitGuess:
    """Unit of a column as cards write it, its gain ("1000 count/mm") or None, whether it is sure,
    and why; rival: the next likely unit or gain."""

    unit: str
    gain: str | None
    sure: bool
    why: str
    rival: str = ""


def metre(unit: str, guess: UnitGuess | None, factor: Factor) -> float:
    """What one of the position's unit is in SI, its gain reckoned with."""
    if guess is None or guess.gain is None:
        return factor(unit)
    number, above, below = parts_of(guess.gain)
    return factor(unit) * factor(below) / (factor(above) * abs(float(number)))


def written_gain(number: float | str, unit: str, per: str) -> str:
    """A gain as a card has it: so many of a unit per another one."""
    size = number if isinstance(number, str) else f"{number:.9g}"
    return f"{size} {unit}/({per})" if " " in per else f"{size} {unit}/{per}"


def parts_of(gain: str) -> tuple[str, str, str]:
    """Number, unit, and what it is per, of a gain so written."""
    number, _, both = gain.partition(" ")
    above, _, below = both.rpartition("/")
    return number, above, below.strip("()")


def near(quantity: str, value: float, machine: str) -> float:
    """Log-probability of a size, of the normal spread of its logarithm.

    machine: linear, rotary, or rotor where the motor's own shaft is logged.
    """
    keys = {"linear": (quantity,), "rotor": (f"{quantity} rotor", f"{quantity} rotary", quantity)}
    key = next(one for one in keys.get(machine, (f"{quantity} rotary", quantity)) if one in SIZES)
    if not value > 0.0:
        return 0.0
    of_it = [SIZES[key], OF_OIL] if quantity == "pressure" else [SIZES[key]]
    return max(-0.5 * float((np.log(value / middle) / np.log(by)) ** 2) for middle, by in of_it)


def likeliest(
    quantity: str, value: float, usual: Mapping[str, float], machine: str, factor: Factor
) -> tuple[str, str]:
    """The likeliest unit of a value, and the next one."""
    ranked = sorted(
        usual, key=lambda one: -usual[one] - near(quantity, value * factor(one), machine)
    )
    return ranked[0], ranked[1] if len(ranked) > 1 else ""


WHOLE_POWER = 1e-4  # of a binary logarithm, that a turn over a step is off a whole one
TURN_IN = {"rad": 2.0 * np.pi, "deg": 360.0}
WRAPS = 0.02  # of a turn, that a leap or a range is off it
FAR_FOR_A_SLIDE = 0.5  # m, that a sliding joint of a robot hardly goes
TURNING = 1.0  # log-odds by words that may speak of a turn, from which it is guessed
TWO_TURNS = 720.0  # of what is called an angle, in whole degrees as likely as in counts
COUNTED_LEVELS = 200  # of a position of whole numbers, from which it is one of counts
MOST_QUARTERS, OFF_QUARTER = 20, 1e-3  # levels of a reference by quarters of a turn, and off one
ROTOR = 1.5  # the same of words that speak of a motor's own shaft


class MotionGuess(NamedTuple):
    """Whether the machine turns, why, whether that is sure, and whether by its own rotor; angle:
    the unit of its position, where a weight tells it."""

    motion: Motion
    why: str
    sure: bool
    rotor: bool = False
    angle: str = ""

    @property
    def machine(self) -> str:
        """As sizes of machines are looked up: linear, rotary or rotor."""
        return "rotor" if self.rotor and self.motion == "rotary" else self.motion

    @property
    def force_unit(self) -> str:
        """N, or N m of a machine that turns."""
        return "N m" if self.motion == "rotary" else "N"


def known_motion(roles: Roles, beside: Sequence[Column] = ()) -> MotionGuess:
    """Turns or slides: by units, by words, by a turn in the position's values; else a guess, by a
    speed of turning among the columns beside too."""
    weak = {
        name: column.header.turning
        for name, column in roles.columns.items()
        if name in ("y", "r", "u", "F", "v")
    }
    rotor = weak.get("u", 0.0) >= ROTOR
    for name in ("y", "r", "F", "v"):
        column = roles.columns.get(name)
        unit = column.header.unit if column else None
        if column and unit and unit.quantity in ("position", "velocity", "force"):
            motion: Motion = "rotary" if unit.rotary else "linear"
            sure = not column.header.doubtful or len(unit.card) > 1
            return MotionGuess(motion, f"the unit of column {column.shown}", sure, rotor)
    angles = {name for name, column in roles.columns.items() if column.header.angle}
    if angles:  # a slide's motor has a torque too
        why = "a header that speaks of an angle or a torque"
        return MotionGuess("rotary", why, bool(angles & {"y", "r", "v"}), rotor)
    turn = unit_by_turn(roles.columns["y"])
    if turn is not None:
        return MotionGuess("rotary", f"{turn[1]} in {turn[0]}", True, rotor)
    y = roles.columns["y"]
    if is_count(y) and any(one.current for one in (*beside, *roles.columns.values())):
        why = "counts of an encoder beside a motor's current are mostly those of a shaft"
        return MotionGuess("rotary", why, False, rotor)
    if is_count(y) and y.header.unit is None and not y.header.means:
        return MotionGuess(
            "rotary", "it has the steps of an encoder, which shafts mostly have", False
        )
    if sum(weak.values()) >= TURNING:
        most = roles.columns[max(weak, key=lambda one: weak[one])]
        why = f"machines that turn have names like {most.shown} more often"
        return MotionGuess("rotary", why, False, rotor)
    for one in beside:
        force = "force" in one.header.means
        if (one.header.speed or force) and one.header.angle and one.axis in ("", y.axis):
            what = "a torque" if force else "the speed of a turn"
            return MotionGuess("rotary", f"{one.shown} beside it is {what}", False)
    names = {word for one in beside for word in words_of(one.header.name)}
    if {"effort", "efforts", "eff"} & names and np.ptp(y.x) > FAR_FOR_A_SLIDE:
        why = "position and effort are those of a robot's joints, which mostly turn"
        return MotionGuess("rotary", why, False, rotor)
    if y.header.unit is None and (quarters := _of_quarters(roles)):
        why = f"its reference goes by quarters of a turn in {quarters}"
        return MotionGuess("rotary", why, False, rotor, quarters)
    drive = roles.columns.get("F" if roles.kind == "force" else "u")
    if drive is not None and y.motion is not None and y.header.unit is None:
        angle = of_a_weight(y.motion, y.x, drive.x, {**TURN_IN, "turn": 1.0})
        if angle is not None:
            why = f"the weight of an arm is in what drives, by an angle in {angle}"
            return MotionGuess("rotary", why, False, rotor, angle)
    return MotionGuess("linear", "the usual one: no unit and no word says that it turns", False)


def _of_quarters(roles: Roles) -> str:
    """The unit in which all levels of the reference are quarters of a turn; else empty."""
    levels = roles.columns["r"].levels if "r" in roles.columns else np.zeros(0)
    for unit, turn in TURN_IN.items() if len(levels) < MOST_QUARTERS else ():
        quarters = 4.0 * levels[levels != 0.0] / turn
        whole = np.round(quarters)
        off = np.abs(quarters - whole)
        if len(quarters) and np.all(whole) and np.all(off < OFF_QUARTER):
            return unit
    return ""


def is_count(y: Column) -> bool:
    """Whether a position has whole numbers of an encoder, by its unit or by its values."""
    unit = y.header.unit
    if unit is not None:
        return unit.quantity == "count"
    if len(y.levels) <= COUNTED_LEVELS or (y.header.angle and np.ptp(y.x) <= TWO_TURNS):
        return False
    return y.whole or halved_counts(y.numbers)


def unit_by_turn(y: Column) -> tuple[str, str] | None:
    """Unit of an angle whose steps are a turn over a power of two, and that; None of others."""
    for unit, turn in TURN_IN.items():
        power = np.log2(turn / y.step) if y.step > 0.0 else 0.5
        if abs(power - round(power)) < WHOLE_POWER:
            return unit, f"its steps are a turn over {2 ** round(power)}"
    return None


def counts_per_turn(y: Array) -> int | None:
    """Counts of a turn, of an encoder that leaps back by a power of two; None where it does not."""
    leap = float(np.max(np.abs(np.diff(y)), initial=0.0))
    if leap < 2.0:
        return None
    power = 2 ** round(np.log2(leap))
    wraps = abs(leap / power - 1.0) < WRAPS and 0.9 * power < float(np.ptp(y)) < power
    return int(power) if wraps and y.min() >= 0.0 else None
