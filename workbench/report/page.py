"""A report as one HTML file: sections in order, no network, no script."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jinja2 import Environment


@dataclass(frozen=True)
class Section:
    """A part of a report: its heading and its HTML."""

    title: str
    html: str


def page(title: str, lead: str, sections: Sequence[Section]) -> str:
    """The HTML of a whole report."""
    return render("page", title=title, lead=lead, sections=sections)


def render(template: str, **values: Any) -> str:
    """The template `<template>.html.j2` filled in; values are escaped unless marked safe."""
    return _environment().get_template(f"{template}.html.j2").render(**values)


def safe(html: str) -> Any:
    """HTML of our own making, not to be escaped."""
    from markupsafe import Markup

    return Markup(html)


@cache
def _environment() -> "Environment":
    from jinja2 import Environment, PackageLoader, StrictUndefined

    return Environment(
        loader=PackageLoader("workbench.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
