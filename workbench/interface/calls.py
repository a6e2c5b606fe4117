"""`identify`, `trace`, `design`, `validate`, `predict`, `drift` and `simulate`, as the commands do.

A log is a DataFrame (or what makes one), a path, or the name of a file of the card's set; several
of one machine go as a list. The machine is said by `card` (a path, the name of a shipped card, or a
card that is read), or by `rig` and `signals`:

    rig = "motor"                                     # all columns in SI
    rig = {"kind": "electro-pneumatic", "area_p": "12.6 cm^2", "area_n": "10 cm^2",
           "supply_pressure": "5 bar"}
    signals = {"y": "position [mm]", "u": ("valve", "V"), "F": {"column": 3, "unit": "kN"}}

Keys of `rig` are a card's, also without the unit in them, then as numbers in SI or texts with a
unit. Without `signals` the columns are those named as signals are (`t`, `y`, `F`, ...), a unit in
brackets behind the name included; an index of times counts as a column. Errors of what was given
are `UserError`, a line that says what to do.
"""

import math
import os
import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from identification.errors import BadCard, BadModel
from workbench.cards.card import Card, load_card
from workbench.cards.own_effects import library
from workbench.course import Course, Stages, moving, running
from workbench.documents.design import Design, Structure
from workbench.documents.design_file import read_design
from workbench.documents.model import Model
from workbench.documents.model_file import read_model
from workbench.interface.inputs import (
    CardLike,
    LogLike,
    PathLike,
    RigLike,
    Signals,
    read_card,
    sources,
)
from workbench.interface.logs import (
    AxisTestResult,
    DriftResult,
    PredictResult,
    ResponseResult,
    SimulateResult,
)
from workbench.interface.loops import DesignResult, ExperimentResult, RobustResult, ValidateResult
from workbench.interface.models import IdentifyResult, TraceResult
from workbench.logs.sources import card_path
from workbench.output import Bar, progress
from workbench.steps.axis_test import axis_test as test_of_axis
from workbench.steps.design import design as design_of_model
from workbench.steps.design import effort_limit
from workbench.steps.drift import drift_of, model_key, read_stream, write_stream
from workbench.steps.experiment.plan import EXPERIMENT_STAGES
from workbench.steps.experiment.plan import experiment as plan_experiment
from workbench.steps.experiment.planned import Wanted, read_rivals, rivals_of
from workbench.steps.identify import Options
from workbench.steps.identify_sources import identify_sources
from workbench.steps.loop_figures import Limits
from workbench.steps.predict import predict_sources
from workbench.steps.present import present_of_card
from workbench.steps.response import identified_or_not, respond
from workbench.steps.robust.robust import ROBUST_STAGES, RobustAsked
from workbench.steps.robust.robust import robust_design as robust_of_model
from workbench.steps.simulate import as_columns, record, truth
from workbench.steps.stages import IDENTIFY_STAGES, TRACE_STAGES
from workbench.steps.trace import named_logs, trace_sources
from workbench.steps.validate import validate as validate_design
from workbench.threads import one_thread

if TYPE_CHECKING:
    from typing import Literal

    import pandas as pd

    from design.tune import Goals
    from identification.drift.drift_test import DriftSettings
    from identification.model.estimates import Drive

Logs: TypeAlias = LogLike | Sequence[LogLike]
ModelLike: TypeAlias = IdentifyResult | TraceResult | Model | PathLike
DesignLike: TypeAlias = DesignResult | Design | PathLike


def identify(
    logs: Logs, card: CardLike | None = None, *, rig: RigLike | None = None,
    signals: Signals | None = None, options: Options | None = None, posterior: bool = False,
    seed: int = 0,
) -> IdentifyResult:  # fmt: skip
    """Friction, plant and actuator of a machine from its logs, as `workbench identify`.

    options: what drives the fitted run, orders and period of the ARX plant; posterior: sample it
    too, which takes half a minute and more. Raises NotIdentifiable where nothing is identifiable.
    """
    found = sources(logs, card, rig, signals)
    with _bar("identifying", 1.0) as bar:
        course = Course(bar, IDENTIFY_STAGES, time.monotonic, describe=bar.describe)
        with moving(course):
            known = identify_sources(
                found, options, seed, posterior=posterior, on_progress=course.report
            )
    return IdentifyResult(found.card, known)


def trace(
    train: Logs | None = None, test: Logs | None = None, card: CardLike | None = None, *,
    rig: RigLike | None = None, signals: Signals | None = None,
    effects: Iterable[PathLike] = (), budget: float | None = None, seed: int = 0,
) -> TraceResult:  # fmt: skip
    """The effect that the model of a machine lacks, as `workbench trace`.

    test: held-out logs, which neither fit nor choice sees; without them stretches of the training
    logs are left out in turn, and without `train` the card's [split] names both. effects: folders
    of your own, whose Python is run. budget [s]: end after so long with the best so far, as Ctrl-C
    does. Raises NotIdentifiable where too little slides.
    """
    begun = time.monotonic()
    known = library([Path(one) for one in effects])
    if train is None:
        if card is None or isinstance(card, Card):
            raise BadCard("no log given; give train, or the path or name of a card with a [split]")
        names, held_out = named_logs((), (), os.fspath(card))
        train, test = list(names), list(held_out) or None
    learnt = sources(train, card, rig, signals)
    seen = None if test is None else sources(test, learnt.card, None, None)
    left = math.inf if budget is None else budget - (time.monotonic() - begun)
    with _course("trace", TRACE_STAGES, left) as course:
        found = trace_sources(
            learnt, seen, known, seed, course.report, keep_going=course.keep_going
        )
    return TraceResult(learnt.card, found)


def design(
    model: ModelLike, *, poles: tuple[float, float] | None = None,
    auxiliary: Sequence[complex] | None = None, integrator: bool = True,
    source: "Literal['physical', 'arx'] | None" = None, period: float | None = None,
    goals: "Goals | None" = None, structures: "Sequence[Structure] | None" = None,
) -> DesignResult:  # fmt: skip
    """PID and RST for a model by pole placement, and P-PI cascades, as `workbench design`.

    poles: w_n [rad/s] and damping of the dominant pair, auxiliary: the others, values of z; both
    searched where not given. source: the plant to design on; period: of the position loop [s];
    goals: margins to keep, by default those of the command; structures: of "rst", "pid", "p-pi".
    Raises BadSpecification where the poles
    cannot be placed, NotIdentifiable where the model carries no design.
    """
    from design.tune import Asked
    from design.tune import Goals as DesignGoals

    known = _model(model)
    asked = Asked(poles, None if auxiliary is None else tuple(auxiliary), integrator)
    wanted = goals or DesignGoals(effort=effort_limit(known))
    with _bar("designing"):
        found = design_of_model(
            known, asked, goals=wanted, source=source, period=period, structures=structures
        )
    return DesignResult(found, known)


def robust_design(
    model: ModelLike, wanted: RobustAsked | None = None, *,
    poles: tuple[float, float] | None = None, integrator: bool = True, period: float | None = None,
) -> RobustResult:  # fmt: skip
    """The design that does best over the machines that a model's errors allow, as `workbench design
    --robust`.

    wanted: machines drawn, limits, on what share of the machines each has to hold; poles,
    integrator, period as `design` has them. Raises BadSpecification where no loop can be placed,
    NotIdentifiable where the mass is not known.
    """
    from design.tune import Asked

    known = _model(model)
    asked = Asked(poles, None, integrator)
    with _course("robust design", ROBUST_STAGES) as course:
        found = robust_of_model(
            known, wanted or RobustAsked(), asked, where=(None, period), report=course.report
        )
    return RobustResult(found, known)


def validate(
    model: ModelLike, design: DesignLike, *, plant: ModelLike | None = None,
    limits: Limits | None = None, seed: int = 0,
) -> ValidateResult:  # fmt: skip
    """A design on its model in the simulated loop, as `workbench validate`.

    plant: another machine on which it has to work too; limits: what the tested controller keeps.
    """
    known = _model(model)
    made = _design(design)
    other = None if plant is None else _model(plant)
    with _bar("simulating the loop"):
        rng = np.random.default_rng(seed)
        found, traces = validate_design(known, made, rng, plant=other, limits=limits)
    return ValidateResult(found, traces, known.rotary)


def experiment(
    model: ModelLike, *, design: DesignLike | None = None, wanted: Wanted | None = None,
    rivals: "TraceResult | PathLike | None" = None, budget: float = 30.0,
) -> ExperimentResult:  # fmt: skip
    """The run to make next on a machine, as `workbench experiment`.

    design: whose controller moves the machine, by default the model's present one; wanted:
    parameters, limits, seed, keys of effects that are to be discriminated; rivals: a trace that
    leaves such effects open. budget [s]: end the search after so long. Raises NotIdentifiable where
    no run within the limits identifies anything.
    """
    known = _model(model)
    asked = wanted or Wanted()
    if rivals is not None:
        asked = replace(asked, rivals=_rivals(rivals, known))
    made = None if design is None else _design(design)
    with _course("experiment", EXPERIMENT_STAGES, budget) as course:
        found = plan_experiment(known, asked, made, course.report, course.keep_going)
    return ExperimentResult(found)


def predict(
    model: ModelLike, log: LogLike, card: CardLike | None = None, *, rig: RigLike | None = None,
    signals: Signals | None = None, drive: "Drive | None" = None, window: float | None = None,
) -> PredictResult:  # fmt: skip
    """Force and position of a log by a model, nothing fitted on it, as `workbench predict`.

    Without card and rig the log is read as those of the model were. drive: "force" or "command";
    window [s]: the run starts anew from the measured state after each.
    """
    known = _model(model)
    found = sources(log, *_machine(model, card, rig, signals))
    with _bar("predicting"):
        predicted = predict_sources(known, found, drive=drive, window=window)
    return PredictResult(predicted, known.rotary)


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
    left_in = "asked for" if friction_left_in else None
    known = None if model is None else _model(model)
    found = sources(logs, *_machine(model, card, rig, signals))
    if known is None and left_in is None:
        with _bar("identifying", 1.0) as bar:
            course = Course(bar, IDENTIFY_STAGES, time.monotonic, describe=bar.describe)
            with moving(course):
                known, left_in = identified_or_not(found, seed, course.report)
    with _bar("averaging spectra"):
        made = respond(
            found.runs, found.rig, found.card.name, known, lowest, left_in=left_in,
            read=found.remarks,
        )  # fmt: skip
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
    known = _model(model)
    stream = read_stream(Path(state)) if state is not None else None
    found = sources(logs, *_machine(model, card, rig, signals))
    with _bar("testing"):
        tested = drift_of(
            known, model_key(known), found, stream=stream, settings=settings, seed=seed
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
    with _bar("testing"):
        if registry is not None:
            from workbench.jobs.axis_history import earlier_of
            from workbench.registry.store import Registry

            with Registry(registry, create=False) as where:
                earlier = earlier_of(where, name, found, seed)
        return AxisTestResult(test_of_axis(found, earlier, name))


def simulate(
    card: CardLike, *, seed: int | None = None, effects: Iterable[PathLike] = ()
) -> SimulateResult:
    """The log of a card's recipe and its truth, as `workbench simulate`.

    card: a path, the name of a shipped card, or a card read with its recipe; seed: instead of the
    recipe's. Raises BadCard where the card has no [recipe].
    """
    import pandas as pd

    if not isinstance(card, Card):
        card = load_card(card_path(os.fspath(card)), library([Path(one) for one in effects]))
    if card.recipe is None:
        raise BadCard(f"{card.path}: has no [recipe]; name a card with one, as paper_table1")
    with _bar("simulating"):
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


def load_model(path: PathLike, effects: Iterable[PathLike] = ()) -> Model:
    """The model in the file, its effects also of your own folders, whose Python is run."""
    return read_model(Path(path), library([Path(one) for one in effects]))


@contextmanager
def _bar(label: str, total: float | None = None) -> Iterator[Bar]:
    """Work with a bar as the commands show it; none in a notebook, where its traces would stay."""
    with one_thread(), progress(label, total, as_json="ipykernel" in sys.modules) as bar:
        yield bar


@contextmanager
def _course(label: str, stages: Stages, budget: float = math.inf) -> Iterator[Course]:
    """As `_bar`, of work that the first Ctrl-C ends with the best so far."""
    quiet = "ipykernel" in sys.modules
    with one_thread(), running(label, stages, as_json=quiet, budget=budget) as course:
        yield course


def _model(given: ModelLike) -> Model:
    if isinstance(given, Model):
        return given
    if isinstance(given, IdentifyResult | TraceResult):
        return given.model
    if isinstance(given, str | os.PathLike):
        return load_model(given)
    raise BadModel(
        f"{type(given).__name__} found, a model needed: the path of a model.json, or what identify"
        " or trace gave"
    )


def _design(given: DesignLike) -> Design:
    made = read_design(Path(given)) if isinstance(given, str | os.PathLike) else given
    return made.design if isinstance(made, DesignResult) else made


def _rivals(given: "TraceResult | PathLike", model: Model) -> tuple[str, ...]:
    """Keys of the effects that a trace leaves open."""
    if isinstance(given, TraceResult):
        return rivals_of(given.document, model, model.library)
    return read_rivals(Path(given), model, model.library)


def _machine(
    model: ModelLike | None, card: CardLike | None, rig: RigLike | None, signals: Signals | None
) -> tuple[Any, ...]:
    """Card, rig and signals as given, else the card by which the model's logs were read."""
    own = model.card if isinstance(model, IdentifyResult | TraceResult) else None
    if own is not None and card is None and rig is None and signals is None:
        return own, None, None
    return None if card is None else read_card(card), rig, signals
