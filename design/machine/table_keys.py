"""Which keys a table of a card or of a result may have."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any


def keys_at(kind: Any, loc: Sequence[str | int]) -> list[str]:
    """Keys of the table that stands at `loc`, as pydantic says it, in what is read as `kind`."""
    from pydantic import TypeAdapter

    whole = TypeAdapter(kind).json_schema()
    here = [*_alternatives(whole, whole)]
    for part in loc:
        inside = [within for one in here for within in _inside(one, part)]
        here = [one for within in inside for one in _alternatives(within, whole)] or here
    return [key for one in here for key in one.get("properties", ())]


Schema = Mapping[str, Any]


def _alternatives(node: Schema, whole: Schema) -> Iterator[Schema]:
    """The schemas that a node may be of, each by itself."""
    if "$ref" in node:
        node = whole["$defs"][node["$ref"].rpartition("/")[2]]
    several = node.get("anyOf") or node.get("oneOf")
    for one in several or ():
        yield from _alternatives(one, whole)
    if not several:
        yield node


def _inside(node: Schema, part: str | int) -> Iterator[Schema]:
    """What stands in a table by that key, in a list by that number; or the table, by its kind."""
    keys = node.get("properties", {})
    if isinstance(part, int):
        yield from node.get("prefixItems", ())[part : part + 1]
        yield from [node["items"]] if "items" in node else ()
    elif part in keys:
        yield keys[part]
    elif keys.get("kind", {}).get("const") == part:
        yield node
    elif isinstance(node.get("additionalProperties"), Mapping):
        yield node["additionalProperties"]
