"""A card written by a program, with a remark on each line."""

import json
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

LONGEST_REMARK = 150  # characters on a line; what is longer goes on below it


@dataclass(frozen=True)
class Line:
    """A key of a table, its value as TOML (None: left out, for the reader to fill in) and a
    remark."""

    key: str
    value: object
    remark: str = ""


def card_text(
    head: Iterable[str], tables: Mapping[str, Sequence[Line]], tail: Iterable[str]
) -> str:
    """The card as TOML: `head` and `tail` are remarks around the tables."""
    parts = [f"# {_one_line(line)}" for line in head]
    for name, lines in tables.items():
        parts += ["", f"[{name}]"]
        width = max((len(one.key) for one in lines), default=0)
        parts += [_line(one, width) for one in lines]
    remarks = [f"# {_one_line(line)}" for line in tail]
    return "\n".join([*parts, *([""] if remarks else []), *remarks]) + "\n"


def _line(one: Line, width: int) -> str:
    said = textwrap.wrap(_one_line(one.remark), LONGEST_REMARK)
    remark = "  # " + "\n#     ".join(said) if said else ""
    if one.value is None:
        return f"# {one.key} = ...{remark}"
    return f"{one.key:{width}} = {toml(one.value)}{remark}"


def toml(value: Any) -> str:
    """A value in TOML: text, number, truth value, list, or a table on one line."""
    match value:
        case bool():
            return "true" if value else "false"
        case str():
            return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
        case int():
            return str(value)
        case float():
            return repr(value)
        case Mapping():
            return "{ " + ", ".join(f"{key} = {toml(one)}" for key, one in value.items()) + " }"
        case _:
            return "[" + ", ".join(toml(one) for one in value) + "]"


def _one_line(text: str) -> str:
    """The text without what no remark may hold."""
    return "".join(c if c.isprintable() else " " for c in " ".join(text.split()))
