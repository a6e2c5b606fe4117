"""Plain JSON read back into frozen dataclasses, one line where it does not fit."""

import json
from collections.abc import Mapping
from typing import Any, TypeVar

from design.machine.codec import OF_OURS, PLACEHOLDER, UNKNOWN_KEY
from design.machine.nearest import nearest
from design.machine.table_keys import keys_at
from identification.errors import BadModel

Value = TypeVar("Value")


def validated(raw: Mapping[str, Any], called: str, kind: type[Value], around: Any = None) -> Value:
    """The value that a JSON object holds; called: by messages; around: what
    units of its numbers hang on.

    Raises BadModel, one line: file, key, what was found and needed; an unknown key comes with the
    nearest right one.
    """
    from pydantic import TypeAdapter, ValidationError

    try:
        return TypeAdapter(kind).validate_json(
            json.dumps(raw), strict=True, extra="forbid", context=around
        )
    except ValidationError as error:
        every = [dict(one) for one in error.errors(include_url=False)]
        # What is no such file at all comes before a number that is refused.
        first = min(every, key=lambda one: (one["type"] != UNKNOWN_KEY, one["type"] == OF_OURS))
        raise BadModel(f"{called}: {_explained(first, kind)}") from None
    except BadModel as error:
        raise BadModel(f"{called}: {error}") from None


def _explained(first: Mapping[str, Any], kind: Any) -> str:
    loc = [str(part) for part in first["loc"]]
    table = f"[{'.'.join(loc[:-1])}] " if loc[:-1] else ""
    if first["type"] == OF_OURS:
        return str(first["msg"]).replace(PLACEHOLDER, ".".join(loc))
    if first["type"] == UNKNOWN_KEY:
        return f"{table}unknown key {loc[-1]!r}{nearest(loc[-1], keys_at(kind, first['loc'][:-1]))}"
    if first["type"] in ("missing", "missing_argument"):
        return f"{table}has no {loc[-1]!r}; add it, or run the command again"
    where = f"[{'.'.join(loc)}] " if loc else ""
    message = " ".join(str(first["msg"]).removeprefix("Value error, ").split())
    return f"{where}{brief(first.get('input'))}: {message[:1].lower()}{message[1:]}"


def brief(value: object) -> str:
    """The value in one line of bounded length."""
    return " ".join(repr(value).split())[:60]
