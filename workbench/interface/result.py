"""A result of a function of Python: it shows, draws and writes itself.

It holds the value that the command of its name writes, and its JSON is the command's own document.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from workbench.interface.inputs import PathLike
from workbench.output import OutputFolder, Row, as_text, dumps
from workbench.screen import Screen

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Part(NamedTuple):
    """A table of a result and lines below it."""

    head: Sequence[str]
    rows: Sequence[Row]
    lines: Sequence[str] = ()


@dataclass(frozen=True, repr=False)
class Result(ABC):
    """What every result can: show itself as text and HTML, draw, and write the command's files."""

    @property
    @abstractmethod
    def document(self) -> Mapping[str, Any]:
        """The document that the command writes, as plain values."""

    @abstractmethod
    def report(self) -> str:
        """The report as one HTML page, as the command writes it."""

    @abstractmethod
    def _view(self) -> object:
        """What the command shows on a terminal."""

    @abstractmethod
    def _told(self) -> tuple[str, Sequence[Part]]:
        """The result in a sentence, and its tables."""

    @abstractmethod
    def _files(self) -> Iterator[tuple[str, str]]:
        """Names and texts of the files that the command writes."""

    @property
    @abstractmethod
    def _command(self) -> str: ...

    def to_json(self) -> str:
        """The document as strict JSON, letter for letter what the command writes."""
        return dumps(self.document)

    @abstractmethod
    def plot(self) -> "Figure":
        """The telling picture, a figure of matplotlib."""

    def save(self, out: PathLike | None = None) -> Path:
        """The folder that now holds the command's files: `out`, or runs/<time>-<command>."""
        folder = None if out is None else Path(out)
        with OutputFolder(self._command, folder, now=datetime.now()) as target:
            for name, text in self._files():
                target.write_text(name, text)
        return target.final

    def __repr__(self) -> str:
        view = self._view()
        shown = view.text(rest="report()") if isinstance(view, Screen) else as_text(view)
        return shown.rstrip()

    def _repr_html_(self) -> str:
        from workbench.report.templating import render

        sentence, parts = self._told()
        shown = [render("lead", sentence=sentence)]
        for part in parts:
            if part.rows:
                shown.append(render("table", head=part.head, rows=part.rows, lines=part.lines))
            elif part.lines:
                shown.append(render("lines", lines=part.lines))
        return "\n".join(shown)
