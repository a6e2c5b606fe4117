"""Results of `design`, `validate` and `experiment`: controllers, and what a simulated loop does."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from identification.errors import BadModel
from workbench.documents.design import Design
from workbench.documents.model import Model
from workbench.interface.result import Part, Result
from workbench.steps.experiment.planned import Experiment
from workbench.steps.loop_figures import Traces
from workbench.steps.robust.robust import ROBUST, Robust
from workbench.steps.validate import Validation

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


class ControlLoop(NamedTuple):
    """Transfer functions in z, objects of python-control: F_ref = forward r - feedback y."""

    plant: Any
    feedback: Any
    forward: Any


@dataclass(frozen=True, repr=False)
class DesignResult(Result):
    """What `design` made for a model: an RST and a PID with their margins, and the compensator."""

    design: Design
    model: Model

    @property
    def document(self) -> Mapping[str, Any]:
        from workbench.documents.design_file import design_document

        return design_document(self.design)

    @property
    def recommended(self) -> str:
        """ "rst", "pid", "p-pi", or "none" where no controller keeps every goal."""
        return self.design.recommended

    def to_control(self, name: str | None = None) -> ControlLoop:
        """Plant and controller as transfer functions of python-control, for loops and Bode plots.

        name: "rst", "pid" or "p-pi", by default the recommended. Raises BadModel where there is
        none of that name.
        """
        from design.convert import controller_to_control, to_control

        wanted = name or self.design.recommended
        there = self.design.controllers
        if wanted not in there:
            raise BadModel(f"no controller {wanted!r}; name one that is there ({', '.join(there)})")
        plant = self.design.plant
        feedback, forward = controller_to_control(there[wanted].rst)
        return ControlLoop(to_control(plant.A, plant.B, plant.h), feedback, forward)

    def report(self) -> str:
        from workbench.report.reports import design_report

        return design_report(self.design, self.model.rotary)

    def plot(self) -> "Figure":
        from workbench.report.chart_figure import chart_figure
        from workbench.report.controllers import step_chart

        return chart_figure(step_chart(self.design))

    def _view(self) -> object:
        from workbench.report.design_tables import design_view

        return design_view(self.design, None, self.model.rotary)

    def _told(self) -> tuple[str, Sequence[Part]]:
        from workbench.report.design_tables import (
            DESIGN_HEAD,
            design_lines,
            design_sentence,
            margin_rows,
        )

        lines = design_lines(self.design, self.model.rotary)
        return design_sentence(self.design), [Part(DESIGN_HEAD, margin_rows(self.design), lines)]

    def _files(self) -> Iterator[tuple[str, str]]:
        yield "design.json", self.to_json() + "\n"
        yield "report.html", self.report()

    @property
    def _command(self) -> str:
        return "design"


@dataclass(frozen=True, repr=False)
class RobustResult(Result):
    """A design chosen over the machines drawn from a model, and what it promises of them."""

    found: Robust
    model: Model

    @property
    def design(self) -> DesignResult:
        """The design itself, as `validate` and `export` take it."""
        return DesignResult(self.found.design, self.model)

    @property
    def passed(self) -> bool:
        """Whether each limit is kept with the probability asked for."""
        return self.found.passed

    @property
    def document(self) -> Mapping[str, Any]:
        from workbench.steps.robust.document import robust_document

        return robust_document(self.found)

    @property
    def frame(self) -> "pd.DataFrame":
        """Every measure of the robust loop on every machine drawn, a row a machine."""
        import pandas as pd

        return pd.DataFrame(dict(self.found.promises[ROBUST].found.values))

    def report(self) -> str:
        from workbench.report.robust import robust_report

        return robust_report(self.found, self.model.rotary)

    def plot(self) -> "Figure":
        from workbench.report.robust import robust_figure

        return robust_figure(self.found, self.model.rotary)

    def _view(self) -> object:
        from workbench.report.robust import robust_view

        return robust_view(self.found, None, self.model.rotary)

    def _told(self) -> tuple[str, Sequence[Part]]:
        from workbench.report.robust import (
            BESIDE_HEAD,
            ROBUST_HEAD,
            beside_rows,
            promise_rows,
            robust_lines,
            robust_sentence,
        )

        rotary = self.model.rotary
        return robust_sentence(self.found), [
            Part(ROBUST_HEAD, promise_rows(self.found, rotary), robust_lines(self.found, rotary)),
            Part(BESIDE_HEAD, beside_rows(self.found, rotary), []),
        ]

    def _files(self) -> Iterator[tuple[str, str]]:
        yield "design.json", self.design.to_json() + "\n"
        yield "robust.json", self.to_json() + "\n"
        yield "report.html", self.report()

    @property
    def _command(self) -> str:
        return "design"


@dataclass(frozen=True, repr=False)
class ValidateResult(Result):
    """What `validate` saw of a design in the simulated loop."""

    found: Validation
    traces: Mapping[tuple[str, str], Traces]
    rotary: bool = False

    @property
    def passed(self) -> bool:
        """Whether the judged controller keeps every limit on every plant."""
        return self.found.passed

    @property
    def document(self) -> Mapping[str, Any]:
        from workbench.steps.validate import validation_document

        return validation_document(self.found)

    def report(self) -> str:
        from workbench.report.reports import validation_report

        return validation_report(self.found, self.traces, self.rotary)

    def plot(self) -> "Figure":
        from workbench.report.chart_figure import chart_figure
        from workbench.report.loop import step_chart

        return chart_figure(step_chart(self.found, self.traces, "model", self.rotary))

    def _view(self) -> object:
        from workbench.report.validation_tables import validation_view

        return validation_view(self.found, None, self.rotary)

    def _told(self) -> tuple[str, Sequence[Part]]:
        from workbench.report.validation_tables import (
            validation_head,
            validation_lines,
            validation_rows,
            validation_verdict,
        )

        rows = validation_rows(self.found, self.rotary)
        lines = validation_lines(self.found, self.rotary)
        return f"{validation_verdict(self.found)}.", [
            Part(validation_head(self.found, self.rotary), rows, lines)
        ]

    def _files(self) -> Iterator[tuple[str, str]]:
        yield "validation.json", self.to_json() + "\n"
        yield "report.html", self.report()

    @property
    def _command(self) -> str:
        return "validate"


@dataclass(frozen=True, repr=False)
class ExperimentResult(Result):
    """The run to make next, and what it promises."""

    found: Experiment

    @property
    def document(self) -> Mapping[str, Any]:
        from workbench.steps.experiment.planned import experiment_document

        return experiment_document(self.found)

    @property
    def frame(self) -> "pd.DataFrame":
        """The reference: t [s] and r, a row a sample of the controller."""
        import pandas as pd

        r = self.found.r
        return pd.DataFrame({"t": self.found.h * np.arange(len(r)), "r": r})

    def report(self) -> str:
        from workbench.report.experiment import experiment_report

        return experiment_report(self.found)

    def plot(self) -> "Figure":
        from workbench.report.experiment import experiment_figure

        return experiment_figure(self.found)

    def _view(self) -> object:
        from workbench.report.experiment import experiment_view

        return experiment_view(self.found, None)

    def _told(self) -> tuple[str, Sequence[Part]]:
        from workbench.report.experiment import (
            PROMISE_HEAD,
            experiment_lead,
            experiment_lines,
            promise_rows,
        )

        rows, lines = promise_rows(self.found), experiment_lines(self.found)
        return experiment_lead(self.found), [Part(PROMISE_HEAD, rows, lines)]

    def _files(self) -> Iterator[tuple[str, str]]:
        from workbench.report.experiment import reference_text

        yield "reference.csv", reference_text(self.found)
        yield "experiment.json", self.to_json() + "\n"
        yield "report.html", self.report()

    @property
    def _command(self) -> str:
        return "experiment"
