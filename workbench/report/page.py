"""A report as one HTML file without network: what was found, what next, a picture, the rest."""

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files

from workbench.report.chart import chart_assets
from workbench.report.symbols import used_symbols
from workbench.report.templating import render


@dataclass(frozen=True)
class Section:
    """A part of a report: its heading and its HTML."""

    title: str
    html: str


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
