"""A result as everyone is shown it, made once: a terminal, a page of one HTML file without network,
a notebook and a picture. Remarks are printed once for all logs that they hold for."""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, singledispatch
from importlib import import_module
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from identification.remarks import MinorRemark
from workbench.files import REPORT_FILE
from workbench.output import OutputFolder, Step, dumps, emit, next_step, written
from workbench.remarks import Merged, merged, printed_once
from workbench.report.chart import Chart, chart_assets, chart_html
from workbench.report.templating import render, safe, used_symbols
from workbench.screen import Part, Screen, instead, screen

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False)
class Section:
    """A part of a report: its heading, and a chart, a table with lines below it, lines (merged
    remarks open up), or HTML."""

    title: str
    content: Chart | Part | Sequence[str | Merged] | str
    below: Sequence[str | Merged] = ()

    @cached_property
    def html(self) -> str:
        """What stands below the heading."""
        match self.content:
            case str():
                return self.content
            case Chart():
                return str(chart_html(self.content))
            case Part():
                return str(table(self.content, self.below))
        return render("lines", lines=self.content)


def table(part: Part, lines: Sequence[Any] = ()) -> Any:
    """The HTML of a whole table, and of lines below it; "" where it has no rows and none are."""
    if not part.whole:
        return safe(render("lines", lines=lines) if lines else "")
    return safe(render("table", head=part.full_head, rows=part.whole, lines=lines))


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


MOST_NOTES = 6


def notes(remarks: Iterable[str], logs: Collection[str] = ()) -> Part:
    """The remarks for a terminal: merged and without asides; with --verbose each as it is.

    logs: names with which a remark on one log begins.
    """
    every = tuple(remarks)
    main = printed_once((one for one in every if not isinstance(one, MinorRemark)), logs)
    shown = [one._replace(text=f"note: {one.text}") for one in report_notes(every, logs)]
    return replace(instead(_noted(main), _noted(every), MOST_NOTES, yields=True), merged=shown)


def report_notes(remarks: Iterable[str], logs: Collection[str] = ()) -> list[Merged]:
    """All remarks for a report, asides after the others; those merged with what each said."""
    return merged(sorted(remarks, key=lambda one: isinstance(one, MinorRemark)), logs)


def _noted(lines: Iterable[str]) -> list[str]:
    return [f"note: {line}" for line in lines]


@dataclass(frozen=True, eq=False)
class View:
    """A result: what was found in a sentence, what is advised next, and what stands below.

    parts: tables, lines and notes in their order. sections, chart: of the page, and the main
    picture, drawn when they are asked for. files: what the command writes, by name, a text or a
    document, and the page where it has_page. content: the document by which other programs read it,
    where it is not the first of the files.
    step: what to type next, which its command says with the names of the files at hand.
    lead: of the page, where that is another sentence.
    """

    title: str
    sentence: str
    parts: Sequence[Part | str]
    files: Mapping[str, Callable[[], Any]]
    sections: Callable[[], Sequence[Section]] = tuple
    chart: Callable[[], Chart] | None = None
    then: Sequence[str] = ()
    step: Step | None = None
    has_page: bool = True
    lead: str = ""
    content: Callable[[], Mapping[str, Any]] | None = None

    @cached_property
    def document(self) -> Mapping[str, Any]:
        """The result as plain values."""
        made: Mapping[str, Any] = (self.content or next(iter(self.files.values())))()
        return made

    @property
    def names(self) -> tuple[str, ...]:
        """The files that the command writes."""
        return (*self.files, REPORT_FILE) if self.has_page else tuple(self.files)

    def screen(self, folder: Path | None = None) -> Screen:
        """The result for a terminal; folder: where its command has written the files."""
        then = self._then if folder is None else self.then
        where = () if folder is None else (written(folder, *self.names),)
        return screen(self.sentence, *map(next_step, then), *self.parts, *where)

    @cached_property
    def drawn(self) -> Sequence[Section]:
        """The sections of the page."""
        return self.sections()

    def page(self) -> str:
        """The result as a page of HTML that needs no network."""
        return page(self.title, self.lead or self.sentence, self.drawn, self._then)

    def html(self) -> str:
        """The result for a notebook: all that a terminal shows, uncut."""
        then = "".join(f" Next: {line}." for line in self._then)
        shown = [render("lead", sentence=self.sentence + then)]
        for part in self.parts:
            if isinstance(part, str):
                shown.append(render("lines", lines=[part]))
            elif part.full_head:
                shown.append(table(part))
            elif lines := part.merged or part.whole:
                shown.append(render("lines", lines=lines))
        return "\n".join(shown)

    def figure(self) -> "Figure":
        """The main chart, a figure of matplotlib."""
        from workbench.report.chart_figure import chart_figure

        assert self.chart is not None
        return chart_figure(self.chart())

    def write(self, folder: OutputFolder, page_name: str = REPORT_FILE) -> None:
        for name, content in self.files.items():
            made = content()
            folder.write(name, made if isinstance(made, str) else dumps(made) + "\n")
        if self.has_page:
            folder.write(page_name, self.page())

    def show(self, folder: Path, then: Step | None = None, **more: object) -> None:
        """Print the result that lies in the folder: as JSON, with `more` in it, or on one screen.

        then: the command to type next.
        """
        emit({**self.document, **more, "out": folder}, lambda: self.screen(folder), then)

    @property
    def _then(self) -> list[str]:
        return [*self.then, *([f"`{self.step.command}` ({self.step.why})"] if self.step else ())]


# The module of this folder in which the builder of each result's view is registered.
BUILDERS = {
    "AxisTest": "axis_test", "Design": "reports", "Drifted": "drift", "Experiment": "experiment",
    "Identified": "reports", "Predicted": "prediction", "Responded": "response",
    "Robust": "robust", "Traced": "trace", "Validation": "validation", "VelocityDesign": "velocity",
    "VelocityModel": "velocity", "VelocityPredicted": "velocity", "VelocityTraced": "velocity",
    "VelocityValidation": "velocity",
}  # fmt: skip


@singledispatch
def view(found: Any, *context: Any) -> View:
    """The one view of a result, by its type; context: what the result does not hold itself."""
    import_module(f"workbench.report.{BUILDERS[type(found).__name__]}")
    return view.dispatch(type(found))(found, *context)
