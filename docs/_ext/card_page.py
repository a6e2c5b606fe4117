"""The page on cards: every table and key of a card, out of the models that read it."""

import ast
import inspect
import textwrap
from collections.abc import Iterable, Iterator
from typing import Any, Literal, get_args, get_origin

from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined
from sphinx.errors import ExtensionError

from design.machine.card_table import CardTable
from workbench.cards.card_tables import CardFile

HEAD = """# The card, key by key

A card is one machine in a TOML file, and how its logs are to be read. `workbench init LOG` writes
the first one; this page is made of the models that read it, so it is complete. A key that is not
here is refused with the nearest that is. How the parts fit together stands in
[the contract](../contract.md#card-cardtoml), and shipped cards lie in `datasets/`.

"""
WORDS = {float: "number", int: "whole number", str: "text", bool: "true or false"}
ENTRIES = {"files": "[[files]]", "signals": "[signals]", "split": "[split]"}


def page() -> str:
    """The page in Markdown; raises ExtensionError where a key does not say what it is."""
    parts, texts = [HEAD], _texts(CardFile)
    for name, field in CardFile.model_fields.items():
        parts.append(f"## {ENTRIES.get(name, f'[{name}]')}\n\n{_sentence(texts.get(name, ''))}\n")
        parts += _tables(name, field.annotation, frozenset())
    return "\n".join(parts)


def _tables(path: str, annotation: Any, seen: frozenset[type]) -> Iterator[str]:
    """The tables at a key, one a kind, and those in them; what all kinds share stands once."""
    found = [one for one in _sections(annotation) if one not in seen]
    shared: set[str] = set()
    if len(found) > 1:
        shared = set.intersection(*(set(one.model_fields) for one in found)) - {"kind"}
    if shared:
        yield _table(found[0], sorted(shared, key=list(found[0].model_fields).index))
    for section in found:
        if len(found) > 1:
            yield f"### {path}, kind = {_tag(section)}\n"
        elif "." in path:
            yield f"### {path}\n"
        law = _texts(section).get("kind")
        if law and len(found) > 1:
            yield f"`{law}`\n" if "(" in law or "=" in law else f"{_sentence(law)}\n"
        own = [name for name in section.model_fields if name not in shared]
        yield _table(section, [one for one in own if one != "kind" or len(found) == 1])
        for name in own if section is not found[0] else section.model_fields:
            inner = section.model_fields[name].annotation
            yield from _tables(f"{path}.{name}", inner, seen | {section})


def _table(section: type[CardTable], names: Iterable[str]) -> str:
    """These keys of a section."""
    texts = _texts(section)
    rows = ["| key | value | without it | what it is |", "|---|---|---|---|"]
    for name in names:
        field = section.model_fields[name]
        if not texts.get(name):
            raise ExtensionError(f"{section.__name__}.{name}: no text below it says what it is")
        value = _value(field.annotation) + _bound(field.metadata)
        rows.append(f"| `{name}` | {value} | {_default(field)} | {texts[name]} |")
    return "\n".join(rows) + "\n"


def _default(field: FieldInfo) -> str:
    """What counts where the key is left out."""
    if field.is_required():
        return "needed"
    value = field.default
    if value in (None, "", (), PydanticUndefined) or isinstance(value, CardTable):
        return "–"
    return f"`{str(value).lower()}`" if isinstance(value, bool) else f"`{value}`"


def _value(annotation: Any) -> str:
    """What a key takes, in words."""
    origin, parts = get_origin(annotation), get_args(annotation)
    if origin is Literal:
        return ", ".join(f'`"{one}"`' for one in parts)
    if hasattr(annotation, "__metadata__") and not _sections(annotation):
        return _value(annotation.__origin__) + _bound(annotation.__metadata__)
    if origin is tuple:
        return "tables" if _sections(annotation) else f"list of {_value(parts[0])}s"
    if origin is dict or _sections(annotation):
        return "table"
    if parts:
        return " or ".join(dict.fromkeys(_value(one) for one in parts if one is not type(None)))
    return WORDS.get(annotation, "tables")  # a section named ahead of its definition


def _bound(metadata: Iterable[Any]) -> str:
    """The least value that a number may have."""
    for one in metadata:
        for limit in (one, *getattr(one, "metadata", ())):
            if getattr(limit, "gt", None) is not None:
                return f" > {limit.gt:g}"
            if getattr(limit, "ge", None) is not None:
                return f" >= {limit.ge:g}"
    return ""


def _sections(annotation: Any) -> list[type[CardTable]]:
    if isinstance(annotation, type) and issubclass(annotation, CardTable):
        return [annotation]
    return [one for part in get_args(annotation) for one in _sections(part)]


def _tag(section: type[CardTable]) -> str | None:
    field = section.model_fields.get("kind")
    tags = get_args(field.annotation) if field else ()
    return f'"{tags[0]}"' if len(tags) == 1 else None


def _texts(section: type[CardTable]) -> dict[str, str]:
    """What stands below each field of the section and of those that it is made from."""
    found: dict[str, str] = {}
    for one in reversed(section.__mro__):
        if not (issubclass(one, CardTable) and one is not CardTable):
            continue
        (body,) = ast.parse(textwrap.dedent(inspect.getsource(one))).body
        assert isinstance(body, ast.ClassDef)
        for field, text in zip(body.body, body.body[1:], strict=False):
            match field, text:
                case (
                    ast.AnnAssign(target=ast.Name(id=name)),
                    ast.Expr(value=ast.Constant(value=str(words))),
                ):
                    found[name] = " ".join(words.split())
    return found


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}." if text else ""
