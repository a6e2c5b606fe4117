"""Several axes or joints in one log: which column is of which, by what their headers share."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from identification.arrays import Array
from identification.columns.comparable import SAME_MOTION
from identification.columns.header import Header, WrittenUnit, is_position, words_of
from identification.columns.notation import Notation

OF_TURNS = {"rpm": "turn"}  # what a speed sums up to whose unit does not say it
WORDS_OF_A_NAME = 3  # of an axis's name


def axes_of(
    columns: Sequence[tuple[Header, int]], alike: Array, notation: Notation
) -> dict[int, str]:
    """The axis of each column by its number, "" of what belongs to all; empty for one axis.

    Headers that differ in a word or a few beside each other make a family: of positions that do
    not move together these are the axes. columns: headers and numbers; alike: correlation of the
    columns, (k, k).
    """
    heads = [head for head, _ in columns]
    if not any(map(is_position, heads)):  # of speeds, of which a position is made
        heads = [as_position(head) if head.speed else head for head in heads]
    words = [words_of(head.name) for head in heads]
    if not any(map(is_position, heads)):  # nor of speeds: what begins as a command does
        driven = {tuple(own[:-1]) for head, own in zip(heads, words, strict=True) if _drives(head)}
        heads = [
            replace(head, purpose="measured") if not head.means and tuple(own[:-1]) in driven - {()}
            else head
            for head, own in zip(heads, words, strict=True)
        ]  # fmt: skip
    families: dict[tuple[str, ...], dict[str, int]] = {}
    for count in range(
        1, WORDS_OF_A_NAME + 1
    ):  # of two that name as many axes the shorter is the name
        for k, own in enumerate(words):
            for place in range(len(own) - count + 1):
                name = own[place : place + count]
                if all(_may_be_a_name(word, notation) for word in name):
                    key = (*own[:place], "*", *own[place + count :])
                    families.setdefault(key, {})[" ".join(name)] = k
    every = [one for one in families.values() if len(one) > 1]
    best = max(
        (_positions(one, heads, alike, every, alone=key == ("*",))
         for key, one in families.items() if len(one) > 1),
        key=lambda names: (len(names), -sum(map(len, map(str.split, names)))), default=(),
    )  # fmt: skip
    if len(best) < 2:
        return {}
    texts = [f" {' '.join(own)} " for own in words]
    of_axes = [text for text in texts if any(f" {one} " in text for one in best)]
    in_all = [one for one in best if all(f" {one} " in text for text in of_axes)]
    out = {}
    for (_, number), text in zip(columns, texts, strict=True):
        for one in in_all:  # of the machine's name
            text = text.replace(f" {one} ", " ", 1)
        named = [one for one in best if f" {one} " in text]
        named = [one for one in named if not any(one in other for other in named if other != one)]
        out[number] = named[0].replace(" ", "_") if len(named) == 1 else ""
    return out


def _drives(head: Header) -> bool:
    """Whether a header speaks of what drives a body."""
    return bool({"command", "force"} & set(head.means))


def _may_be_a_name(word: str, notation: Notation) -> bool:
    """Whether a word may name an axis: it says nothing else, or is itself a position's name."""
    means = notation.meaning(word)
    return not notation.says_purpose(word) and (not means or "position" in means or len(word) == 1)


def _positions(
    family: Mapping[str, int],
    heads: Sequence[Header],
    alike: Array,
    families: Sequence[Mapping[str, int]],
    *,
    alone: bool,
) -> tuple[str, ...]:
    """The words of a family that are axes: those of positions, each of which moves for itself.

    alone: whether the headers are these words alone; then other headers have to hold them too.
    """
    positions = [(word, k) for word, k in family.items() if is_position(heads[k])]
    names = {word for word, _ in positions}
    if len(names) < 2:
        return ()
    elsewhere = sum(names <= other.keys() for other in families)
    if alone and elsewhere < 2:
        return ()
    apart = list[tuple[str, int]]()
    for word, k in positions:
        if elsewhere > 1 or all(abs(alike[k, j]) < SAME_MOTION for _, j in apart):
            apart.append((word, k))
    return tuple(word for word, _ in apart)


def as_position(head: Header) -> Header:
    """The header of a speed, as one of what the speed sums up to."""
    unit = head.unit
    if unit is not None and unit.quantity == "velocity":
        whole = OF_TURNS.get(unit.plain, unit.plain.partition("/")[0])
        number = unit.card.removesuffix(unit.plain)
        unit = WrittenUnit(number + whole, "position", unit.rotary)
    return replace(head, unit=unit, means={"position": head.means.get("velocity", 1.0)})
