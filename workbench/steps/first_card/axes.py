"""Several axes or joints in one log: which column is of which, by what their headers share."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import takewhile

import numpy as np

from identification.arrays import Array
from workbench.cards.headers import Header, meaning, says_purpose, words_of
from workbench.cards.written_units import WrittenUnit

OF_TURNS = {"rpm": "turn"}  # what a speed sums up to whose unit does not say it
SAME_MOTION = 0.95  # correlation from which two positions are one axis with two sensors


def axes_of(columns: Sequence[tuple[Header, int]], alike: Array) -> dict[int, str]:
    """The axis of each column by its number, "" of what belongs to all; empty for one axis.

    Headers that differ in one word alone make a family: of positions that do not move together
    the word is the axis; other headers that end alike are of axes by what they begin with, where
    several begin so. columns: headers and numbers; alike: correlation of the columns, (k, k).
    """
    heads = [head for head, _ in columns]
    if not any(map(is_position, heads)):  # of speeds, of which a position is made
        heads = [as_position(head) if head.speed else head for head in heads]
    words = [words_of(head.name) for head in heads]
    families: dict[tuple[str, ...], dict[str, int]] = {}
    for k, own in enumerate(words):
        for place, word in enumerate(own):
            if _may_be_a_name(word):
                families.setdefault((*own[:place], "*", *own[place + 1 :]), {})[word] = k
    found = {key: one for key, one in families.items() if len(one) > 1}
    every = list(found.values())
    key, best = max(
        ((key, _positions(one, heads, alike, every, alone=key == ("*",)))
         for key, one in found.items()),
        key=lambda one: len(one[1]), default=((), ()),
    )  # fmt: skip
    if len(best) < 2:
        return {}
    end = key[key.index("*") + 1 :]
    others = _beginnings(words, heads, end, best)
    out = {}
    of_axes = [own for own in words if set(own) & set(best)]
    in_all = {word for word in best if all(word in own for own in of_axes)}  # of the machine's name
    for (_, number), own in zip(columns, words, strict=True):
        told = [word for k, word in enumerate(own) if word not in in_all or word in own[:k]]
        named = [word for word in dict.fromkeys(told) if word in best]
        named += ["_".join(one) for one in others if tuple(own[: len(one)]) == one]
        out[number] = named[0] if len(named) == 1 else ""
    return out


def _beginnings(
    words: Sequence[Sequence[str]], heads: Sequence[Header], end: tuple[str, ...],
    best: Sequence[str],
) -> list[tuple[str, ...]]:  # fmt: skip
    """What positions that end as those of the named axes begin with, where others begin so too."""
    out = list[tuple[str, ...]]()
    for head, own in zip(heads, words, strict=True):
        begin = tuple(own[: len(own) - len(end)])
        if not (end and begin and tuple(own[len(begin) :]) == end and is_position(head)):
            continue
        alike = sum(tuple(other[: len(begin)]) == begin for other in words)
        if alike > 1 and not set(own) & set(best) and not any(map(says_purpose, begin)):
            out.append(begin)
    return out


def _may_be_a_name(word: str) -> bool:
    """Whether a word may name an axis: it says nothing else, or is itself a position's name."""
    means = meaning(word)
    return not says_purpose(word) and (not means or "position" in means or len(word) == 1)


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
    elsewhere = sum(names <= set(other) for other in families)
    if alone and elsewhere < 2:
        return ()
    apart = list[tuple[str, int]]()
    for word, k in positions:
        if elsewhere > 1 or all(abs(alike[k, j]) < SAME_MOTION for _, j in apart):
            apart.append((word, k))
    return tuple(word for word, _ in apart)


def is_position(head: Header) -> bool:
    """Whether a header speaks of a position that is measured."""
    if head.purpose in ("reference", "error", "model"):
        return False
    if head.unit is not None:
        return head.unit.quantity == "position" or (
            head.unit.quantity == "count" and "position" in head.means
        )
    return max(head.means, key=lambda what: head.means[what], default="other") == "position"


def as_position(head: Header) -> Header:
    """The header of a speed, as one of what the speed sums up to."""
    unit = head.unit
    if unit is not None and unit.quantity == "velocity":
        whole = OF_TURNS.get(unit.plain, unit.plain.partition("/")[0])
        number = unit.card.removesuffix(unit.plain)
        unit = WrittenUnit(number + whole, "position", unit.rotary)
    return replace(head, unit=unit, means={"position": head.means.get("velocity", 1.0)})


def stem(head: Header) -> tuple[str, ...]:
    """What a header says beside what its signal is for: "theta" of "target_theta"."""
    return tuple(word for word in words_of(head.name) if not says_purpose(word))


def normed(x: Array) -> Array:
    """Columns (n, k) without their mean, of length one."""
    a = x - x.mean(axis=0)
    size = np.sqrt(np.sum(a**2, axis=0))
    return np.asarray(a / np.where(size > 0.0, size, 1.0))


def correlation(x: Array) -> Array:
    """Correlation of the columns of x (n, k), (k, k)."""
    a = normed(x)
    return np.asarray(a.T @ a)


def without_blocks(headers: Sequence[str]) -> list[str]:
    """The headers without the blocks of a model in which all signals lie that have a path: they
    tell nothing of one."""
    paths = [one.split("/") for one in headers if "/" in one]
    levels = zip(*(one[:-1] for one in paths), strict=False)
    common = sum(1 for _ in takewhile(lambda names: len(set(names)) == 1, levels))
    if len(paths) < 2:
        return list(headers)
    return ["/".join(one.split("/")[common:]) if "/" in one else one for one in headers]
