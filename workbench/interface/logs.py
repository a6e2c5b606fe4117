"""`predict`, `response`, `drift`, `axis_test` and `simulate`, as the commands of these names: what
is said of logs, and logs that are made."""

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from design.identified.identify_logs import identify_logs
from design.machine.model import Model
from design.machine.readable import Display
from design.measured.axis_test import AxisTest
from design.measured.drift_of_logs import Drifted, drift_of
from design.measured.predicted_logs import Predicted, predict_logs
from design.measured.response import Curve, Responded, curve_of, respond
from design.simulated.record import record, truth
from identification.errors import BadCard, NotIdentifiable
from identification.log import Log
from workbench.cards.card import Card, load_card, present_of_card
from workbench.course import running, working
from workbench.interface.inputs import (
    CardLike,
    LogLike,
    Logs,
    PathLike,
    RigLike,
    Signals,
    effects_of,
    read_card,
    sources,
)  # fmt: skip
from workbench.interface.models import IdentifyResult, ModelLike, Result, TraceResult, model_of
from workbench.logs.sources import Sources, card_path
from workbench.output import dumps
from workbench.report.templating import render
from workbench.steps.asked import IDENTIFY_STAGES
from workbench.steps.axis_test import axis_test_of_sources
from workbench.steps.drift import model_key, read_stream, write_stream
from workbench.steps.predict import prediction_frame
from workbench.steps.response import response_frame
from workbench.steps.simulate import as_columns

if TYPE_CHECKING:
    import pandas as pd

    from identification.drift.drift_test import DriftSettings
    from identification.model.estimates import Drive


@dataclass(frozen=True, repr=False)
class PredictResult(Result):
    """What a model says of a log, and how far off it is."""

    _command = "predict"
    _shown = ("found", "display", "log")
    found: Predicted
    display: Display
    log: str = "LOG"  # as it was named

    @property
    def frame(self) -> "pd.DataFrame":
        """The columns of prediction.csv; NaN where there is no value."""
        return prediction_frame(self.found.runs)


@dataclass(frozen=True, repr=False)
class ResponseResult(Result):
    """A machine over frequency: plant, controller and open loop with bands, resonances, margins."""

    _command = "response"
    found: Responded

    @property
    def frame(self) -> "pd.DataFrame":
        """The columns of response.csv, a row a frequency; NaN where nothing is seen."""
        return response_frame(self.found)

    def to_control(self, what: Curve = "plant") -> Any:
        """A curve as control.FRD of python-control, at the frequencies [rad/s] that are seen.

        what: "plant" (force to position), "velocity" (force to velocity), "controller", "open_loop"
        or "plant_with_friction". Raises BadModel where the logs show no such curve.
        """
        from design.convert import frd

        one = curve_of(self.found, what)
        return frd(one.H[one.seen], 2.0 * np.pi * one.f[one.seen])


@dataclass(frozen=True, repr=False)
class DriftResult(Result):
    """Whether a machine has changed since its model, log by log."""

    _command = "drift"
    _shown = ("found", "model_name")
    found: Drifted
    model_name: str

    @property
    def verdict(self) -> str:
        """ "none", "drift", "structure" or "not_judged"."""
        return self.found.verdict


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
        shown = self.frame._repr_html_()  # type: ignore[operator]
        return f"{render('lead', sentence=self._line())}\n{shown}"

    def _line(self) -> str:
        n, h, seed = len(self.log), self.log.h, self.truth["seed"]
        return f"{self.card.name}: {n} samples every {h:.4g} s, seed {seed}"


def predict(
    model: ModelLike, log: LogLike, card: CardLike | None = None, *, rig: RigLike | None = None,
    signals: Signals | None = None, drive: "Drive | None" = None, window: float | None = None,
) -> PredictResult:  # fmt: skip
    """Force and position of a log by a model, nothing fitted on it, as `workbench predict`.

    Without card and rig the log is read as those of the model were. drive: "force" or "command";
    window [s]: the run starts anew from the measured state after each.
    """
    known = model_of(model)
    found = sources(log, *_machine(model, card, rig, signals))
    with working("predicting"):
        where = str(found.card.path)
        predicted = predict_logs(known, found.logs, where, drive=drive, window=window)
    named = (os.fspath(log),) if isinstance(log, str | os.PathLike) else ()
    return PredictResult(predicted, known.display, *named)


def response(
    logs: Logs, card: CardLike | None = None, *, rig: RigLike | None = None,
    signals: Signals | None = None, model: ModelLike | None = None, lowest: float | None = None,
    friction_left_in: bool = False, seed: int = 0,
) -> ResponseResult:  # fmt: skip
    """Plant, controller and open loop over frequency, their resonances and margins, as `workbench
    response`.

    model: whose friction is taken off the force, identified from the logs where none is given;
    friction_left_in: take nothing off; lowest [Hz]: the frequency to reach down to. Raises
    NotIdentifiable where the logs show the machine at no frequency.
    """
    known = None if model is None else model_of(model)
    found = sources(logs, *_machine(model, card, rig, signals))
    return responded(found, known, "asked for" if friction_left_in else None, lowest, seed)


def responded(
    of: Sources, known: Model | None, left_in: str | None, lowest: float | None, seed: int,
    budget: float | None = None,
) -> ResponseResult:  # fmt: skip
    """The same of logs that are read; left_in: why friction is left in the force, None where it is
    taken off; budget [s]: of the identification, where no model is known."""
    if known is None and left_in is None:
        with running("identifying", IDENTIFY_STAGES, budget) as course:
            try:
                known = identify_logs(
                    of.logs, seed=seed, on_progress=course.report, keep_going=course.keep_going
                ).model
            except NotIdentifiable as error:
                left_in = f"not identifiable from the logs ({error})"
    with working("averaging spectra"):
        made = respond(
            of.runs, of.rig, of.card.name, known, lowest, left_in=left_in, read=of.remarks
        )
    return ResponseResult(made)


def drift(
    model: ModelLike, logs: Logs, card: CardLike | None = None, *, rig: RigLike | None = None,
    signals: Signals | None = None, state: PathLike | None = None,
    settings: "DriftSettings | None" = None, seed: int = 0,
) -> DriftResult:  # fmt: skip
    """Whether a machine has changed since its model, and in what, as `workbench drift`.

    Without card and rig the logs are read as those of the model were. state: file that carries the
    test from log to log; made where there is none.
    """
    known = model_of(model)
    stream = read_stream(Path(state)) if state is not None else None
    found = sources(logs, *_machine(model, card, rig, signals))
    with working("testing"):
        tested = drift_of(
            known, model_key(known), found.logs, stream=stream, settings=settings, seed=seed
        )
    if state is not None:
        write_stream(Path(state), tested.stream)
    path = os.fspath(model) if isinstance(model, str | os.PathLike) else f"model of {known.card}"
    return DriftResult(tested, path)


def axis_test(
    logs: Logs, card: CardLike | None = None, *, rig: RigLike | None = None,
    signals: Signals | None = None, registry: str | None = None, machine: str | None = None,
    seed: int = 0,
) -> AxisTestResult:  # fmt: skip
    """An axis by one log, green, yellow or red, as `workbench axis-test`.

    registry: SQLite file or PostgreSQL URL whose last 30 logs of the machine, by default of the
    card's name, give its limits where the card has none.
    """
    found = sources(logs, None if card is None else read_card(card), rig, signals)
    name, earlier = machine or found.card.name, None
    with working("testing"):
        if registry is not None:
            from workbench.jobs.axis_history import earlier_of
            from workbench.registry.store import Registry

            with Registry(registry, create=False) as where:
                earlier = earlier_of(where, name, found, seed)
        return AxisTestResult(axis_test_of_sources(found, earlier, name))


def simulate(
    card: CardLike, *, seed: int | None = None, effects: Iterable[PathLike] = ()
) -> SimulateResult:
    """The log of a card's recipe and its truth, as `workbench simulate`.

    card: a path, the name of a shipped card, or a card read with its recipe; seed: instead of the
    recipe's. Raises BadCard where the card has no [recipe].
    """
    import pandas as pd

    if not isinstance(card, Card):
        card = load_card(card_path(os.fspath(card)), effects_of(effects))
    card.refuse_velocity()
    if card.recipe is None:
        raise BadCard(f"{card.path}: has no [recipe]; name a card with one, as paper_table1")
    with working("simulating"):
        log = record(card.name, card.recipe, seed, card.rig(), card.controller)
    frame = pd.DataFrame(as_columns(log, card))
    frame.attrs["name"] = card.name
    now = present_of_card(card, card.rig(), card.recipe.h)
    known = truth(card.name, card.recipe, seed, rig=card.rig(), controller=now)
    return SimulateResult(frame, known, card, log)


def read_logs(
    logs: Logs, card: CardLike | None = None, *, rig: RigLike | None = None,
    signals: Signals | None = None,
) -> "tuple[pd.DataFrame, ...]":  # fmt: skip
    """The runs of the logs as the other functions see them: in SI, on an even clock, cleaned.

    A table a run, its columns the signals (`t`, `y`, `F`, ...), its file in `attrs["name"]`.
    """
    import pandas as pd

    out = []
    for run in sources(logs, card, rig, signals).runs:
        frame = pd.DataFrame(dict(run.log.signals))
        frame.attrs["name"] = run.file
        out.append(frame)
    return tuple(out)


def _machine(
    model: ModelLike | None, card: CardLike | None, rig: RigLike | None, signals: Signals | None
) -> tuple[Any, ...]:
    """Card, rig and signals as given, else the card by which the model's logs were read."""
    own = model.card if isinstance(model, IdentifyResult | TraceResult) else None
    if own is not None and card is None and rig is None and signals is None:
        return own, None, None
    return None if card is None else read_card(card), rig, signals
