"""Results that hold the model of a machine: of `identify` and `trace`."""

import importlib
import warnings
from abc import abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from identification.errors import BadModel, UserError
from identification.model.estimates import Estimate
from workbench.cards.card import Card
from workbench.documents.model import Model
from workbench.interface.result import Part, Result
from workbench.output import dumps
from workbench.steps.identify_sources import Identified
from workbench.steps.trace import Traced

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


class MissingLibrary(UserError):
    """A library that an extra brings is not installed."""


@dataclass(frozen=True, repr=False)
class _OfModel(Result):
    """A result that holds the model of a machine; `card` by which its logs were read."""

    card: Card

    @property
    @abstractmethod
    def model(self) -> Model:
        """The model of the machine, in SI."""

    @property
    def parameters(self) -> "pd.DataFrame":
        """Value, unit, deviation and 95 % interval of each parameter, or why there is none."""
        import pandas as pd

        effects = {
            f"{key}.{name}": one
            for key, found in self.model.effects.items()
            for name, one in found.items()
        }
        every: dict[str, Estimate] = {
            **self.model.friction,
            **(self.model.actuator or {}),
            **effects,
        }
        columns = ("value", "unit", "sd", "low", "high", "reason")
        rows = {name: [getattr(one, key) for key in columns] for name, one in every.items()}
        return pd.DataFrame.from_dict(rows, orient="index", columns=list(columns))

    def to_control(self, period: float | None = None) -> Any:
        """The linear plant from force to position on which a design is made, of python-control.

        period [s]: by default as for a design. Raises NotIdentifiable where the model carries none.
        """
        from design.convert import to_control
        from workbench.steps.linear_loop import linear_of

        plant, _ = linear_of(self.model, None, period)
        return to_control(plant.A, plant.B, plant.h)


@dataclass(frozen=True, repr=False)
class IdentifyResult(_OfModel):
    """What `identify` found: the model, and the fit that it comes from."""

    found: Identified

    @property
    def model(self) -> Model:
        return self.found.model

    @property
    def document(self) -> Mapping[str, Any]:
        from workbench.documents.model_file import model_document

        return model_document(self.model)

    @property
    def remarks(self) -> tuple[str, ...]:
        """What to know of the logs and the fit, a line each."""
        return (*self.found.remarks, *self.model.fit.remarks)

    def to_arviz(self) -> Any:
        """The posterior as arviz.InferenceData, a chain an independent ensemble.

        An effect's parameters are named as key.name. Attributes: units, verdict, converged.
        Raises BadModel where none was sampled, MissingLibrary without arviz.
        """
        walk = self.found.walk
        if walk is None:
            raise BadModel("no posterior was sampled; call identify(..., posterior=True)")
        arviz = _arviz()
        posterior = {name: walk.chains[:, :, k] for k, name in enumerate(walk.names)}
        units = {name: self.found.fit.estimates[name].unit for name in walk.names}
        said = {"units": str(units), "verdict": walk.verdict, "converged": int(walk.converged)}
        return arviz.from_dict(posterior=posterior, attrs=said)

    def report(self) -> str:
        from workbench.report.reports import identification_report

        return identification_report(self.found)

    def plot(self) -> "Figure":
        from workbench.report.chart_figure import chart_figure
        from workbench.report.fit import fit_chart
        from workbench.steps.predict import fitted_run

        sources = self.found.sources
        runs = [fitted_run(self.model, one.log, number) for number, one in enumerate(sources)]
        return chart_figure(fit_chart(self.model, sources, runs))

    def _view(self) -> object:
        from workbench.report.model_tables import model_view

        return model_view(self.model, self.found.remarks, None)

    def _told(self) -> tuple[str, Sequence[Part]]:
        from workbench.report.model_tables import (
            MODEL_HEAD,
            fit_lines,
            logs_of,
            parameter_rows,
            plant_lines,
            summary,
        )
        from workbench.report.notes import report_notes

        rows = [row[:4] for row in parameter_rows(self.model)]
        said = (*fit_lines(self.model), *plant_lines(self.model), *self.remarks)
        lines = [one.text for one in report_notes(said, logs_of(self.model))]
        return summary(self.model), [Part(MODEL_HEAD, rows, lines)]

    def _files(self) -> Iterator[tuple[str, str]]:
        yield "model.json", self.to_json() + "\n"
        yield "report.html", self.report()

    @property
    def _command(self) -> str:
        return "identify"


@dataclass(frozen=True, repr=False)
class TraceResult(_OfModel):
    """What `trace` found: verdict, effects, errors before and after, and the model with them."""

    found: Traced

    @property
    def model(self) -> Model:
        return self.found.model

    @property
    def verdict(self) -> str:
        """ "none", "effect", "drift", "unknown" or "inseparable"."""
        return self.found.trace.verdict

    @property
    def effects(self) -> tuple[str, ...]:
        """Keys of the effects that were named."""
        return tuple(one.effect.key for one in self.found.trace.effects)

    @property
    def residuals(self) -> "pd.DataFrame":
        """What the equation of motion leaves of the training logs, a row a short stretch.

        `before` the effects and `after` them, with its `noise` (one sigma) [N]; `t` [s] over all
        logs in a row; the signals at the stretch by name. Empty where nothing was judged.
        """
        import pandas as pd

        if not self.found.trace.residuals:
            return pd.DataFrame()
        rest = self.found.trace.residuals[0]
        own = {"t": rest.t, "before": rest.before, "after": rest.after, "noise": rest.noise}
        return pd.DataFrame({**rest.signals, **own})

    @property
    def document(self) -> Mapping[str, Any]:
        from workbench.steps.trace import trace_document

        return trace_document(self.found)

    def report(self) -> str:
        from workbench.report.trace import trace_report

        return trace_report(self.found)

    def plot(self) -> "Figure":
        from workbench.report.chart_figure import chart_figure
        from workbench.report.trace_friction import friction_chart
        from workbench.report.trace_pictures import pictures, signal_chart

        drawn, rig = pictures(self.found.trace), self.model.rig
        chart = friction_chart(self.found)
        if drawn:
            chart = signal_chart(drawn[0], self.model.rotary, rig.command_unit)
        return chart_figure(chart)

    def _view(self) -> object:
        from workbench.report.trace_tables import trace_view

        return trace_view(self.found, None)

    def _told(self) -> tuple[str, Sequence[Part]]:
        from workbench.report.notes import report_notes
        from workbench.report.trace_tables import logs_of_trace, trace_parts
        from workbench.report.trace_words import then_of, trace_sentence

        found = self.found.trace
        parts = [Part(head, rows, lines) for head, rows, lines in trace_parts(self.found)]
        said = (*self.found.remarks, *found.remarks)
        notes = [f"note: {one.text}" for one in report_notes(said, logs_of_trace(self.found))]
        parts[-1] = parts[-1]._replace(lines=[*parts[-1].lines, *notes])
        then = " ".join(f"Next: {line}." for line in then_of(self.found))
        return f"{trace_sentence(self.found)} {then}".strip(), parts

    def _files(self) -> Iterator[tuple[str, str]]:
        from workbench.documents.model_file import model_document

        yield "trace.json", self.to_json() + "\n"
        yield "model.json", dumps(model_document(self.model)) + "\n"
        yield "report.html", self.report()

    @property
    def _command(self) -> str:
        return "trace"


def _arviz() -> Any:
    """arviz, whose import warns of its next version."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return importlib.import_module("arviz")
    except ModuleNotFoundError:
        raise MissingLibrary(
            "to_arviz needs the library 'arviz', which is not installed; run"
            " pip install 'servo-workbench[arviz]'"
        ) from None
