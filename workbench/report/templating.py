"""HTML from this folder's templates; symbols in words: on hover, and in a legend at the end."""

import re
import tomllib
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from workbench.output import templates

if TYPE_CHECKING:
    from jinja2 import Environment

MEANINGS = tomllib.loads((files("workbench.report") / "meanings.toml").read_text("utf-8"))
SYMBOLS: Mapping[str, str] = MEANINGS["symbols"]
# A name of one letter is a symbol only where it stands alone in a cell.
_SYMBOL_NAMES = "|".join(
    re.escape(name) for name in sorted(SYMBOLS, key=len, reverse=True) if name != "m"
)
_SYMBOL = re.compile(rf"(?<![\w/.\-])({_SYMBOL_NAMES})(?![\w/]|\.\w)")
_ALONE = re.compile(r">m</td>|>m</th>|>m</abbr>")


def explained(html: str) -> str:
    """Escaped text in which each symbol carries its meaning, shown on hover."""
    if html.strip() == "m":
        return _abbreviated("m")
    return _SYMBOL.sub(lambda found: _abbreviated(found[1]), html)


def _abbreviated(name: str) -> str:
    return f'<abbr title="{SYMBOLS[name]}">{name}</abbr>'


def used_symbols(html: str) -> list[tuple[str, str]]:
    """The symbols in a page's HTML and what they mean, in the order of the table above."""
    visible = re.sub(r"<script.*?</script>", "", html, flags=re.DOTALL)
    used = {*_SYMBOL.findall(visible), *(["m"] if _ALONE.search(visible) else [])}
    return [(name, meaning) for name, meaning in SYMBOLS.items() if name in used]


def render(template: str, **values: Any) -> str:
    """The template `<template>.html.j2` filled in; values are escaped unless marked safe."""
    return _environment().get_template(f"{template}.html.j2").render(**values)


def safe(html: str) -> Any:
    """HTML of our own making, not to be escaped."""
    from markupsafe import Markup

    return Markup(html)


def with_symbols(text: str) -> Any:
    """The text escaped, its symbols with their meaning, what stands in `...` as a command."""
    from markupsafe import escape

    return safe(re.sub(r"`([^`]+)`", r"<code>\1</code>", explained(str(escape(text)))))


@cache
def _environment() -> "Environment":
    environment = templates("workbench.report")
    environment.filters["symbols"] = with_symbols
    return environment
