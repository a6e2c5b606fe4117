"""A result of a function of Python: it shows, draws and writes itself.

It holds the value that the command of its name writes, and its JSON is the command's own document.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from workbench.interface.inputs import PathLike
from workbench.output import OutputFolder, dumps
from workbench.report.view import View

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, repr=False)
class Result(ABC):
    """What every result can: show itself as text and HTML, draw, and write the command's files."""

    _command: ClassVar[str]

    @abstractmethod
    def _made(self) -> View:
        """How the result is shown."""

    @cached_property
    def view(self) -> View:
        """The result as terminal, page, notebook and picture show it."""
        return self._made()

    @property
    def document(self) -> Mapping[str, Any]:
        """The document that the command writes, as plain values."""
        return self.view.document

    def to_json(self) -> str:
        """The document as strict JSON, letter for letter what the command writes."""
        return dumps(self.document)

    def report(self) -> str:
        """The report as one HTML page, as the command writes it."""
        return self.view.page()

    def plot(self) -> "Figure":
        """The main chart, a figure of matplotlib."""
        return self.view.figure()

    def save(self, out: PathLike | None = None) -> Path:
        """The folder that now holds the command's files: `out`, or runs/<time>-<command>."""
        folder = None if out is None else Path(out)
        with OutputFolder(self._command, folder, now=datetime.now()) as target:
            self.view.write(target)
        return target.final

    def __repr__(self) -> str:
        return self.view.screen().text(rest="report()").rstrip()

    def _repr_html_(self) -> str:
        return self.view.html()
