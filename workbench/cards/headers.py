"""What a column's header says: its name, its unit as cards write it, and what its words mean.

Headers are written as "pos [mm]", "Position (µm)", "p1/bar", "Kraft_N" or "変位(mm)". The words
are those of English, German, Japanese, Chinese, French, Italian and Spanish loggers; what they say
is evidence only, which the column's own numbers may outweigh.
"""

import re
import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from design.machine.plausible import log_size_remarks
from identification.columns.header import (
    SAYS_WHAT_IT_IS,
    Header,
    Purpose,
    Quantity,
    WrittenUnit,
    words_of,
)
from identification.errors import BadCard
from identification.log import Log, Rig
from workbench.cards.card_tables import SignalSpec
from workbench.cards.units import scale_or_none
from workbench.cards.written_units import LOG_WORDS, written_unit

# One letter behind "_" or a space is as often part of a name (y_m: measured, p_a: chamber A).
_SURE_SUFFIX = 2
_HUMPS = re.compile(r"(?<=[a-z])(?=[A-Z])")
_VOLTS = ("V", "mV", "A", "mA")
_OF_TWO_LETTERS = ("Ms", "Us", "Mm", "Nm")  # units at the end of a name in humps
_BRACKETS = re.compile(r"[\[({<]\s*([^\[\](){}<>]*(?:\(g\))?)\s*[\])}>]")
_INDEX = re.compile(r"\w\[\d+\]$")
_SLASH = re.compile(r"^([^/]+?)\s*/\s*(.+)$")
_IN = re.compile(r"^(.+)\s+in\s+(\S+|%\s.+)$")
_SUFFIX = re.compile(r"^(.+)(?:\s*[,;:]\s*|[\s_\-.]+)(\S+)$")

_WORDS: Mapping[Quantity, Sequence[str]] = {
    what: line.split() for what, line in LOG_WORDS["words"].items()
}
_MAY_TURN: Mapping[str, float] = LOG_WORDS["turning"]
_EXACT: Mapping[str, Sequence[str]] = LOG_WORDS["whole"]


def _short_words() -> dict[str, dict[Quantity, float]]:
    """What each short word may mean, with its weight."""
    out: dict[str, dict[Quantity, float]] = {}
    for quantity, words in LOG_WORDS["short"].items():
        for word, weight in words.items():
            out.setdefault(word, {})[quantity] = float(weight)
    return out


_SHORT_WORDS = _short_words()
_PARTS = re.compile(r"/|(?<=\w)[\"']?\.(?=[^\W\d])")  # of a path, and of a variable in a structure
_PATH, _SPOKEN = 2, 3  # strokes in a path, and letters of a word in it
_MEASURED = {"position", "velocity", "force", "pressure"}  # of these a letter beside is an index
_PLACES = {"joint", "gelenk", "motor"}  # words of what a quantity is of


def read_header(text: str, unit_below: str = "") -> Header:
    """The header's parts; unit_below: the field of a row of units under it.

    Of a path, as a message's field has, the last part gives the quantity, all of it the purpose.
    """
    whole, last = _read(text, unit_below), _PARTS.split(text)[-1]
    path = text.count("/") >= _PATH or last != text.rpartition("/")[2]
    if not path or len("".join(words_of(last)[:1])) < _SPOKEN:
        return whole
    own = _read(last, unit_below)
    return replace(whole, means=own.means, unit=own.unit) if own.means else whole


def _read(text: str, unit_below: str) -> Header:
    plain = unicodedata.normalize("NFKC", text).strip().strip("\"'")
    name, unit, doubtful = _without_unit(plain)
    if unit_below.strip():
        below = written_unit(unit_below.strip().strip("[](){}<> "))
        name, unit, doubtful = (plain, below, False) if below else (name, unit, doubtful)
    words = _unambiguous(words_of(name))
    means = _meanings(words, " ".join(words_of(plain)))
    if doubtful and unit and means and unit.quantity not in means:
        name, unit, doubtful = plain, None, False
    elif doubtful and unit and unit.quantity != "position":  # time_s, but not y_m: measured
        doubtful = not means or not plain.endswith(unit.card)
    whole = " ".join(words)
    purpose = _purpose(words, whole, means)
    lengths = unit is not None and unit.quantity in ("position", "count")
    others = [one for one in words if one != "cmd" and not one.startswith("command")]
    asked = len(others) < len(words)
    if purpose == "reference" and asked and not any(map(_commands, others)):
        means = {what: weight for what, weight in means.items() if what != "command"} or means
    if lengths and asked and (not purpose or "position" not in means):
        means, purpose = {"position": 1.5}, "reference"
    if purpose == "reference" and "command" in means and "position" not in means:
        purpose = "demand"  # a voltage or current that is asked for is the command
    elif purpose == "reference" and not means and not doubtful and unit and unit.plain in _VOLTS:
        means, purpose = {"command": 2.0}, "demand"
    elif purpose == "reference" and not means:
        means = {"position": 1.5}
    angle = _holds(whole, "angles") or bool(unit and unit.rotary)
    turning = max((_MAY_TURN.get(word, 0.0) for word in words), default=0.0)
    stem = tuple(word for word in words_of(name) if not says_purpose(word))
    return Header(text, name, unit, means, purpose, angle, doubtful, turning, stem)


def _unambiguous(words: list[str]) -> list[str]:
    """The words without what two of them mean otherwise together."""
    if words[:1] == ["i"] and len(words) > 1 and words[1] in ("a", "q", "m", "mot"):
        return ["iq" if words[1] == "q" else "ia", *words[2:]]  # "I_a" is no ampere
    return [one for one in words if one != "effort"] if "control" in words else words


def _without_unit(text: str) -> tuple[str, WrittenUnit | None, bool]:
    """Name, unit, and whether the unit is doubtful."""
    found = written_unit(text) if len(text) > 1 and text != "min" else None
    turns = found is not None and found.rotary and len(text) >= _SPOKEN
    if found and (turns or found.quantity in ("velocity", "time")):  # "radian", "rpm", "millis"
        return text, found, False
    if _INDEX.search(text):  # "position[1]" of an array
        return text, None, False
    every = list(_BRACKETS.finditer(text))
    for inside in reversed(every):
        if found := written_unit(inside[1]):
            return _around(text, inside, "") or text, found, False
    if every:
        return _around(text, every[0], every[0][1]), None, False
    if (slash := _SLASH.match(text)) and (found := written_unit(slash[2])):
        return slash[1], found, False
    if (after := _IN.match(text)) and (found := written_unit(after[2])):
        return after[1], found, False
    parts = re.split(r"_|\s", text)  # "speed_mm_s"
    if len(parts) > 2 and (found := written_unit(f"{parts[-2]}/{parts[-1]}")):
        return " ".join(parts[:-2]), found, False
    if (suffix := _SUFFIX.match(text)) and (found := written_unit(suffix[2])):
        parted = any(sign in text for sign in ",;:")
        if suffix[2] == "1" and not parted:  # "current_1", the first of several
            return text, None, False
        instrument = suffix[2].casefold() in ("meter", "metre")  # as a tachometer is
        if instrument and "position" not in _meanings(words_of(suffix[1]), ""):
            return text, None, False
        letter = len(suffix[2]) < _SURE_SUFFIX and suffix[2].isalpha()
        return suffix[1], found, not parted and letter
    humps = _HUMPS.split(text)  # "positionRad", "VelocityMetersPerSec"
    for k in range(1, len(humps)):
        unit = "/".join(humps[k:]).replace("/Per/", "/")
        if (len(unit) >= _SPOKEN or unit in _OF_TWO_LETTERS) and (found := written_unit(unit)):
            return "".join(humps[:k]), found, False
    return text, None, False


def _around(text: str, bracket: re.Match[str], inside: str) -> str:
    """The text without a bracket, what is inside instead of it."""
    parts = (text[: bracket.start()].strip(), inside.strip(), text[bracket.end() :].strip())
    return " ".join(one for one in parts if one)


def _holds(text: str, *kinds: str) -> bool:
    """Whether the text holds a part of a word of one of these kinds."""
    return any(part in text for kind in kinds for part in LOG_WORDS["parts"][kind])


def says_purpose(word: str) -> bool:
    """Whether a word says what a signal is for (soll, actual, cmd), not what it is."""
    parts = _holds(word, "reference", "measured", "model")
    return parts or word in (*_EXACT["reference"], *_EXACT["measured"], *_EXACT["model"], "command")


def meaning(word: str) -> Mapping[Quantity, float]:
    """Weight of each quantity that a word means by itself."""
    return _meanings([word], word)


def _meanings(words: list[str], whole: str) -> dict[Quantity, float]:
    """Weight of each quantity that the words mean, by the longest part that each contains."""
    found: dict[Quantity, float] = {}
    long = [one for one in words if len(one) > 1]
    spoken = len(words) > 1 and any(_MEASURED & set(meaning(x)) for x in long if x not in _PLACES)
    spoken |= len(long) > 1 and len(words[0]) == 1  # "x_" before a name of several words
    for word in long if spoken else words:
        if word in _SHORT_WORDS:
            for quantity, weight in _SHORT_WORDS[word].items():
                found[quantity] = max(found.get(quantity, 0.0), weight)
            continue
        best: tuple[int, Quantity] | None = None
        for quantity, parts in _WORDS.items():
            for part in parts:
                if part in word and (best is None or len(part) > best[0]):
                    best = (len(part), quantity)
        if best is not None:
            found[best[1]] = max(found.get(best[1], 0.0), SAYS_WHAT_IT_IS)
    wrong = _holds(whole, "errors") or {"err", "e"} & set(words)
    if ("other" in found and not wrong) or _holds(whole, "supplies") or "bus" in words:
        return {"other": SAYS_WHAT_IT_IS}
    if found.get("temperature", 0.0) >= SAYS_WHAT_IT_IS:
        return {"temperature": SAYS_WHAT_IT_IS}
    if "load" in words and "position" not in found:
        found["force"] = max(found.get("force", 0.0), 1.0)
    if "input" in words and not found:
        found["command"] = 2.0
    if any(one.startswith(("ddot", "dotdot")) or one.endswith("ddot") for one in words):
        return {"acceleration": SAYS_WHAT_IT_IS}
    if any(one == "dot" or (one.endswith("dot") and len(one) < 9) for one in words):
        return {"velocity": SAYS_WHAT_IT_IS}
    of_it = words[:1] in (["current"], ["cur"])
    of_it = of_it or {"motor"} == {one for one in words if _commands(one)}
    if of_it and {"position", "velocity"} & set(found):  # the present one, or that of the motor
        found.pop("command", None)
    return found


def _commands(word: str) -> bool:
    """Whether a word holds one that may mean a command."""
    parts = any(one in word for one in _WORDS["command"])
    return parts or "command" in _SHORT_WORDS.get(word, {})


def _purpose(words: list[str], whole: str, means: Mapping[Quantity, float]) -> Purpose:
    if _holds(whole, "errors") or {"err", "e"} & set(words):
        return "error"
    if _holds(whole, "model") or any(one in _EXACT["model"] for one in words):
        return "model"
    said = _holds(whole, "measured")
    letters = said or any(one in _EXACT["measured"] and len(one) > 1 for one in words)
    # A letter is then that of a parameter, as it is before a number: the R of "R820".
    named = {one for one, after in pairwise(words) if after.isdigit() and len(after) > 1}
    short = [one for one in words if one in _EXACT["reference"]
             and not (len(one) == 1 and (letters or one in named))]  # fmt: skip
    if _holds(whole, "reference") or short:
        return "reference"
    if any(one.startswith("command") for one in words) and {"position", "velocity"} & set(means):
        return "reference"
    if said or any(one in _EXACT["measured"] for one in words):
        return "measured"
    if any(one.startswith("ist") for one in words):  # Istposition, Istwert
        return "measured"
    if _holds(whole, "filtered") or any(one in _EXACT["filtered"] for one in words):
        return "filtered"
    return ""


def contradicted_units(signals: Mapping[str, SignalSpec], rig: Rig) -> dict[str, str]:
    """A line for each signal, by its name, whose column's header gives another unit than the card.

    A unit that a header may have by chance is none, and a gain of the card says that the column
    is no signal as it stands.
    """
    found = {name: _contradicted(name, spec, rig) for name, spec in signals.items()}
    return {name: line for name, line in found.items() if line}


def log_remarks(
    logs: Sequence[Log], rig: Rig, signals: Mapping[str, SignalSpec]
) -> tuple[str, ...]:
    """What is said of the logs' sizes and units, by how the card reads their signals: a remark
    changes nothing, it names what to look at."""
    units = {name: spec.unit for name, spec in signals.items()}
    return log_size_remarks(logs, rig, units, contradicted_units(signals, rig))


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
