"""What the headers of one log say together: what all of them share tells nothing of one, and of two
words that contradict each other another header may decide."""

import re
from collections.abc import Sequence
from dataclasses import replace
from itertools import takewhile

from identification.columns.header import Header, words_of
from identification.columns.notation import Notation

RIGHT = re.compile(r"(?<![^\W_])r(?![^\W_])", re.I)  # a letter that no reference has beside an l
SAYS_PRESENT = {"current", "input"}  # words of what is measured, where it is set beside a set point
FEWEST_WITH_UNITS = 2  # columns, that make units of the last letters of others
FEWEST_ALIKE = 3  # headers that begin alike, from which that is the machine's name
_CURRENTS = ("current", "strom", "courant", "corrente", "cur", "curr", "amps")
_ARGUMENT = re.compile(r"\s*\([tkn]\)$")  # of a signal as a function of time: "u(t)"
_PER = re.compile(r"(?<=[a-z])_per_(?=[a-z]+$)", re.I)  # "deg_per_sec"
_NM = re.compile(r"(?<=[\W_])nm(?=\W*$)")  # as names in small letters have it
_LETTER = re.compile(r"[^\W\d]")
_WHOLE_WORDS = re.compile(r".*[_\s.-]")


def read_together(named: Sequence[tuple[str, str]], notation: Notation) -> list[Header]:
    """The headers of a log, each a text with the unit below it."""
    texts = [one for one, _ in named]
    names = [_PER.sub("_", _ARGUMENT.sub("()", one)) for one in _without_blocks(texts)]
    left = {one.casefold() for one in names if one}
    names = [
        RIGHT.sub("right", x) if RIGHT.sub("l", x).casefold() in left - {x.casefold()} else x
        for x in names
    ]
    heads = [
        _of_one_drive(notation.header(one, own), notation)
        for one, (_, own) in zip(names, named, strict=True)
    ]
    whole = (notation.header(one, "") for one in texts)  # what all share tells of the machine
    heads = [
        replace(own, turning=max(own.turning, one.turning), angle=own.angle or one.angle)
        for own, one in zip(heads, whole, strict=True)
    ]
    if sum(one.unit is not None and not one.doubtful for one in heads) >= FEWEST_WITH_UNITS:
        heads = [replace(one, doubtful=False) for one in heads]  # as others end in units too
    return _with_present(_without_letters(_without_machine(_beside_commands(heads), notation)))


def _beside_commands(heads: Sequence[Header]) -> list[Header]:
    """The headers, the "Ms" of "Boom Ms" beside "Boom Cmd" meaning what is measured, no unit of
    time."""
    commanded = {tuple(words_of(one.name)[:-1]) for one in heads if "command" in one.means}
    return [
        replace(one, name=one.text, unit=None, purpose="measured", doubtful=False)
        if one.unit is not None and one.unit.card == "ms" and not one.means
        and tuple(words_of(one.name)) in commanded - {()} else one
        for one in heads
    ]  # fmt: skip


def _of_one_drive(head: Header, notation: Notation) -> Header:
    """The header, "torque_current" meaning the current, "tau_motor" the motor's torque, "command"
    beside a torque what "cmd" does, and a torque in nm no nanometres."""
    if head.unit is not None and head.unit.card == "nm":
        torque = replace(notation.header(_NM.sub("Nm", head.text), ""), text=head.text)
        return _of_one_drive(torque, notation) if "force" in torque.means else head
    words = words_of(head.name)
    if not {"force", "command"} <= set(head.means) or head.purpose in ("reference", "demand"):
        return head
    commands = {one for one in words if "command" in notation.meaning(one)}
    asked = all(one.startswith("command") for one in commands)
    if words[-1] not in _CURRENTS and not asked and commands != {"motor"}:
        return head
    other = "force" if words[-1] in _CURRENTS else "command"
    means = {what: own for what, own in head.means.items() if what != other}
    return replace(head, means=means, purpose="reference" if asked else head.purpose)


def _without_blocks(headers: Sequence[str]) -> list[str]:
    """The headers without the blocks of a model in which all that have a path lie."""
    paths = [one.split("/") for one in headers if "/" in one]
    levels = zip(*(one[:-1] for one in paths), strict=False)
    common = sum(1 for _ in takewhile(lambda names: len(set(names)) == 1, levels))
    if len(paths) < 2:
        return list(headers)
    return ["/".join(one.split("/")[common:]) if "/" in one else one for one in headers]


def _without_machine(heads: Sequence[Header], notation: Notation) -> list[Header]:
    """The headers, each meaning what its words behind the name of the machine do, with which all
    begin but those of times and counts: the R of "R_elbow_load" asks for nothing."""
    others = [one.text for one in heads if one.text and not {"time", "count"} & set(one.means)]
    alike = takewhile(lambda signs: len(set(signs)) == 1, zip(*others, strict=False))
    begin = _WHOLE_WORDS.match("".join(signs[0] for signs in alike))
    rest = [one.text.removeprefix(begin[0]) for one in heads] if begin else []
    if len(others) < FEWEST_ALIKE or not all(map(_LETTER.match, filter(None, rest))) or not rest:
        return list(heads)
    own = (notation.header(one, "") for one in rest)
    return [
        replace(one, means=part.means, purpose=part.purpose)
        for one, part in zip(heads, own, strict=True)
    ]


def _without_letters(heads: Sequence[Header]) -> list[Header]:
    """The headers, without a unit that is the last of the letters by which several are told apart,
    as the A of "adc_A" beside "adc_B"."""
    apart = {one.text[:-1] for one in heads if one.text[-2:-1] in ("_", " ") and one.unit is None}
    return [replace(one, unit=None) if one.text[:-1] in apart else one for one in heads]


def _with_present(heads: Sequence[Header]) -> list[Header]:
    """The headers, "current" and a controller's "input" being what is present where one of them is
    what is asked for, another commands, and none else may be asked for."""
    others = [one for one in heads if not SAYS_PRESENT & set(words_of(one.name))]
    of = {what for one in others if one.purpose != "reference" for what in one.means}
    asked = any(one.purpose == "reference" for one in others)
    if not asked or "command" not in of or {"position", "velocity", "pressure"} & of:
        return list(heads)
    return [
        one if one in others or one.unit else replace(one, means={}, purpose="measured")
        for one in heads
    ]
