"""The Sphinx extension of the site: pages that are run, and pages that the code writes.

Before the build it writes `made/` (card, effects, commands, from the code as it is) and runs the
pages of `docs/`. A link `](made-by-page:FILE)` leads to a file that the page's blocks have made.
"""

import re
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any, cast

from docutils import nodes
from docutils.utils.math import latex2mathml
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError

from docs._ext import card_page, command_pages, effect_pages
from docs._ext.docstrings import as_restructured_text
from docs._ext.postgres import registry_url
from docs._ext.session import PageFault, Pages

MADE = re.compile(r"\]\(made-by-page:([\w./-]+)\)")
LOADED = re.compile(
    r"<(?:script|img|iframe|link rel=.(?:stylesheet|preload|icon).)[^>]*?"
    r"(?:src|href)=.((?:https?:)?//[^\s>]+)"
)
FOLDER = "made"  # of generated pages and files, never committed


def setup(app: Sphinx) -> dict[str, Any]:
    """Called by Sphinx."""
    app.add_config_value("run_pages", True, "env")
    app.connect("builder-inited", _make)
    app.connect("source-read", _insert_outputs)
    app.connect("autodoc-process-docstring", as_restructured_text)
    app.connect("sphinx-click-process-description", _click_lines)
    app.connect("sphinx-click-process-epilog", _example)
    app.connect("build-finished", _refuse_network)
    app.add_html_math_renderer("native", (_inline_math, None), (_displayed_math, None))
    return {"version": "1", "parallel_read_safe": False}


def _make(app: Sphinx) -> None:
    """Write the generated pages and run the others."""
    home = Path(app.srcdir)
    made = home / FOLDER
    shutil.rmtree(made, ignore_errors=True)
    for name, text in _generated(made):
        path = made / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, "utf-8")
    if not app.config.run_pages:
        return
    with ExitStack() as stack:
        work = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="pages-")))
        url = stack.enter_context(registry_url())
        pages = Pages(home, work, {"POSTGRES": url})
        try:
            pages.run()
        except PageFault as fault:
            raise ExtensionError(str(fault)) from None
        for name in pages.printed:
            _keep(pages, name, made / "files" / name)
    app.printed_pages = pages  # type: ignore[attr-defined]


def _generated(made: Path) -> Iterator[tuple[str, str]]:
    """Names and texts of the pages that the code writes; pictures go to the folder `made`."""
    yield "card.md", card_page.page()
    yield from command_pages.pages()
    yield from effect_pages.pages(made / "effects")


def _keep(pages: Pages, name: str, place: Path) -> None:
    """Copy the files to which the page links out of its folder."""
    for file in MADE.findall(pages.source(name)):
        found = pages.folder(name) / file
        if not found.is_file():
            raise ExtensionError(f"{name}.md links to {file}, which its blocks do not make")
        (place / file).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(found, place / file)


def _insert_outputs(app: Sphinx, name: str, source: list[str]) -> None:
    """Below each block of a page what it printed; links to what it made."""
    pages = cast(Pages | None, getattr(app, "printed_pages", None))
    if pages is None or name not in pages.printed:
        return
    shown = pages.shown(name, source[0])
    source[0] = MADE.sub(lambda link: f"](/{FOLDER}/files/{name}/{link[1]})", shown)


def _click_lines(app: Sphinx, ctx: object, lines: list[str]) -> None:
    as_restructured_text(app, "click", "", ctx, {}, lines)


def _example(app: Sphinx, ctx: object, lines: list[str]) -> None:
    """The example of a command's help as code."""
    lines[:] = [re.sub(r"^(\s*Example: )(.+)$", r"\1``\2``", line) for line in lines]


def _refuse_network(app: Sphinx, failed: Exception | None) -> None:
    """Raises ExtensionError where a page would load something from a network."""
    for page in [] if failed else Path(app.outdir).rglob("*.html"):
        found = LOADED.search(page.read_text("utf-8"))
        if found:
            raise ExtensionError(f"{page.name} loads {found[1]}; keep it in the site")


def _inline_math(translator: Any, node: nodes.math) -> None:
    translator.body.append(_mathml(node.astext(), displayed=False))
    raise nodes.SkipNode


def _displayed_math(translator: Any, node: nodes.math_block) -> None:
    translator.body.append(f'<p class="equation">{_mathml(node.astext(), displayed=True)}</p>')
    raise nodes.SkipNode


def _mathml(text: str, *, displayed: bool) -> str:
    """The formula as browsers draw it themselves, so that no page needs a network for it."""
    return "".join(latex2mathml.tex2mathml(text, as_block=displayed).split("\n"))
