"""Results of `predict`, `response`, `drift` and `simulate`: what is said of logs, and logs that are
made."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.log import Log
from workbench.cards.card import Card
from workbench.interface.result import Part, Result
from workbench.output import dumps
from workbench.steps.axis_test import AxisTest
from workbench.steps.drift import Drifted
from workbench.steps.predict import Predicted
from workbench.steps.response import Curve, Responded

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


@dataclass(frozen=True, repr=False)
class PredictResult(Result):
    """What a model says of a log, and how far off it is."""

    found: Predicted
    rotary: bool = False

    @property
    def document(self) -> Mapping[str, Any]:
        return self.found.summary

    @property
    def frame(self) -> "pd.DataFrame":
        """The columns of prediction.csv; NaN where there is no value."""
        from workbench.steps.predict import prediction_frame

        return prediction_frame(self.found.runs)

    def report(self) -> str:
        from workbench.report.page import Section, page
        from workbench.report.prediction import prediction_section, then_of_prediction
        from workbench.report.templating import render

        first, *more = self._lines()
        sections = [prediction_section(self.found, self.rotary)]
        if more:
            sections.append(Section("In words", render("lines", lines=more)))
        lead, then = first.rstrip(".") + ".", then_of_prediction("LOG", "CARD")
        return page("Prediction", lead, sections, then)

    def _lines(self) -> list[str]:
        from workbench.report.prediction import prediction_lines

        return prediction_lines(self.found, self.rotary)

    def plot(self) -> "Figure":
        from workbench.report.chart_figure import chart_figure
        from workbench.report.prediction import prediction_chart

        return chart_figure(prediction_chart(self.found, self.rotary))

    def _view(self) -> object:
        return "\n".join(self._lines())

    def _told(self) -> tuple[str, Sequence[Part]]:
        first, *rest = self._lines()
        return first, [Part((), (), rest)]

    def _files(self) -> Iterator[tuple[str, str]]:
        from workbench.steps.predict import prediction_csv

        yield "prediction.csv", prediction_csv(self.found.runs)

    @property
    def _command(self) -> str:
        return "predict"


@dataclass(frozen=True, repr=False)
class ResponseResult(Result):
    """A machine over frequency: plant, controller and open loop with bands, resonances, margins."""

    found: Responded

    @property
    def document(self) -> Mapping[str, Any]:
        from workbench.steps.response import response_document

        return response_document(self.found)

    @property
    def frame(self) -> "pd.DataFrame":
        """The columns of response.csv, a row a frequency; NaN where nothing is seen."""
        from workbench.steps.response import response_frame

        return response_frame(self.found)

    def to_control(self, what: Curve = "plant") -> Any:
        """A curve as control.FRD of python-control, at the frequencies [rad/s] that are seen.

        what: "plant" (force to position), "velocity" (force to velocity), "controller", "open_loop"
        or "plant_with_friction". Raises BadModel where the logs show no such curve.
        """
        from design.convert import frd
        from workbench.steps.response import curve_of

        one = curve_of(self.found, what)
        return frd(one.H[one.seen], 2.0 * np.pi * one.f[one.seen])

    def report(self) -> str:
        from workbench.report.response import response_report

        return response_report(self.found)

    def plot(self) -> "Figure":
        from workbench.report.chart_figure import chart_figure
        from workbench.report.response import plant_chart

        return chart_figure(plant_chart(self.found))

    def _view(self) -> object:
        from workbench.report.response import response_view

        return response_view(self.found, None)

    def _told(self) -> tuple[str, Sequence[Part]]:
        from workbench.report.response import (
            PEAK_HEAD,
            peak_rows,
            response_lines,
            response_sentence,
        )

        lines = [*response_lines(self.found), *(f"note: {one}" for one in self.found.remarks)]
        return response_sentence(self.found), [Part(PEAK_HEAD, peak_rows(self.found), lines)]

    def _files(self) -> Iterator[tuple[str, str]]:
        from workbench.steps.response import response_csv

        yield "response.json", self.to_json() + "\n"
        yield "response.csv", response_csv(self.found)
        yield "report.html", self.report()

    @property
    def _command(self) -> str:
        return "response"


@dataclass(frozen=True, repr=False)
class DriftResult(Result):
    """Whether a machine has changed since its model, log by log."""

    found: Drifted
    model_name: str

    @property
    def verdict(self) -> str:
        """ "none", "drift", "structure" or "not_judged"."""
        return self.found.verdict

    @property
    def document(self) -> Mapping[str, Any]:
        from workbench.steps.drift import drift_document

        return drift_document(self.found, self.model_name)

    def report(self) -> str:
        from workbench.report.drift import drift_report

        return drift_report(self.found)

    def plot(self) -> "Figure":
        from workbench.report.drift import drift_figure

        judged = [one for one in self.found.tests if one.test.shifts] or list(self.found.tests)
        return drift_figure(self.found, judged[-1])

    def _view(self) -> object:
        from workbench.report.drift_tables import drift_view

        return drift_view(self.found, None)

    def _told(self) -> tuple[str, Sequence[Part]]:
        from workbench.remarks import told_once
        from workbench.report.drift_tables import (
            RUN_HEAD,
            SHIFT_HEAD,
            drift_notes,
            drift_sentence,
            logs_of_drift,
            run_rows,
            shift_rows,
        )

        lines = told_once(drift_notes(self.found), logs_of_drift(self.found))
        last = Part(SHIFT_HEAD, shift_rows(self.found.tests[-1]))
        parts = [Part(RUN_HEAD, run_rows(self.found), lines), last]
        return drift_sentence(self.found), parts

    def _files(self) -> Iterator[tuple[str, str]]:
        yield "drift.json", self.to_json() + "\n"
        yield "report.html", self.report()

    @property
    def _command(self) -> str:
        return "drift"


@dataclass(frozen=True, repr=False)
class AxisTestResult(Result):
    """An axis by one log: its light, its numbers and their limits."""

    found: AxisTest

    @property
    def light(self) -> str:
        """ "green", "yellow" or "red"."""
        return self.found.light

    @property
    def reasons(self) -> Sequence[str]:
        """Why it is not green, the worst first."""
        return self.found.reasons

    @property
    def document(self) -> Mapping[str, Any]:
        from workbench.steps.axis_test import axis_document

        return axis_document(self.found)

    def report(self) -> str:
        from workbench.report.axis_test import axis_report

        return axis_report(self.found)

    def plot(self) -> "Figure":
        from workbench.report.axis_test import axis_charts
        from workbench.report.chart_figure import chart_figure

        return chart_figure(axis_charts(self.found)[0])

    def _view(self) -> object:
        from workbench.report.axis_test import axis_view

        return axis_view(self.found, None)

    def _told(self) -> tuple[str, Sequence[Part]]:
        from workbench.report.axis_test import AXIS_HEAD, axis_rows, axis_sentence

        rows = axis_rows(self.found)
        return axis_sentence(self.found), [Part(AXIS_HEAD, rows, self.found.reasons)]

    def _files(self) -> Iterator[tuple[str, str]]:
        yield "axis_test.json", self.to_json() + "\n"
        yield "report.html", self.report()

    @property
    def _command(self) -> str:
        return "axis-test"


@dataclass(frozen=True, repr=False)
class SimulateResult:
    """The log of a recipe: its columns as a table, the truth, and the card that reads it."""

    frame: "pd.DataFrame"
    truth: Mapping[str, Any]
    card: Card
    log: Log = field(compare=False)

    def to_json(self) -> str:
        """The truth as strict JSON, as truth.json holds it."""
        return dumps(self.truth)

    def __repr__(self) -> str:
        return f"{self._line()}\n{self.frame!r}"

    def _repr_html_(self) -> str:
        from workbench.report.templating import render

        shown = self.frame._repr_html_()  # type: ignore[operator]
        return f"{render('lead', sentence=self._line())}\n{shown}"

    def _line(self) -> str:
        n, h, seed = len(self.log), self.log.h, self.truth["seed"]
        return f"{self.card.name}: {n} samples every {h:.4g} s, seed {seed}"
