"""Sensors: from a logged column to its signal in SI, column = gain * signal + offset.

Two ways to write a gain. As a number beside the unit of the signal it is a pure factor:
`unit = "mm", gain = 2` reads 10 as 5 mm. Where `unit` is the sensor's output (V, A, counts) it is
that unit for each SI unit of the signal: `unit = "V", gain = 80` reads 8 as 0.1 m. With its own
unit (`gain = "80 V/m"`, `gain = "4096 count/turn"`) `unit` is always that of the column.
"""

import math
import re
from typing import NamedTuple

from identification.errors import BadCard
from workbench.cards.units import (
    LONGEST_UNIT,
    Motion,
    Scale,
    commands,
    conversion,
    kind,
    scale_or_none,
    si_unit,
)

_GAIN = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)?\s*(.*?)\s*", re.DOTALL)
_OUTPUTS = ("V", "A", "1")  # what sensors give; a number as gain is taken for these only


class Gain(NamedTuple):
    """A gain of `number`, in `unit`; None where it is a number alone."""

    number: float
    unit: str | None


def parse_gain(gain: float | str) -> Gain:
    """The gain as a card writes it; raises ValueError, in words, where it is none or 0."""
    if isinstance(gain, str):
        if len(gain) > LONGEST_UNIT:
            raise ValueError('gain is too long; write it as in gain = "80 V/m"')
        found = _GAIN.fullmatch(gain)
        number, unit = found.groups() if found else (None, "")
        parsed = Gain(1.0 if number is None else float(number), unit or None)
        if number is None and parsed.unit is None:
            raise ValueError('gain is empty; write it as in gain = "80 V/m"')
        if unit[:1] in (",", ".", ";"):
            raise ValueError('gain is no number with a unit; write it as in gain = "80.5 V/m"')
    else:
        parsed = Gain(gain, None)
    if parsed.number == 0.0 or not math.isfinite(parsed.number):
        raise ValueError("gain must not be 0 or infinite")
    return parsed


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


def column_scale(
    unit: str,
    gain: float | str | None,
    signal: str,
    motion: Motion,
    command: str | None = None,
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
    raise BadCard(_not_the_signal(unit, gain, signal, motion))


def _not_the_signal(unit: str, gain: float | str | None, signal: str, motion: Motion) -> str:
    text = f"signals.{signal}: unit {unit!r} is not {kind(signal, motion)}"
    if signal == "t":
        return text
    number = "<number>" if gain is None else f"{parse_gain(gain).number:g}"
    return (
        f"{text}; write such a unit, or, if {unit!r} is what the sensor gives, its gain with its"
        f' unit: gain = "{number} {unit}/{_per(signal, motion)}"'
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
        f" {kind(signal, motion)}; column = gain * signal, so write {right}"
    )


def _per(signal: str, motion: Motion) -> str:
    """The signal's SI unit as it stands behind a stroke."""
    need = si_unit(signal, motion) or ""
    return f"({need})" if " " in need else need
