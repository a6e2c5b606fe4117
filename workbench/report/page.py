"""A report as one HTML file without network: what was found, what next, a picture, the rest."""

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

from workbench.report.chart import chart_assets
from workbench.report.templating import render, safe, used_symbols
from workbench.screen import Part


@dataclass(frozen=True)
class Section:
    """A part of a report: its heading and its HTML."""

    title: str
    html: str


def table(part: Part, lines: Sequence[Any] = ()) -> Any:
    """The HTML of a whole table, and of lines below it; "" where it has no rows and none are."""
    if not part.whole:
        return safe(render("lines", lines=lines) if lines else "")
    return safe(render("table", head=part.full_head, rows=part.whole, lines=lines))


def table_section(title: str, part: Part, lines: Sequence[Any] = ()) -> Section:
    """A section that is a table."""
    return Section(title, table(part, lines))


def lines_section(title: str, lines: Sequence[Any]) -> Section:
    """A section of lines; merged remarks open up."""
    return Section(title, render("lines", lines=lines))


def page(title: str, lead: str, sections: Sequence[Section], then: Sequence[str] = ()) -> str:
    """The HTML of a whole report: `lead` says what was found, `then` what to do next, a line each.

    The first section is on the first screen. Scripts are in it only where a chart is.
    """
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
