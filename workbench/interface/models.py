"""`identify` and `trace`, as the commands of these names, and what they find of a machine: results
that show, draw and write themselves.

A result holds the value that the command of its name writes; its JSON is the command's own.
"""

import importlib
import math
import os
import time
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import datetime
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, TypeAlias

from design.asked import Options
from design.identified.identify_logs import Identified, identify_logs
from design.identified.trace_logs import Traced, trace_logs
from design.machine.model import Model
from identification.errors import BadCard, BadModel
from identification.model.estimates import Estimate
from workbench.cards.card import Card
from workbench.course import running
from workbench.documents.result_files import read_model
from workbench.interface.inputs import (
    CardLike,
    Logs,
    PathLike,
    RigLike,
    Signals,
    effects_of,
    sources,
)
from workbench.output import MissingLibrary, OutputFolder, dumps
from workbench.report.view import View, view
from workbench.steps.asked import IDENTIFY_STAGES, TRACE_STAGES
from workbench.steps.trace import named_logs

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


@dataclass(frozen=True, repr=False)
class Result:
    """What every result can: show itself as text and HTML, draw, and write the command's files."""

    _command: ClassVar[str]
    _shown: ClassVar[tuple[str, ...]] = ("found",)  # fields by which its view is made

    @cached_property
    def view(self) -> View:
        """The result as terminal, page, notebook and picture show it."""
        return view(*(getattr(self, name) for name in self._shown))

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


@dataclass(frozen=True, repr=False)
class _OfModel(Result):
    """A result that holds the model of a machine; `card` by which its logs were read."""

    card: Card
    found: Identified | Traced

    @property
    def model(self) -> Model:
        """The model of the machine, in SI."""
        return self.found.model

    @property
    def parameters(self) -> "pd.DataFrame":
        """Value, unit, deviation and 95 % interval of each parameter, or why there is none."""
        import pandas as pd

        every: dict[str, Estimate] = {**self.model.friction, **(self.model.actuator or {})}
        for key, found in self.model.effects.items():
            every |= {f"{key}.{name}": one for name, one in found.items()}
        columns = ("value", "unit", "sd", "low", "high", "reason")
        rows = {name: [getattr(one, key) for key in columns] for name, one in every.items()}
        return pd.DataFrame.from_dict(rows, orient="index", columns=list(columns))

    def to_control(self, period: float | None = None) -> Any:
        """The linear plant from force to position on which a design is made, of python-control.

        period [s]: by default as for a design. Raises NotIdentifiable where the model carries none.
        """
        from design.closed_loop.linear_loop import linear_of
        from design.convert import to_control

        plant, _ = linear_of(self.model, None, period)
        return to_control(plant.A, plant.B, plant.h)


@dataclass(frozen=True, repr=False)
class IdentifyResult(_OfModel):
    """What `identify` found: the model, and the fit that it comes from."""

    _command = "identify"
    found: Identified

    @property
    def remarks(self) -> tuple[str, ...]:
        """What to know of the logs and the fit, a line each."""
        return (*self.found.remarks, *self.model.fit.remarks)

    def to_arviz(self) -> Any:
        """The posterior as arviz.InferenceData, a chain an independent ensemble.

        An effect's parameters are named as key.name. Attributes: units, verdict, converged.
        Raises BadModel where none was sampled, MissingLibrary without arviz.
        """
        of = self.found.posterior_samples
        if of is None:
            raise BadModel("no posterior was sampled; call identify(..., posterior=True)")
        posterior = {name: of.chains[:, :, k] for k, name in enumerate(of.names)}
        units = str({name: self.found.fit.estimates[name].unit for name in of.names})
        said = {"units": units, "verdict": of.verdict, "converged": int(of.converged)}
        return _arviz().from_dict(posterior=posterior, attrs=said)


@dataclass(frozen=True, repr=False)
class TraceResult(_OfModel):
    """What `trace` found: verdict, effects, errors before and after, and the model with them."""

    _command = "trace"
    found: Traced

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
        logs in a row; the signals at the stretch by name. Empty where nothing was tested.
        """
        import pandas as pd

        if not self.found.trace.residuals:
            return pd.DataFrame()
        rest = self.found.trace.residuals[0]
        own = {"t": rest.t, "before": rest.before, "after": rest.after, "noise": rest.noise}
        return pd.DataFrame({**rest.signals, **own})


def _arviz() -> Any:
    """arviz, whose import warns of its next version."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return importlib.import_module("arviz")
    except ModuleNotFoundError:
        raise MissingLibrary("to_arviz", "arviz", "arviz") from None


ModelLike: TypeAlias = IdentifyResult | TraceResult | Model | PathLike


def identify(
    logs: Logs, card: CardLike | None = None, *, rig: RigLike | None = None,
    signals: Signals | None = None, options: Options | None = None, posterior: bool = False,
    budget: float | None = None, seed: int = 0,
) -> IdentifyResult:  # fmt: skip
    """Friction, plant and actuator of a machine from its logs, as `workbench identify`.

    options: what drives the fitted run, orders and period of the ARX plant; posterior: sample it
    too, which takes half a minute and more. budget [s]: end after so long with the best so far, and
    on Ctrl-C. Raises NotIdentifiable where nothing is identifiable.
    """
    begun = time.monotonic()
    found = sources(logs, card, rig, signals)
    with running("identifying", IDENTIFY_STAGES, left_of(budget, begun)) as course:
        known = identify_logs(
            found.logs, options, seed, posterior=posterior, on_progress=course.report,
            keep_going=course.keep_going,
        )  # fmt: skip
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
    known = effects_of(effects)
    if train is None:
        if card is None or isinstance(card, Card):
            raise BadCard("no log given; give train, or the path or name of a card with a [split]")
        names, held_out = named_logs((), (), os.fspath(card))
        train, test = list(names), list(held_out) or None
    learnt = sources(train, card, rig, signals)
    seen = None if test is None else sources(test, learnt.card, None, None)
    left = left_of(math.inf if budget is None else budget, begun)
    with running("trace", TRACE_STAGES, left) as course:
        held = None if seen is None else seen.logs
        found = trace_logs(
            learnt.logs, held, known, seed, course.report, keep_going=course.keep_going
        )
    return TraceResult(learnt.card, found)


def load_model(path: PathLike, effects: Iterable[PathLike] = ()) -> Model:
    """The model in the file, its effects also of your own folders, whose Python is run."""
    return read_model(Path(path), effects_of(effects))


def model_of(given: ModelLike) -> Model:
    """The model that was given, of a result or in a file."""
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


def left_of(budget: float | None, begun: float) -> float | None:
    """What is left of a budget [s] that began then."""
    return None if budget is None else budget - (time.monotonic() - begun)
