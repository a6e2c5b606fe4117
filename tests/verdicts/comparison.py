"""The committed answers (`verdicts_today.toml`), and what an answer has changed against them."""

import json
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.verdicts.answers import NOT_IDENTIFIABLE, NOT_NAMED, Answer, Found, shortfalls
from tests.verdicts.entries import Entry, Right, Within

TODAY = Path(__file__).parents[1] / "reference" / "verdicts_today.toml"
HEAD = "# Written by `python tools/verdicts.py --write`; what is right stands in verdicts.toml.\n"
FURTHER = 0.1  # of how far a wrong number was off, by which it may be further off
DEARER = 1.3  # times the evaluations from which a trace is said to cost more


@dataclass(frozen=True)
class Committed:
    """An entry's answer when the table was written."""

    verdict: str
    effects: tuple[str, ...]
    complete: bool
    halted: bool
    evaluations: int
    short: Mapping[str, Found]


@dataclass(frozen=True)
class Change:
    """What an answer has changed: a line each for the worse and for the better, and its cost."""

    worse: tuple[str, ...]
    better: tuple[str, ...]
    cost: str = ""


def committed_of(said: Answer, right: Right) -> Committed:
    """An answer as the table keeps it."""
    short = shortfalls(said, right)
    return Committed(
        said.verdict, tuple(said.effects), said.complete, said.halted, said.evaluations, short
    )


def change(entry: Entry, now: Committed, before: Committed) -> Change:
    """What is worse (right before, or wrong in another way) and what is better than committed."""
    worse, better = list[str](), list[str]()
    for key in dict.fromkeys([*before.short, *now.short]):
        was, found = before.short.get(key), now.short.get(key)
        line = f"{key}: {_word(was)} -> {_word(found)}"
        if was is None:
            # The size of an effect that was not named at all before is a step forward.
            (better if _newly_named(key, before) else worse).append(line)
        elif found is None:
            # Nor is the size put right by an effect that is no longer named.
            if not _no_longer_named(key, now):
                better.append(line)
        elif verdict := _moved(was, found, _right_of(key, entry.right)):
            (worse if verdict == "worse" else better).append(line)
    cost = ""
    if now.halted != before.halted:
        cost = "is halted now" if now.halted else "comes to its own end now"
    elif (
        now.evaluations > DEARER * before.evaluations
        or DEARER * now.evaluations < before.evaluations
    ):
        cost = f"{before.evaluations} -> {now.evaluations} evaluations"
    return Change(tuple(worse), tuple(better), cost)


def _moved(was: Found, found: Found, right: Within | None) -> str:
    """Whether a wrong answer is "worse" or "better" now, "" where it is much the same."""
    if was == found:
        return ""
    if isinstance(was, float) and found == NOT_IDENTIFIABLE:
        return "better"
    if not (isinstance(was, float) and isinstance(found, float) and right):
        return "worse"
    before, now = right.off(was), right.off(found)
    if abs(now - before) <= FURTHER * before:
        return ""
    return "worse" if now > before else "better"


def _right_of(key: str, right: Right) -> Within | None:
    effect, _, size = key.partition(".")
    return right.effects.get(effect, {}).get(size) if size else right.parameters.get(key)


def _newly_named(key: str, before: Committed) -> bool:
    effect, _, size = key.partition(".")
    return bool(size) and before.short.get(f"effect {effect}") == NOT_NAMED


def _no_longer_named(key: str, now: Committed) -> bool:
    effect, _, size = key.partition(".")
    return bool(size) and now.short.get(f"effect {effect}") == NOT_NAMED


def _word(found: Found | None) -> str:
    if isinstance(found, float):
        return f"{found:g}"
    return "right" if found is None else str(found)


def committed(path: Path = TODAY) -> dict[str, Committed]:
    """The committed answers by name; none where the file is not there."""
    if not path.is_file():
        return {}
    raw = tomllib.loads(path.read_text(encoding="utf-8"))
    return {name: from_plain(one) for name, one in raw.items()}


def from_plain(one: Mapping[str, Any]) -> Committed:
    """An answer from what a file, or another process, has of it."""
    return Committed(
        one["verdict"], tuple(one["effects"]), one["complete"], one["halted"], one["evaluations"],
        dict(one.get("short", {})),
    )  # fmt: skip


def to_plain(one: Committed) -> dict[str, Any]:
    """The same in lists, tables, numbers and texts."""
    return {
        "verdict": one.verdict,
        "effects": list(one.effects),
        "complete": one.complete,
        "halted": one.halted,
        "evaluations": one.evaluations,
        "short": dict(one.short),
    }


def written(found: Mapping[str, Committed], order: Sequence[str]) -> str:
    """The file of the committed answers, in the order of the table."""
    parts = [HEAD]
    for name in order:
        if name not in found:
            continue
        one = to_plain(found[name])
        short = one.pop("short")
        parts.append(f"[{name}]\n" + "".join(_line(key, value) for key, value in one.items()))
        if short:
            parts.append(f"[{name}.short]\n" + "".join(_line(k, v) for k, v in short.items()))
    return "\n".join(parts)


def _line(key: str, value: object) -> str:
    """JSON's texts, numbers, lists and truth values are TOML's too."""
    quoted = key if key.replace("_", "").isalnum() else json.dumps(key)
    return f"{quoted} = {json.dumps(value)}\n"
