"""HTML from the templates of this folder."""

import re
from functools import cache
from typing import TYPE_CHECKING, Any

from workbench.report.symbols import explained

if TYPE_CHECKING:
    from jinja2 import Environment


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
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("workbench.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["symbols"] = with_symbols
    return environment
