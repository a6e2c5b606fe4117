"""A report as one HTML file without network: what was found, what next, a picture, the rest."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from workbench.report.symbols import explained, used_symbols

if TYPE_CHECKING:
    from jinja2 import Environment


@dataclass(frozen=True)
class Section:
    """A part of a report: its heading and its HTML."""

    title: str
    html: str


def page(title: str, lead: str, sections: Sequence[Section], then: Sequence[str] = ()) -> str:
    """The HTML of a whole report: `lead` says what was found, `then` what to do next, a line each.

    The first section is on the first screen. Scripts are in it only where a chart is.
    """
    from workbench.report.chart import chart_assets

    body = "".join(section.html for section in sections)
    # The chart's style holds the colours of both schemes, which every report uses.
    needed = chart_assets() if '<figure class="chart"' in body else {"chart.css": ""}
    styles = [
        text for name, text in chart_assets().items() if name.endswith(".css") and name in needed
    ]
    styles.append((files("workbench") / "assets/report.css").read_text("utf-8"))
    scripts = [text for name, text in needed.items() if name.endswith(".js")]
    return render(
        "page", title=title, lead=lead, then=then, sections=sections, styles=styles,
        scripts=scripts, symbols=used_symbols(lead + body + "".join(then)),
    )  # fmt: skip


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
