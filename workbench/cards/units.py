"""Units of a card: from what is written to SI, and what dimension a signal must have.

A logged column becomes its signal by column = gain * signal + offset; a number of a card may be a
text with a unit, as "8 A/mm".
"""

import math
import re
from functools import cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from identification.errors import BadCard
from identification.log import Motion

if TYPE_CHECKING:
    import pint

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
# As data sheets write them, without a sign between: Nm, Nms, kgm2, gcm^2.
_RUN_TOGETHER = re.compile(r"(?<![^\W\d_])([Mkmµμu]?N|k?g)([cm]?m)?(s)?(?=[\d²³^*/·.\s()]|$)")
_POWER = re.compile(r"(?<=[a-z])([234])(?![\w.])")  # of m2
_TIMES = re.compile(r"(\d*\.?\d+)\s+(?=[^\W\d]|[%(])")
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


def commands(motion: Motion) -> tuple[str, ...]:
    """The units in which a command may be held: voltage, current, share, force."""
    return ("V", "A", "1", _FORCE_UNIT[motion])


def scale_or_none(
    unit: str,
    signal: str,
    motion: Motion = "linear",
    per: str | None = None,
    command: str | None = None,
) -> Scale | None:
    """Factor and shift to SI from `unit`, or `unit` over `per`, for a signal of this name.

    A temperature becomes kelvin. command: the unit in which a command is held, by default any of
    `commands`. None where the dimension is wrong; raises BadCard where a unit is unknown.
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
    times = _TIMES.match(unit)  # "0.001 mm", as a drive counts
    size, one = (float(times[1]), unit[times.end() :]) if times else (1.0, unit)
    parsed = _parsed(one) if per is None else _parsed(one) / _parsed(per)
    try:
        values = [_registry().Quantity(value * size, parsed) for value in (0.0, 1.0, 2.0)]
        in_si = [one.to_base_units() if wanted is None else one.to(wanted) for one in values]
        points = [float(one.magnitude) for one in in_si]
    except pint.DimensionalityError:
        return None
    except Exception as error:  # pint raises all kinds of errors on odd combinations
        raise _unknown(unit) from error
    shift, factor = points[0], points[1] - points[0]
    if not np.isclose(points[2], 2.0 * factor + shift) or factor == 0.0:
        raise BadCard(f"unit {unit!r} is not linear; log in a linear unit")
    return Scale(factor, shift)


def _parsed(unit: str) -> "pint.Unit":
    parted = _RUN_TOGETHER.sub(lambda found: " ".join(filter(None, found.groups())), unit)
    plain = _POWER.sub(r"^\1", parted)
    if len(unit) > LONGEST_UNIT or not _powers_are_small(plain):
        raise _unknown(unit)
    try:
        return _registry().Unit("dimensionless" if plain.strip() in ("", "1") else plain)
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


@cache
def _registry() -> "pint.UnitRegistry[float]":
    import pint

    return pint.UnitRegistry(autoconvert_offset_to_baseunit=True)


_NUMBER_AND_UNIT = re.compile(
    r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)?\s*(.*?)\s*", re.DOTALL
)
_OUTPUTS = ("V", "A", "1")  # what sensors give; a number as gain is taken for these only


class Gain(NamedTuple):
    """A gain of `number`, in `unit`; None where it is a number alone."""

    number: float
    unit: str | None


def number_and_unit(text: str) -> tuple[float | None, str]:
    """The number with which the text begins, if any, and what stands behind it."""
    found = _NUMBER_AND_UNIT.fullmatch(text)
    assert found is not None  # both parts may be empty
    return None if found[1] is None else float(found[1]), found[2]


def parse_gain(gain: float | str) -> Gain:
    """The gain as a card writes it; raises ValueError, in words, where it is none or 0."""
    if isinstance(gain, str) and len(gain) > LONGEST_UNIT:
        raise ValueError('gain is too long; write it as in gain = "80 V/m"')
    number, unit = number_and_unit(gain) if isinstance(gain, str) else (gain, "")
    if number is None and not unit:
        raise ValueError('gain is empty; write it as in gain = "80 V/m"')
    if unit.startswith((",", ".", ";")):
        raise ValueError('gain is no number with a unit; write it as in gain = "80.5 V/m"')
    if number == 0.0 or not math.isfinite(number or 1.0):
        raise ValueError("gain must not be 0 or infinite")
    return Gain(1.0 if number is None else number, unit or None)


def command_unit(unit: str, gain: float | str | None, motion: Motion) -> str:
    """The unit in which the command of a column is held: V, A, 1 (a share), N, or N m (rotary).

    "V" where unit and gain make none of these; `column_scale` then says so.
    """
    per = parse_gain(gain).unit if isinstance(gain, str) else None
    if per is None and unit in commands(motion):
        return unit
    try:
        return next((one for one in commands(motion) if conversion(unit, one, per)), "V")
    except BadCard:
        return "V"


def over_time(unit: str, signal: str) -> str:
    """The unit of the sum of a column in `unit` over time: of a speed its length or angle; of the
    clock's own steps theirs."""
    number = found[0] if (found := _TIMES.match(unit)) else ""
    return unit if signal == "t" else f"{number}({unit.removeprefix(number)}) s"


def column_scale(
    unit: str, gain: float | str | None, signal: str, motion: Motion, command: str | None = None
) -> Scale:
    """Signal in SI = factor * (column - offset) + shift; a command in the unit `command`.

    gain: None where the card gives none. Raises BadCard, saying what to write, where unit and gain
    do not make the signal; the caller says in which card.
    """
    number, per = (1.0, None) if gain is None else parse_gain(gain)
    try:
        found = scale_or_none(unit, signal, motion, per, command)
    except BadCard as error:
        how = "" if per is None else "; a gain is written as in '80 V/m'"
        raise BadCard(f"signals.{signal}: {error}{how}") from None
    if found is not None:
        return Scale(found.factor / number, found.shift)
    if per is not None:
        raise BadCard(_mismatch(unit, number, per, signal, motion))
    if gain is not None and any(conversion(unit, output) for output in _OUTPUTS):
        return Scale(1.0 / number, 0.0)
    text = f"signals.{signal}: unit {unit!r} is not {_NAMES[si_unit(signal, motion) or '']}"
    if signal == "t":
        raise BadCard(text)
    shown = "<number>" if gain is None else f"{number:g}"
    raise BadCard(
        f"{text}; write such a unit, or, if {unit!r} is what the sensor gives, its gain with its"
        f' unit: gain = "{shown} {unit}/{_per(signal, motion)}"'
    )


def _mismatch(unit: str, number: float, per: str, signal: str, motion: Motion) -> str:
    """What to write where unit and gain, each well written, do not make the signal."""
    over, _, under = (part.strip() for part in per.partition("/"))
    if under and "/" not in under and scale_or_none(unit, signal, motion, f"({under})/({over})"):
        right = f'gain = "{1.0 / number:.6g} {under}/{over}"'
    elif over and under and scale_or_none(over, signal, motion, per):
        right = f'unit = "{over}", the unit of the column'
    else:
        right = f'gain = "<number> {unit}/{_per(signal, motion)}"'
    return (
        f"signals.{signal}: unit {unit!r} with gain '{number:g} {per}' does not give"
        f" {_NAMES[si_unit(signal, motion) or '']}; column = gain * signal, so write {right}"
    )


def _per(signal: str, motion: Motion) -> str:
    """The signal's SI unit as it stands behind a stroke."""
    need = si_unit(signal, motion) or ""
    return f"({need})" if " " in need else need


def in_unit_of(written: float | str | None, unit: str, where: str) -> float | None:
    """The number in `unit`, of a number (which is in it) or a text with a unit of its own.

    Raises BadCard, naming `where`, where the text is no number with a unit of that kind.
    """
    if not isinstance(written, str):
        return written
    number, own = number_and_unit(written) if len(written) <= LONGEST_UNIT else (None, "")
    if number is None:
        raise BadCard(
            f"{where} = {written[:40]!r}: a number needed, or one with a unit as {unit!r}"
        )
    if not math.isfinite(number):
        raise BadCard(f"{where} = {written[:40]!r}: a finite number needed")
    if own in ("", unit):
        return number
    try:
        scale = conversion(own, unit)
    except BadCard as error:
        raise BadCard(f"{where}: {error}; {unit!r} needed") from None
    if scale is None:
        raise BadCard(f"{where}: unit {own!r} is of another kind than {unit!r}")
    return scale.factor * number + scale.shift
