"""What a worker makes of a log: drift test, then the chain anew, or the trace, and the contest.

The test's state goes from log to log in the registry, with each log's result.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from pydantic import TypeAdapter, ValidationError

from design.challenge import Contender, Terms
from design.judgement import Judgement
from design.machine.model import Model
from design.machine.source import MachineLogs
from design.measured.drift_document import detectable_sizes
from design.measured.drift_of_logs import Stream, drift_of
from design.retuned import Drift, DriftJudge, Retuning
from identification.drift.mewma import DriftState
from identification.effects._library import Library
from identification.errors import BadModel
from workbench.cards.own_effects import library as installed
from workbench.documents.reading import Stored
from workbench.documents.result_files import read_design, read_model
from workbench.jobs.passes import Task
from workbench.logs.sources import read_sources
from workbench.output import dumps, strict
from workbench.report.drift import reason_sentence
from workbench.report.trace_words import trace_sentence
from workbench.steps.drift import model_key


def drift_by_chart(
    model: Model, logs: MachineLogs, rng: np.random.Generator, state: Mapping[str, Any]
) -> Drift:
    """The verdict on a log alone and by the mean of those since the model is active.

    Raises BadModel where the stored state is none, or model and card are of different machines.
    """
    stream = Stream(_state(state), ()) if state else None
    seed = int(rng.integers(2**31))
    found = drift_of(model, model_key(model), logs, stream=stream, seed=seed)
    worst = [one.test for one in found.tests if one.test.verdict == found.verdict][-1]
    state_now: Any = strict(found.stream.state)
    statistics = [one for one in (worst.single, worst.mean) if one is not None]
    return Drift(
        verdict=found.verdict,
        reason=reason_sentence(worst, found.settings.to_be_seen),
        moved=worst.moved,
        p_value=min((one.p_value for one in statistics), default=None),
        state=state_now,
        unsure=worst.unsure,
        could_have_seen=detectable_sizes(worst),
        parameters=tuple(worst.shifts.values()),
    )


def _state(state: Mapping[str, Any]) -> DriftState:
    try:
        return TypeAdapter(DriftState).validate_json(dumps(state), strict=True)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        raise BadModel(f"stored drift state: {first['loc']}: {first['msg']}") from None


@dataclass(frozen=True)
class Chain:
    """A judge (`workbench.jobs.passes.Judge`): `design.retuned.Retuning` of a task's files.

    library: the effects that models may name, by default all but a user's own files.
    """

    drift: DriftJudge = drift_by_chart
    terms: Terms = field(default_factory=Terms)
    seed: int = 0
    library: Library | None = None

    def __call__(self, task: Task) -> Judgement:
        """The judgement of one log; raises as `Judge` says."""
        sources = read_sources([str(task.path)], str(task.card))
        champion = None if task.model is None else _contender(task, self.library)
        state = (task.previous or {}).get("state", {})
        by = Retuning(
            self.drift, lambda: self.library or installed(), trace_sentence, self.terms, self.seed
        )
        return by.judgement(sources.logs, task.log.sha256, champion, state)


def _contender(task: Task, library: Library | None) -> Contender:
    """The active model and design, read as from their files."""
    try:
        found = read_model(Stored("model.json", task.model or {}), library)
        made = None if task.design is None else read_design(Stored("design.json", task.design))
    except BadModel as error:
        raise BadModel(f"{task.machine}: active version: {error}") from None
    return Contender(found, made)
