"""What a new log of a machine leads to: a drift test, then the model anew, or the trace, and the
contest with the active version."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal

import numpy as np

from design.challenge import Contender, Terms, challenge
from design.controllers.design import design
from design.controllers.validate import validate, validation_document
from design.identified.identify_logs import identify_logs
from design.identified.trace_logs import Traced, trace_logs
from design.judgement import Candidate, Judgement
from design.machine.documents import design_document, model_document
from design.machine.model import Model
from design.machine.slip_of_scale import moved_between, no_wear
from design.machine.source import MachineLogs, Source
from identification.drift.drift_result import Shift
from identification.effects._library import Library
from identification.errors import BadLog, BadSpecification, NotIdentifiable, UserError
from identification.log import Log

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
    moved: tuple[Shift, ...] = ()
    p_value: float | None = None
    state: Mapping[str, Any] = field(default_factory=dict)
    unsure: tuple[str, ...] = ()
    could_have_seen: Mapping[str, float | None] = field(default_factory=dict)
    parameters: tuple[Shift, ...] = ()


# A test of a new log against the active model; of the state of the log before under it, empty at
# first.
DriftJudge = Callable[[Model, MachineLogs, np.random.Generator, Mapping[str, Any]], Drift]
HELD_OUT_SHARE = 0.35  # of a log's time that a challenger is not fitted on


@dataclass(frozen=True)
class Retuning:
    """Drift test, identification, design and contest, of one log after the other.

    The model is fitted on the first 65 % of each run; the rest is held out. Logs on which the
    active model was fitted do not test it. library: the effects that a trace may name; sentence:
    what a trace says, in words.
    """

    drift: DriftJudge
    library: Callable[[], Library]
    sentence: Callable[[Traced], str]
    terms: Terms = field(default_factory=Terms)
    seed: int = 0

    def judgement(
        self, logs: MachineLogs, sha256: str, champion: Contender | None, state: Mapping[str, Any]
    ) -> Judgement:
        """The judgement of a log of this digest against the active version, None: there is none.

        state: that of the drift test after the log before. Raises as its parts do.
        """
        if champion is None:
            return self._first(logs)
        if any(entry.sha256 == sha256 for entry in champion.model.log):
            return Judgement("none", "the active model was fitted on this log")
        rng = np.random.default_rng(self.seed)
        found = self.drift(champion.model, logs, rng, state)
        drift = {key: value for key, value in asdict(found).items() if key != "state"}
        evidence = {"drift": drift, "state": found.state}
        if found.verdict == "structure":
            return self._traced(champion, logs, found, evidence)
        if found.verdict != "drift":
            return Judgement(found.verdict, found.reason, evidence=evidence)
        train, held_out = divided(logs)
        challenger, candidate, refused = self._anew(champion.model, train, held_out)
        if challenger is None:
            return Judgement("refused", f"{found.reason}; {refused}", candidate, evidence)
        return self._challenge(champion, challenger, candidate, held_out, found.reason, evidence)

    def _first(self, logs: MachineLogs) -> Judgement:
        """A machine's first model, where its design keeps every limit in simulation."""
        challenger, candidate, refused = self._made(logs)
        if refused or challenger is None:
            return Judgement("refused", f"no first model: {refused}", candidate)
        return Judgement("promoted", "the machine's first model; its design passes", candidate)

    def _traced(
        self, champion: Contender, logs: MachineLogs, found: Drift, evidence: Mapping[str, Any]
    ) -> Judgement:
        """What the active model lacks, by the trace; a model that has it, against that one."""
        train, held_out = divided(logs)
        try:
            traced = trace_logs(train, _as_test(train, held_out), self.library(), self.seed)
        except UserError as error:
            said = _then(found.reason, f"the trace: {error}")
            return Judgement("structure", said, evidence=evidence)
        evidence = {**evidence, "trace": _summary(traced)}
        reason = _then(found.reason.removesuffix("; trace it"), self.sentence(traced))
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
        by_hand = no_wear(moved, champion.model.display)
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
        self, champion: Model, train: MachineLogs, held_out: Sequence[Log]
    ) -> tuple[Contender | None, Candidate | None, str]:
        """A drifted machine's model, with the effects of the active one where they show."""
        if champion.acting:
            known = {one.key: one.effect for one in champion.acting}
            traced = trace_logs(train, _as_test(train, held_out), known, self.seed)
            if traced.trace.effects:
                return self._designed(traced.model)
        return self._made(train)

    def _made(self, logs: MachineLogs) -> tuple[Contender | None, Candidate | None, str]:
        """Model, design and validation of the sources, and what speaks against them."""
        try:
            model = identify_logs(logs, seed=self.seed).model
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


def divided(logs: MachineLogs) -> tuple[MachineLogs, list[Log]]:
    """The first part of every run to fit on, and the rest, which no fit has seen."""
    train: list[Source] = []
    rest: list[Log] = []
    for source in logs.runs:
        cut = round((1.0 - HELD_OUT_SHARE) * len(source.log))
        train.append(replace(source, log=source.log.part(0, cut), rows=cut))
        rest.append(source.log.part(cut, len(source.log)))
    if not any(log.duration > 0 for log in rest):
        raise BadLog("the log is too short to hold a part of it out; log a longer run")
    return replace(logs, runs=tuple(train)), rest


def _as_test(train: MachineLogs, held_out: Sequence[Log]) -> MachineLogs:
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
