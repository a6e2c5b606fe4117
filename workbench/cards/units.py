"""Units of a card's signals: from what is written to SI, and what dimension a signal must have."""

import re
from functools import cache
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from identification.errors import BadCard

if TYPE_CHECKING:
    import pint

Motion = Literal["linear", "rotary"]

_POSITION = {"linear": "m", "rotary": "rad"}
_FORCE_UNIT = {"linear": "N", "rotary": "N m"}
_NAMES = {
    "s": "a time such as s, ms or min",
    "m": "a length such as m, mm or inch",
    "rad": "an angle such as rad, deg or turn",
    "Pa": "a pressure such as Pa, bar or psi",
    "N": "a force such as N, kN, kgf or lbf",
    "N m": "a torque such as N m or lbf ft",
    "V": "a command such as V, mA, 1 (duty), N or N m",
}
# Logs of forces are often in pounds: as a force they are read as pounds-force.
_POUNDS = {"lb": "lbf", "lbs": "lbf", "klb": "kip"}
_POUND = re.compile(r"\b(lbs?|klb)\b")
LONGEST_UNIT = 100  # characters of a unit
MOST_POWERS = 6  # in a unit, as in kg^2 m^4 s^-6 A^-2
_DIGIT = r"[+-]?\d(?:\.\d{1,3})?"
# What follows "**": one digit, perhaps with a sign or a fraction; then the rest, if any.
_EXPONENT = re.compile(rf"\s*(?:{_DIGIT}|\(\s*{_DIGIT}\s*\))(?![\w.])\s*(.*)", re.DOTALL)


class Scale(NamedTuple):
    """SI value = factor * value + shift."""

    factor: float
    shift: float


def si_unit(signal: str, motion: Motion) -> str | None:
    """The SI unit a canonical signal has, `None` for an extra, which may have any."""
    table = {"t": "s", "y": _POSITION[motion], "r": _POSITION[motion], "p_p": "Pa", "p_n": "Pa"}
    return {**table, "F": _FORCE_UNIT[motion], "u": "V"}.get(signal)


def force_unit(motion: Motion) -> str:
    """N, or N m of a rotary machine."""
    return _FORCE_UNIT[motion]


def kind(signal: str, motion: Motion) -> str:
    """What a canonical signal is, with units as examples."""
    return _NAMES[si_unit(signal, motion) or ""]


def commands(motion: Motion) -> tuple[str, ...]:
    """The units in which a command may be held: voltage, current, share, force."""
    return ("V", "A", "1", _FORCE_UNIT[motion])


def scale(unit: str, signal: str, motion: Motion = "linear") -> Scale:
    """Factor and shift from `unit` to SI for a signal of this name.

    The command `u` may be a voltage, a current, a pure number (duty) or a force. A temperature
    becomes kelvin. Raises BadCard where the unit is unknown or of the wrong dimension; the caller
    says in which file.
    """
    found = scale_or_none(unit, signal, motion)
    if found is None:
        raise BadCard(f"signals.{signal}: unit {unit!r} is not {kind(signal, motion)}")
    return found


def scale_or_none(
    unit: str,
    signal: str,
    motion: Motion = "linear",
    per: str | None = None,
    command: str | None = None,
) -> Scale | None:
    """As `scale`, of `unit` over the unit `per`; None where the dimension is wrong.

    command: the unit in which a command is held, by default any of `commands`.
    """
    need = command if signal == "u" and command else si_unit(signal, motion)
    if unit == need and per is None:
        return Scale(1.0, 0.0)
    if need in ("N", "N m"):
        unit, per = _as_forces(unit), None if per is None else _as_forces(per)
    any_command = signal == "u" and command is None
    for target in commands(motion) if any_command else (need,):
        found = conversion(unit, target, per)
        if found is not None:
            return found
    return None


def _as_forces(unit: str) -> str:
    return _POUND.sub(lambda word: _POUNDS[word[0]], unit)


def conversion(unit: str, target: str | None, per: str | None = None) -> Scale | None:
    """The affine map from `unit`, or `unit` over `per`, to `target`; None if unlike.

    target None: the unit's own SI base. Raises BadCard where a unit is unknown or not linear.
    """
    import pint  # its registry takes longer than all the rest of a short command

    wanted = None if target is None else _parsed(target)
    parsed = _parsed(unit) if per is None else _parsed(unit) / _parsed(per)
    try:
        points = [_to_si(value, parsed, wanted) for value in (0.0, 1.0, 2.0)]
    except pint.DimensionalityError:
        return None
    except Exception as error:  # pint raises all kinds of errors on odd combinations
        raise _unknown(unit) from error
    shift, factor = points[0], points[1] - points[0]
    if not np.isclose(points[2], 2.0 * factor + shift) or factor == 0.0:
        raise BadCard(f"unit {unit!r} is not linear; log in a linear unit")
    return Scale(factor, shift)


def _parsed(unit: str) -> "pint.Unit":
    if len(unit) > LONGEST_UNIT or not _powers_are_small(unit):
        raise _unknown(unit)
    try:
        return _registry().Unit("dimensionless" if unit.strip() in ("", "1") else unit)
    except Exception as error:  # pint raises tokenizer and attribute errors on odd text
        raise _unknown(unit) from error


def _powers_are_small(unit: str) -> bool:
    """Whether every power is a plain exponent, as in m^2: pint would work out 9**9**9**9."""
    from pint.util import string_preprocessor

    powers = string_preprocessor(unit).split("**")[1:]
    rests = [found and found[1] for found in map(_EXPONENT.fullmatch, powers)]
    return len(powers) <= MOST_POWERS and all(rests[:-1]) and None not in rests[-1:]


def _unknown(unit: str) -> BadCard:
    shown = unit if len(unit) <= LONGEST_UNIT else f"{unit[:LONGEST_UNIT]}..."
    return BadCard(f"unit {shown!r} is unknown; write it as in 'mm', 'bar', 'N m'")


def _to_si(value: float, unit: "pint.Unit", base: "pint.Unit | None") -> float:
    quantity = _registry().Quantity(value, unit)
    return float((quantity.to(base) if base is not None else quantity.to_base_units()).magnitude)


@cache
def _registry() -> "pint.UnitRegistry[float]":
    import pint

    return pint.UnitRegistry(autoconvert_offset_to_baseunit=True)
