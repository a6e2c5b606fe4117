"""Remarks that say the same of several logs, printed once with a count."""

import re
from collections.abc import Collection, Iterable, Sequence
from typing import NamedTuple

FIGURE = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\w.]*\w)")
# When and where in its log: printed with one remark, left out where several differ in it.
PLACE = re.compile(
    r",? (?:(?:at|from) )?t = \S+ s(?: to \S+ s)?"
    r"|,? first in row \d+|,? in row \d+(?:, t = \S+ s)?"
)
HOLE = "\0"


class Merged(NamedTuple):
    """What one or several remarks say, in one line, and the remarks."""

    text: str
    of: tuple[str, ...]


def merged(remarks: Iterable[str], logs: Collection[str] = ()) -> list[Merged]:
    """The remarks in their order, those that differ only by log and numbers as one with a count.

    logs: names with which a remark on one log begins, as in "a.csv: uneven clock". Of several, the
    count stands in their place ("13 logs: uneven clock"), a number that differs is a range, and
    where in its log something is falls away.
    """
    groups: dict[tuple[str, ...], list[str]] = {}
    for one in remarks:
        log, said = _of_log(one, logs)
        alike = (one,) if log is None else ("", FIGURE.sub(HOLE, PLACE.sub("", said)))
        groups.setdefault(alike, []).append(one)
    return [Merged(_together(group, logs), tuple(group)) for group in groups.values()]


def printed_once(remarks: Iterable[str], logs: Collection[str] = ()) -> list[str]:
    """The lines of `merged`."""
    return [one.text for one in merged(remarks, logs)]


def _of_log(remark: str, logs: Collection[str]) -> tuple[str | None, str]:
    """The log with which a remark begins, None of another one; and what is said of it."""
    fitting = [name for name in logs if remark.startswith(f"{name}: ")]
    if not fitting:
        return None, remark
    name = max(fitting, key=len)
    return name, remark[len(name) + 2 :]


def _together(remarks: Sequence[str], logs: Collection[str]) -> str:
    if len(remarks) == 1 or len(set(remarks)) == 1:
        return remarks[0]
    pairs = [_of_log(one, logs) for one in remarks]
    names = dict.fromkeys(name for name, _ in pairs)
    said = [text for _, text in pairs]
    if len(set(said)) > 1:
        said = [PLACE.sub("", text) for text in said]
    head = f"{len(names)} logs" if len(names) > 1 else f"{next(iter(names))}"
    if len(remarks) > len(names):
        head += f", {len(remarks)} times"
    return f"{head}: {_ranges(said)}"


def _ranges(texts: Sequence[str]) -> str:
    """The texts, alike but for their numbers, as one: a range where a number differs."""
    columns = zip(*(FIGURE.findall(text) for text in texts), strict=True)
    ranges = iter([_range(column) for column in columns])
    return FIGURE.sub(lambda _: next(ranges), texts[0])


def _range(numbers: Sequence[str]) -> str:
    low, high = min(numbers, key=float), max(numbers, key=float)
    return low if low == high else f"{low} to {high}"
