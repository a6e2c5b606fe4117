"""Results of `predict`, `response`, `drift` and `simulate`: what is said of logs, and logs that are
made."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.log import Log
from workbench.cards.card import Card
from workbench.interface.result import Result
from workbench.output import dumps
from workbench.report.axis_test import axis_view
from workbench.report.drift import drift_view
from workbench.report.prediction import prediction_view
from workbench.report.response import response_view
from workbench.report.view import View
from workbench.steps.axis_test import AxisTest
from workbench.steps.drift import Drifted
from workbench.steps.predict import Predicted
from workbench.steps.response import Curve, Responded

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, repr=False)
class PredictResult(Result):
    """What a model says of a log, and how far off it is."""

    _command = "predict"
    found: Predicted
    rotary: bool = False

    @property
    def frame(self) -> "pd.DataFrame":
        """The columns of prediction.csv; NaN where there is no value."""
        from workbench.steps.predict import prediction_frame

        return prediction_frame(self.found.runs)

    def _made(self) -> View:
        return prediction_view(self.found, self.rotary)


@dataclass(frozen=True, repr=False)
class ResponseResult(Result):
    """A machine over frequency: plant, controller and open loop with bands, resonances, margins."""

    _command = "response"
    found: Responded

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

    def _made(self) -> View:
        return response_view(self.found)


@dataclass(frozen=True, repr=False)
class DriftResult(Result):
    """Whether a machine has changed since its model, log by log."""

    _command = "drift"
    found: Drifted
    model_name: str

    @property
    def verdict(self) -> str:
        """ "none", "drift", "structure" or "not_judged"."""
        return self.found.verdict

    def _made(self) -> View:
        return drift_view(self.found, self.model_name)


@dataclass(frozen=True, repr=False)
class AxisTestResult(Result):
    """An axis by one log: its light, its numbers and their limits."""

    _command = "axis-test"
    found: AxisTest

    @property
    def light(self) -> str:
        """ "green", "yellow" or "red"."""
        return self.found.light

    @property
    def reasons(self) -> Sequence[str]:
        """Why it is not green, the worst first."""
        return self.found.reasons

    def _made(self) -> View:
        return axis_view(self.found)


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
