"""What is wrong with a card's tables, in one line and by the names that the card uses."""

from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError

from workbench.cards.card_tables import CardFile
from workbench.cards.nearest import nearest
from workbench.cards.table import CardTable

_FAULTS = {  # what pydantic finds missing, in the words of a card
    "string_type": "a text in quotes needed",
    "float_type": "a number needed",
    "float_parsing": "a number needed",
    "int_type": "a whole number needed",
    "int_parsing": "a whole number needed",
    "int_from_float": "a whole number needed",
    "bool_type": "true or false needed",
    "bool_parsing": "true or false needed",
    "tuple_type": "a list [...] needed",
    "dict_type": "a table { key = value, ... } needed",
}
_UNIONS = {  # fields that may be of two types: pydantic names the one that it tried
    "column": "the column's name in quotes, or its number, needed",
    "gain": 'a number, or a text with its unit as "80 V/m", needed',
}


def explain(error: ValidationError) -> str:
    """The first of pydantic's errors in one line, by the names that the card uses."""
    first = error.errors(include_url=False)[0]
    union = next((part for part in first["loc"][:-1] if part in _UNIONS), None)
    loc = first["loc"][:-1] if union else first["loc"]
    where = ".".join(str(part) for part in loc if part != "function-before")
    table = f"[{where}] " if where else ""
    kind, found = first["type"], first.get("input")
    if kind == "unknown_key":
        key = str(first["msg"])
        return f"{table}unknown key {key!r}{nearest(key, _keys_at(first['loc']))}"
    if kind == "missing":
        parent = ".".join(str(part) for part in first["loc"][:-1])
        if not parent:
            return f"has no table [{first['loc'][-1]}]; add it"
        if isinstance(first["loc"][-1], int):
            return f"[{parent}] has too few values; add those that are missing"
        return f"[{parent}] has no {first['loc'][-1]!r}; add it"
    if kind == "model_type":
        keys = ", ".join(f"{key} = ..." for key in _keys_at(loc)[:2])
        return f"{table}{_shown(found)}: a table {{ {keys} }} needed"
    said = _UNIONS.get(str(union)) or _FAULTS.get(kind) or str(first["msg"])
    message = " ".join(said.removeprefix("Value error, ").split())
    shown = "" if isinstance(found, Mapping) else f"{_shown(found)}: "
    return f"{table}{shown}{message[:1].lower()}{message[1:]}"


def _shown(found: object) -> str:
    return " ".join(repr(found).split())[:60]


def _keys_at(loc: tuple[int | str, ...]) -> list[str]:
    """Keys of the section that stands at `loc`, found along the sections' fields."""
    sections: list[type[CardTable]] = [CardFile]
    for part in loc:
        found = [s.model_fields[str(part)].annotation for s in sections if part in s.model_fields]
        if found:
            sections = [inner for annotation in found for inner in _sections_in(annotation)]
        elif isinstance(part, str):
            sections = [s for s in sections if _tag(s) == part] or sections
    return [key for section in sections for key in section.model_fields]


def _sections_in(annotation: Any) -> list[type[CardTable]]:
    if isinstance(annotation, type) and issubclass(annotation, CardTable):
        return [annotation]
    parts = getattr(annotation, "__args__", ())
    return [section for part in parts for section in _sections_in(part)]


def _tag(section: type[CardTable]) -> str | None:
    field = section.model_fields.get("kind")
    tags = [str(tag) for tag in getattr(field.annotation, "__args__", ())] if field else []
    return tags[0] if len(tags) == 1 else None
