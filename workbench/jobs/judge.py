"""What a worker makes of a log: drift test, then the chain anew, or the trace, and the contest.

The test's state goes from log to log in the registry, with each log's result.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal

import numpy as np
from pydantic import TypeAdapter, ValidationError

from design.challenge import Contender, Terms, challenge
from design.controllers.design import design
from design.controllers.validate import validate, validation_document
from design.identified.trace_logs import Traced
from design.machine.documents import design_document, model_document
from design.machine.model import Model
from design.machine.slip_of_scale import moved_between, no_wear
from design.machine.source import Source
from design.measured.drift_document import detectable_sizes
from design.measured.drift_of_logs import Stream, drift_of
from identification.drift.mewma import DriftState
from identification.drift.readings import Moved, Reading, moved_by, reading_of
from identification.effects._library import Library
from identification.errors import BadLog, BadModel, BadSpecification, NotIdentifiable, UserError
from identification.log import Log
from workbench.cards.own_effects import library as installed
from workbench.documents.reading import Stored
from workbench.documents.result_files import read_design, read_model
from workbench.jobs.passes import Task
from workbench.logs.sources import Sources, read_sources
from workbench.output import dumps, strict
from workbench.registry.values import Candidate, Judgement
from workbench.report.drift import reason_sentence
from workbench.report.trace_words import trace_sentence
from workbench.steps.drift import model_key
from workbench.steps.identify_sources import identify_sources
from workbench.steps.trace import trace_sources

TestedDrift = Literal["none", "drift", "structure", "not_judged"]


@dataclass(frozen=True)
class Drift:
    """Verdict of a test: which parameters moved, and why.

    p_value: of the smallest kind, over all parameters. unsure: parameters of which some have
    changed, and nobody can say which; could_have_seen: smallest relative change of each that would
    have been found, None where none would. state: what the same test wants to be given with the
    next log; plain JSON. parameters: what the log gave of each, moved or not.
    """

    verdict: TestedDrift
    reason: str
    moved: tuple[Moved, ...] = ()
    p_value: float | None = None
    state: Mapping[str, Any] = field(default_factory=dict)
    unsure: tuple[str, ...] = ()
    could_have_seen: Mapping[str, float | None] = field(default_factory=dict)
    parameters: tuple[Reading, ...] = ()


# A test of a new log against the active model; of the state of the log before under it, empty at
# first.
DriftJudge = Callable[[Model, Sources, np.random.Generator, Mapping[str, Any]], Drift]


def drift_by_chart(
    model: Model, sources: Sources, rng: np.random.Generator, state: Mapping[str, Any]
) -> Drift:
    """The verdict on a log alone and by the mean of those since the model is active.

    Raises BadModel where the stored state is none, or model and card are of different machines.
    """
    stream = Stream(_state(state), ()) if state else None
    seed = int(rng.integers(2**31))
    found = drift_of(model, model_key(model), sources.logs, stream=stream, seed=seed)
    worst = [one.test for one in found.tests if one.test.verdict == found.verdict][-1]
    state_now: Any = strict(found.stream.state)
    statistics = [one for one in (worst.single, worst.mean) if one is not None]
    return Drift(
        verdict=found.verdict,
        reason=reason_sentence(worst, found.settings.to_be_seen),
        moved=tuple(moved_by(one) for one in worst.moved),
        p_value=min((one.p_value for one in statistics), default=None),
        state=state_now,
        unsure=worst.unsure,
        could_have_seen=detectable_sizes(worst),
        parameters=tuple(reading_of(one) for one in worst.shifts.values()),
    )


def _state(state: Mapping[str, Any]) -> DriftState:
    try:
        return TypeAdapter(DriftState).validate_json(dumps(state), strict=True)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        raise BadModel(f"stored drift state: {first['loc']}: {first['msg']}") from None


HELD_OUT_SHARE = 0.35  # of a log's time that a challenger is not fitted on


@dataclass(frozen=True)
class Chain:
    """A judge (`workbench.jobs.passes.Judge`): drift test, identification, design, contest.

    The model is fitted on the first 65 % of each run; the rest is held out. Logs on which the
    active model was fitted do not test it. library: the effects that models may name, by
    default all but a user's own files.
    """

    drift: DriftJudge = drift_by_chart
    terms: Terms = field(default_factory=Terms)
    seed: int = 0
    library: Library | None = None

    def __call__(self, task: Task) -> Judgement:
        """The judgement of one log; raises as `Judge` says."""
        sources = read_sources([str(task.path)], str(task.card))
        if task.model is None:
            return self._first(sources)
        champion = _contender(task, self.library)
        if any(entry.sha256 == task.log.sha256 for entry in champion.model.log):
            return Judgement("none", "the active model was fitted on this log")
        rng = np.random.default_rng(self.seed)
        state = (task.previous or {}).get("state", {})
        found = self.drift(champion.model, sources, rng, state)
        drift = {key: value for key, value in asdict(found).items() if key != "state"}
        evidence = {"drift": drift, "state": found.state}
        if found.verdict == "structure":
            return self._traced(champion, sources, found, evidence)
        if found.verdict != "drift":
            return Judgement(found.verdict, found.reason, evidence=evidence)
        train, held_out = divided(sources)
        challenger, candidate, refused = self._anew(champion.model, train, held_out)
        if challenger is None:
            return Judgement("refused", f"{found.reason}; {refused}", candidate, evidence)
        return self._challenge(champion, challenger, candidate, held_out, found.reason, evidence)

    def _first(self, sources: Sources) -> Judgement:
        """A machine's first model, where its design keeps every limit in simulation."""
        challenger, candidate, refused = self._made(sources)
        if refused or challenger is None:
            return Judgement("refused", f"no first model: {refused}", candidate)
        return Judgement("promoted", "the machine's first model; its design passes", candidate)

    def _traced(
        self, champion: Contender, sources: Sources, found: Drift, evidence: Mapping[str, Any]
    ) -> Judgement:
        """What the active model lacks, by the trace; a model that has it, against that one."""
        train, held_out = divided(sources)
        library = self.library or installed()
        try:
            traced = trace_sources(train, _as_test(train, held_out), library, self.seed)
        except UserError as error:
            said = _then(found.reason, f"the trace: {error}")
            return Judgement("structure", said, evidence=evidence)
        evidence = {**evidence, "trace": _summary(traced)}
        reason = _then(found.reason.removesuffix("; trace it"), trace_sentence(traced))
        if traced.trace.verdict not in ("effect", "none"):
            return Judgement("structure", reason, evidence=evidence)
        # "none": other parameters do, which the test did not find.
        effect = traced.trace.verdict == "effect"
        made = self._designed(traced.model) if effect else self._made(train)
        challenger, candidate, refused = made
        if challenger is None or challenger.design is None:
            return Judgement("refused", _then(reason, refused), candidate, evidence)
        return self._challenge(champion, challenger, candidate, held_out, reason, evidence)

    def _challenge(
        self,
        champion: Contender,
        challenger: Contender,
        candidate: Candidate | None,
        held_out: Sequence[Log],
        said: str,
        evidence: Mapping[str, Any],
    ) -> Judgement:
        """A model of the machine as it is now, against the active one; said: why it was made."""
        rng = np.random.default_rng(self.seed)
        contest = challenge(champion, challenger, held_out, rng, self.terms)
        evidence = {**evidence, "contest": asdict(contest)}
        reason = _then(said, contest.reason)
        moved = moved_between(champion.model.friction, challenger.model.friction)
        rotary = champion.model.rotary
        by_hand = no_wear(moved, rotary)
        if by_hand and (contest.won or contest.model_won):
            reason = f"{by_hand}: nothing is replaced by itself, a person decides; {reason}"
            return Judgement("refused", reason, candidate, evidence)
        if contest.won:
            return Judgement("promoted", reason, candidate, evidence)
        model_alone = contest.model_won and self._with_active_controllers(champion, challenger)
        if not model_alone or candidate is None:
            return Judgement("refused", reason, candidate, evidence)
        stays = f"{reason}; so the model is replaced and the controllers stay"
        return Judgement("promoted", stays, model_alone, evidence, (candidate, reason))

    def _with_active_controllers(
        self, champion: Contender, challenger: Contender
    ) -> Candidate | None:
        """The new model with the active controllers, where they pass on it.

        The compensator holds the friction of the new model, as of any design made for it.
        """
        if champion.design is None:
            return None
        fresh = challenger.design or champion.design
        made = replace(champion.design, compensator=fresh.compensator)
        model, rng = challenger.model, np.random.default_rng(self.seed)
        checked, _ = validate(model, made, rng)
        if not checked.passed:
            return None
        return Candidate(model_document(model), design_document(made), validation_document(checked))

    def _anew(
        self, champion: Model, train: Sources, held_out: Sequence[Log]
    ) -> tuple[Contender | None, Candidate | None, str]:
        """A drifted machine's model, with the effects of the active one where they show."""
        if champion.acting:
            known = {one.key: one.effect for one in champion.acting}
            traced = trace_sources(train, _as_test(train, held_out), known, self.seed)
            if traced.trace.effects:
                return self._designed(traced.model)
        return self._made(train)

    def _made(self, sources: Sources) -> tuple[Contender | None, Candidate | None, str]:
        """Model, design and validation of the sources, and what speaks against them."""
        try:
            model = identify_sources(sources, seed=self.seed).model
        except NotIdentifiable as error:
            return None, None, f"no model: {error}"
        return self._designed(model)

    def _designed(self, model: Model) -> tuple[Contender, Candidate, str]:
        """Design and validation of a model, and what speaks against them."""
        try:
            made = design(model)
        except (BadSpecification, NotIdentifiable) as error:
            return Contender(model, None), Candidate(model_document(model)), f"no design: {error}"
        checked, _ = validate(model, made, np.random.default_rng(self.seed))
        candidate = Candidate(
            model_document(model), design_document(made), validation_document(checked)
        )
        refused = "; ".join(checked.figures[checked.judged]["model"].missed)
        if made.recommended == "none":
            refused = "no controller keeps its goals"
        return Contender(model, made), candidate, refused


def _then(said: str, more: str) -> str:
    """Two sentences, of which the first may have its full stop or not."""
    return f"{said.removesuffix('.')}. {more[:1].upper()}{more[1:]}"


def divided(sources: Sources) -> tuple[Sources, list[Log]]:
    """The first part of every run to fit on, and the rest, which no fit has seen."""
    train: list[Source] = []
    rest: list[Log] = []
    for source in sources.runs:
        cut = round((1.0 - HELD_OUT_SHARE) * len(source.log))
        train.append(replace(source, log=source.log.part(0, cut), rows=cut))
        rest.append(source.log.part(cut, len(source.log)))
    if not any(log.duration > 0 for log in rest):
        raise BadLog("the log is too short to hold a part of it out; log a longer run")
    return replace(sources, runs=tuple(train)), rest


def _as_test(train: Sources, held_out: Sequence[Log]) -> Sources:
    """The held-out parts as test runs of a trace; parts of the same files, so marked as such."""
    runs = tuple(
        replace(source, log=log, rows=len(log), sha256=f"{source.sha256}, held out")
        for source, log in zip(train.runs, held_out, strict=True)
    )
    return replace(train, runs=runs, remarks=())


def _summary(traced: Traced) -> dict[str, Any]:
    """Of a trace, what the registry keeps."""
    found = traced.trace
    return {
        "verdict": found.verdict,
        "effects": {one.effect.key: one.params for one in found.effects},
        "before": found.before,
        "after": found.after,
    }


def _contender(task: Task, library: Library | None) -> Contender:
    """The active model and design, read as from their files."""
    try:
        found = read_model(Stored("model.json", task.model or {}), library)
        made = None if task.design is None else read_design(Stored("design.json", task.design))
    except BadModel as error:
        raise BadModel(f"{task.machine}: active version: {error}") from None
    return Contender(found, made)
