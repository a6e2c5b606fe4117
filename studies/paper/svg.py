"""Figures of the study's report: small inline SVG in the colours of the page."""

import io
import re
from html import escape
from typing import TYPE_CHECKING, Any

from workbench.report.chart_figure import BAND, GREY, MODEL, OTHER, REFERENCE
from workbench.report.templating import safe

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# The colours of the pages' style in place of the figures'.
SCHEME = {
    "#000000": "var(--measured)",
    MODEL: "var(--model)",
    REFERENCE: "var(--reference)",
    OTHER: "var(--other)",
    BAND: "var(--band)",
    GREY: "var(--before)",
    "#ffffff": "var(--paper)",
    "#dddddd": "var(--grid)",
}


def inline(drawn: "Figure", name: str, description: str) -> str:
    """The figure as inline SVG with a description; `name` keeps ids apart on a page."""
    import matplotlib as mpl

    out = io.StringIO()
    with mpl.rc_context({"svg.hashsalt": name}):
        drawn.savefig(out, format="svg", dpi=110, metadata={"Date": None, "Creator": None})
    text = out.getvalue()
    # Group ids repeat from figure to figure and nothing refers to them.
    svg = re.sub(r'<g id="[^"]*"', "<g", text[text.index("<svg") :])
    svg = re.sub(r'<svg [^>]*?(viewBox="[^"]*")', r"<svg \1", svg, count=1)
    # Colours follow the page's scheme, light or dark.
    svg = re.sub("|".join(SCHEME), lambda found: SCHEME[found[0]], svg)
    return svg.replace("<svg ", f'<svg role="img" aria-label="{description}" ', 1)


def picture(svg: str, caption: str) -> Any:
    """The HTML of an inline figure with its caption."""
    said = f"<figcaption>{escape(caption)}</figcaption>"
    return safe(f'<figure class="picture">\n{svg}\n{said}\n</figure>')
