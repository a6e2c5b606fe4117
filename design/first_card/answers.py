"""What somebody answers to a guess of the first card, and the card with it."""

import re
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import replace

from design.first_card.proposal import Proposal, SignalGuess
from design.first_card.rig_guess import DRIVEN_THROUGH
from design.machine.nearest import nearest
from identification.columns.column import COLUMN, Column
from identification.columns.header import WrittenUnit
from identification.columns.motion_guess import parts_of, written_gain
from identification.errors import BadCard, UserError
from identification.log import Motion

LEAVE_OUT, THE_OTHER = "-", "+"
CONFIRMED = "confirmed"
OTHER_MOTION = {"m": "rad", "mm": "deg", "um": "deg", "rad": "m", "deg": "mm", "turn": "mm",
                "N": "N m", "kN": "N m", "mN": "mN m", "N m": "N", "mN m": "N"}  # fmt: skip
NEXT_UNIT = {"m": "mm", "mm": "m", "rad": "deg", "deg": "rad", "N m": "mN m", "N": "kN"}
OTHER_GAIN = {"mm": "turn", "turn": "mm"}
WRITTEN_GAIN = re.compile(r"[\d.]+ [^/\d][^/]*/[^/]+")

UnitOf = Callable[[str], WrittenUnit | None]


class BadAnswer(UserError):
    """An answer that is no column, unit or number."""


def with_signal(
    of: Proposal,
    name: str,
    answer: str,
    written_unit: UnitOf,
    scaled: Callable[[SignalGuess, Motion], object],
) -> Proposal:
    """The proposal after an answer on one of its signals.

    answer: empty (the guess is right), "-" (no such signal), "+" (what it would be otherwise), or a
    column and its unit, or either alone; written_unit: the unit of a spelling, None where it is
    none; scaled: raises BadCard where unit and gain do not make the signal. Raises BadAnswer, one
    line, where the answer is none of these.
    """
    one = of.signal(name)
    assert one is not None
    text = _other(answer.strip(), one.rival)
    if text == LEAVE_OUT:
        if name in ("t", "y", *DRIVEN_THROUGH[of.kind]):
            raise BadAnswer(f'a rig of kind "{of.kind}" needs {name}; name its column')
        return replace(of, signals=tuple(other for other in of.signals if other is not one))
    found = replace(one, sure=True, why=CONFIRMED)
    found = _answered(of, one, text, written_unit) if text else found
    try:
        scaled(found, of.motion)
    except BadCard as error:
        raise BadAnswer(str(error)) from None
    return replace(of, signals=tuple(found if other is one else other for other in of.signals))


def with_rig(of: Proposal, key: str, answer: str) -> Proposal:
    """The proposal after an answer on a value of its rig: empty, "-", "+", a number or a word.

    Raises BadAnswer where it is none of these.
    """
    one = next(guess for guess in of.rig if guess.key == key)
    text = _other(answer.strip(), one.rival)
    found = replace(one, sure=one.value is not None, why=CONFIRMED)
    if key == "kind":
        if text not in ("", of.kind):
            return _of_kind(of, text)
    elif key == "motion" and text:
        if text not in ("linear", "rotary"):
            raise BadAnswer(f"{text!r}: linear or rotary needed")
        turned = of.signals if text == of.motion else tuple(map(_turned, of.signals))
        of = replace(of, motion="rotary" if text == "rotary" else "linear", signals=turned)
        found = replace(found, value=text)
    elif text == LEAVE_OUT:
        if key in ("area_p_m2", "area_n_m2") and of.kind == "electro-pneumatic":
            raise BadAnswer(f"a rig of two pressures needs {key}; give a number in {one.unit}")
        found = replace(one, value=None)
    elif text:
        try:
            number = float(text.replace(",", "."))
        except ValueError:
            raise BadAnswer(f"{text!r} is no number; give it in {one.unit}") from None
        if not 0.0 < abs(number) < float("inf"):
            raise BadAnswer(f"{text}: a number other than 0 needed, in {one.unit}")
        found = replace(one, value=number, sure=True, why="given on the terminal")
    return replace(of, rig=tuple(found if x is one else x for x in of.rig))


def _of_kind(of: Proposal, kind: str) -> Proposal:
    """The proposal for a rig of the other kind, which is then given."""
    other = of.other
    if other is None or other.kind != kind:
        there = f"{of.kind} or {other.kind}" if other is not None else of.kind
        raise BadAnswer(f"{kind!r}: {there} is what the columns here can drive")
    rig = tuple(
        replace(x, sure=True, why=CONFIRMED, rival=of.kind) if x.key == "kind" else x
        for x in other.rig
    )
    return replace(other, rig=rig, other=replace(of, other=None))


def _turned(one: SignalGuess) -> SignalGuess:
    """A signal as a guess for the other kind of motion: its unit, and per what its gain is."""
    gain = one.gain
    if isinstance(gain, str):
        number, above, below = parts_of(gain)
        gain = written_gain(number, above, OTHER_GAIN.get(below, OTHER_MOTION.get(below, below)))
    rival = OTHER_MOTION.get(one.rival, "") if one.rival != one.column else one.rival
    unit = OTHER_MOTION.get(one.unit, one.unit)
    rival = NEXT_UNIT.get(unit, "") if rival in ("", unit) else rival
    return replace(one, unit=unit, gain=gain, rival="" if one.sure else rival)


def _other(text: str, rival: str) -> str:
    """The answer, "+" put into words; raises BadAnswer where there is nothing else."""
    if text == THE_OTHER and not rival:
        raise BadAnswer("nothing else is likely here; name a column, a unit or a number")
    return rival if text == THE_OTHER else text


def _answered(of: Proposal, one: SignalGuess, text: str, written_unit: UnitOf) -> SignalGuess:
    """The signal from a column, a unit, or both."""
    names = _names(of)
    text = text if text in names else text.removeprefix(f"{COLUMN} ")
    given = replace(one, sure=True, why="given on the terminal")
    before, _, last = text.rpartition(" ")
    if column := names.get(text) or names.get(before.strip()):
        unit = one.unit if text in names else _unit(last, written_unit)
        return replace(given, column=column.raw.key, shown=column.shown, unit=unit, gain=None,
                       bits=None, summed=False)  # fmt: skip
    if WRITTEN_GAIN.fullmatch(text):
        return replace(given, gain=text)
    if written_unit(text) is None:
        raise BadAnswer(f"{text!r} is neither a column nor a unit{nearest(text, names)}")
    return replace(
        given, unit=_unit(text, written_unit), gain=None if isinstance(one.gain, str) else one.gain
    )


def _unit(text: str, written_unit: UnitOf) -> str:
    found = written_unit(text)
    return found.card if found else text


def _names(of: Proposal) -> Mapping[str, Column]:
    """What a column may be called in an answer: its number, or its header where that is one's."""
    headers = Counter(one.raw.header for one in of.columns)
    once = [one for one in of.columns if one.raw.header and headers[one.raw.header] == 1]
    numbers = {str(one.raw.number): one for one in of.columns}
    return numbers | {one.raw.header: one for one in once}
