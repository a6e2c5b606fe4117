"""From residual to missing effect: what the plain model leaves, which effect explains it, and the
error before and after on data that neither the fit nor the choice has seen.

Five stages: the logs as rows; the plain model; the effects that the equations call for (candidates
and selection); those that the free run confirms, refined; the verdict.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.effects._library import Library
from identification.errors import NotIdentifiable
from identification.estimation.imposed_motion import way_of
from identification.estimation.late_position import what_acts_beside
from identification.estimation.recorded_logs import chosen_drive
from identification.estimation.regression.equation_rows import ACTUATOR, MECHANICAL, MotionLog
from identification.estimation.regression.motion_log import motion_log
from identification.estimation.structure_fit import FittedStructure, band
from identification.estimation.two_masses import two_masses
from identification.log import Log, Rig
from identification.model.estimates import Estimate
from identification.model.surroundings import Surroundings
from identification.progress import Halt, KeepGoing, Progress, quiet, without_end
from identification.remarks import MinorRemark
from identification.signals.check import check_driven
from identification.thresholds import COMPLETE, WORSE
from identification.tracing.free_curve import free_curves
from identification.tracing.judgement import (
    AS_LARGE_AS_FRICTION,
    HeldOut,
    Judgement,
    held_out,
    judgement,
)
from identification.tracing.lag_beside import follows_with_lag, lag_beside
from identification.tracing.model_errors import row_noise
from identification.tracing.plain_model import plain_model
from identification.tracing.predictive_check import predicts_worse
from identification.tracing.probability import Evidence, evidence
from identification.tracing.recorded_rows import RecordedRows, recorded_rows
from identification.tracing.regression.stepwise import Choice
from identification.tracing.remaining_structure import FEWEST_ROWS
from identification.tracing.result import MissingForce, Trace, TraceVerdict
from identification.tracing.structure_search import (
    Refinement,
    Selection,
    first_effect,
    refinement,
    selection,
    settled_plain,
    share_beside,
    without_effects,
)
from identification.tracing.surroundings_told import orders_alone, with_surroundings
from identification.tracing.verdict import (
    found_effect,
    missing_force,
    next_experiment,
    parameters_of,
    residuals_of,
    rivals_of,
    run_residual,
)

OF_AN_ANGLE = ("gravity",)  # effects of rotary machines alone
MOVE_IT = "a held-out run in which the body moves: in this one it rests, so nothing can be tested"
ONE_WAY_ALONE = (
    "motion in one direction, in which only cogging is distinguishable from friction and a constant"
    " force"
)
BY_FORCE = (
    "traced by the measured force: what the command leaves unknown lies between it and the force,"
    " in the actuator"
)
FOR_NOW = "for now, since the trace ended early"


def trace(
    train: Sequence[Log], test: Sequence[Log], rig: Rig, library: Library,
    rng: np.random.Generator, *, on_progress: Progress | None = None,
    keep_going: KeepGoing = without_end,
) -> Trace:  # fmt: skip
    """What the logs call for beyond the plain model, and the errors before and after.

    train: logs for choice and fit; test: logs that neither sees (where there are none, stretches
    of the training logs are left out in turn, and a remark says so). Each has y [m], F [N] and,
    where the command is logged, u [V], on an even clock. keep_going: asked before every run; once
    it says no, the best so far is the result, and `not_tried` says what is not in it. Raises BadLog
    where a signal is missing, NotIdentifiable where too little of the motion slides.
    """
    for log in (*train, *test):
        check_driven(log)
    report = on_progress or quiet
    halt = Halt(keep_going)
    beside = what_acts_beside(train, rig, halt)
    recorded_as = train, test
    train, test = ([beside.taken_out(log) for log in logs] for logs in (train, test))
    if rig.motion == "linear":
        library = {key: effect for key, effect in library.items() if key not in OF_AN_ANGLE}
    still = bool(test) and not any(_slides(log, rig) for log in test)
    if still:  # nothing could be proved of an effect
        library = {}
    if beside.orders and way_of(train, held=rig.kind == "motor") is not None:
        return orders_alone(NotIdentifiable(ONE_WAY_ALONE), beside, *recorded_as, rig, rng)
    try:
        told = _traced(train, test, rig, library, rng, report, halt)
    except NotIdentifiable as refused:
        if not beside.orders:
            raise
        return orders_alone(refused, beside, *recorded_as, rig, rng)
    if told.verdict == "unknown" and _commanded(train, rig) and not halt.reached():
        told = _by_force(told, train, test, rig, library, rng, report, halt)
    beside, told = _with_lag(beside, told, recorded_as, rig, library, rng, report, halt)
    if still:
        told = replace(told, verdict="unknown", complete=False, next_experiment=MOVE_IT)
    if not beside.none:
        told = with_surroundings(told, beside, *recorded_as, rig)
    if beside.sampled:  # a measured current, which no period holds
        told = replace(told, command_period=0.0)
    elastic = told.verdict == "unknown" and not told.effects and not halt.reached()
    if not elastic or chosen_drive(train, rig, None) != "force":
        return told
    resonance = two_masses(train, rig)
    if resonance is None:
        return told
    around = replace(beside, resonance=resonance)
    return replace(told, surroundings=around, missing_force=None)  # which is of one body


def _commanded(logs: Sequence[Log], rig: Rig) -> bool:
    """Whether a valve's command is logged, from which the force of an actuator follows."""
    return rig.kind != "motor" and all("u" in log for log in logs)


def _by_force(
    told: Trace, train: Sequence[Log], test: Sequence[Log], rig: Rig, library: Library,
    rng: np.random.Generator, report: Progress, halt: Halt,
) -> Trace:  # fmt: skip
    """The trace by the measured force, where it knows what that by the command does not: an
    actuator that is not linear leaves its error in every run by the command."""
    alone = [[_without_command(log) for log in logs] for logs in (train, test)]
    try:
        again = _traced(alone[0], alone[1], rig, library, rng, report, halt)
    except NotIdentifiable:
        return told
    if again.verdict == "unknown":
        return told
    like = " and ".join(one.effect.key for one in told.effects)
    said = f"{BY_FORCE}, which acts like {like}" if like else BY_FORCE
    return replace(again, remarks=(*again.remarks, said))


def _without_command(log: Log) -> Log:
    return replace(log, signals={key: x for key, x in log.signals.items() if key != "u"})


def _with_lag(
    beside: Surroundings, told: Trace, recorded_as: tuple[Sequence[Log], Sequence[Log]], rig: Rig,
    library: Library, rng: np.random.Generator, report: Progress, halt: Halt,
) -> tuple[Surroundings, Trace]:  # fmt: skip
    """What acts beside the applied force and the trace, with a lag of the columns that an effect
    has hidden, where less is left with it."""
    if told.complete or beside.lag.value or halt.reached():
        return beside, told
    lag = lag_beside(told.plant, [beside.taken_out(log) for log in recorded_as[0]], rig)
    if not lag.value:
        return beside, told
    late = replace(beside, lag=lag)
    train, test = ([late.taken_out(log) for log in logs] for logs in recorded_as)
    try:
        again = _traced(train, test, rig, library, rng, report, halt)
    except NotIdentifiable:
        return beside, told
    return (late, again) if follows_with_lag(told, again) else (beside, told)


def _traced(
    train: Sequence[Log], test: Sequence[Log], rig: Rig, library: Library,
    rng: np.random.Generator, report: Progress, halt: Halt,
) -> Trace:  # fmt: skip
    """The trace of logs on which nothing acts but the applied force and what the library has."""
    begin, settle, choose = rng.spawn(3)
    chosen = _chosen(train, rig, library, (begin, choose), report, halt)
    report("refitting", 0.0)
    found = refinement(chosen, report)
    with halt.closing():
        seen = [chosen.plain.rows.recorded.given(log) for log in test]
        found, held, doubt = _proved(chosen, found, seen, rig)
    report("settling", 0.0)
    chosen, found = settled_plain(chosen, found, settle, report)
    report("telling", 0.0)
    with halt.closing():
        held = held or held_out(chosen, found, seen, rig)
        lacks = _missing(chosen, found, seen)
        terms = evidence(_share_left(found, held, lacks), len(found.choice.steps))
        judged = judgement(chosen, found, held, terms, seen, rig)
        told = _told(chosen, found, judged, terms, halt.not_tried, seen, lacks)
    return replace(told, remarks=(*told.remarks, doubt)) if doubt else told


def _share_left(found: Refinement, held: HeldOut, lacks: MissingForce | None) -> float:
    """The share of the missing force that effects leave: none where the run leaves nothing but
    noise; by the error of the run of those that act in stops alone, of which the force while
    sliding says nothing."""
    if held.followed:
        return 0.0
    of_error = float(np.sqrt(held.share))
    of_force = None if lacks is None else lacks.share_left
    if of_force is None:
        return of_error
    in_stops = all(step.candidate.effect.place.in_stops for step in found.choice.steps)
    return min(of_force, of_error) if in_stops else of_force


def _missing(
    chosen: Selection, found: Refinement, seen: Sequence[MotionLog]
) -> MissingForce | None:  # fmt: skip
    """The force that the plain model and the refined one lack on the test logs, or without them on
    those of the fit."""
    choice, after, logs = found.choice, found.model, list(chosen.plain.rows.logs)
    slowest = max(choice.base[MECHANICAL].slowest, choice.start.band, band(after))
    return missing_force(chosen.plain.model, after, seen or logs, slowest)


def _slides(log: Log, rig: Rig) -> bool:
    """Whether the body slides in a log, for long enough to judge."""
    one = motion_log(log, held=rig.kind == "motor", by_command=False)
    return len(one.sliding.start) >= FEWEST_ROWS


def _proved(
    chosen: Selection, found: Refinement, seen: Sequence[MotionLog], rig: Rig
) -> tuple[Refinement, HeldOut | None, str]:
    """The refinement and what it leaves of the held-out logs, or the plain model where its effects
    do not explain most of what was missing there, or predict force or position worse; and what to
    say of it."""
    plain, after = chosen.plain.model, found.model
    if not found.choice.steps:
        return found, None, ""
    held = held_out(chosen, found, seen, rig)
    if not held.proved:
        return _unproved(
            chosen, found, "more than half of what was missing on the test logs is left"
        )
    if held.hides_friction:
        return _unproved(chosen, found, AS_LARGE_AS_FRICTION)
    was, now = (one["test"].force_rms for one in (held.before, held.after))
    if was is not None and now is not None and now > WORSE * was:
        return _unproved(
            chosen, found, f"the force of the test logs is predicted worse ({was:.3g} -> {now:.3g})"
        )
    if not seen or plain.imposed or after.imposed:
        return found, held, ""
    worse = predicts_worse(plain.plant, after.plant, seen, chosen.plain.rows.drive)
    if worse is None:
        return found, held, ""
    return _unproved(
        chosen, found,
        f"the position of the test logs is predicted worse over {worse.seconds:g} s"
        f" ({worse.before:.3g} -> {worse.after:.3g} times its noise)",
    )  # fmt: skip


def _unproved(chosen: Selection, found: Refinement, said: str) -> tuple[Refinement, None, str]:
    """The plain model in place of effects that do not carry over, and what to say of it."""
    names = " and ".join(step.candidate.effect.key for step in found.choice.steps)
    plain = Refinement(without_effects(chosen.plain, found.choice), chosen.plain.model)
    return plain, None, f"the equations call for {names}, but with it {said}: not named"


def _chosen(
    train: Sequence[Log], rig: Rig, library: Library,
    rngs: tuple[np.random.Generator, np.random.Generator], report: Progress, halt: Halt,
) -> Selection:  # fmt: skip
    """The effects that the equations call for, on logs whose command is known between its samples.

    rngs: of the plain model, which is begun as `fit_plant` begins, and of the choice of effects.
    """
    _, choose = rngs
    report("recording", 0.0)
    first = _first(recorded_rows(train, rig, library, halt), rig, library, rngs, report)
    share = share_beside(first.plain, first.choice)
    if share == 0.0:
        chosen = selection(first, choose, report)
        share = share_beside(chosen.plain, chosen.choice)
        if share == 0.0:
            return chosen
    rows = recorded_rows(train, rig, library, halt, share)
    return selection(_first(rows, rig, library, rngs, report), choose, report)


def _first(
    rows: RecordedRows, rig: Rig, library: Library,
    rngs: tuple[np.random.Generator, np.random.Generator], report: Progress,
) -> Selection:  # fmt: skip
    """The plain model of the rows, and the effect that the equations call for first beside it."""
    begin, choose = rngs
    report("refining", 0.0)
    plain = plain_model(rows, library, begin)
    report("tracing", 0.0)
    return first_effect(plain, rig, choose, report)


def _told(
    chosen: Selection, found: Refinement, judged: Judgement, terms: Evidence,
    not_tried: tuple[str, ...], seen: Sequence[MotionLog], lacks: MissingForce | None,
) -> Trace:  # fmt: skip
    """All of it as the trace's result; terms: evidence of the effects; seen: the test logs."""
    rows, before = chosen.plain.rows, chosen.plain.model
    choice, after, logs = found.choice, found.model, list(rows.logs)
    return Trace(
        verdict=_so_far(judged.verdict, after, not_tried),
        before=judged.before,
        after=judged.after,
        noise_y=float(np.mean([one.noise.y for one in logs])),
        noise_F=float(np.mean([one.noise.F for one in logs])),
        noise_force=row_noise(choice.base, MECHANICAL) or 0.0,
        noise_actuator=row_noise(choice.base, ACTUATOR),
        effects=tuple(found_effect(s, after, choice, terms) for s in choice.steps),
        rivals=rivals_of(choice, seen),
        unknown=judged.left,
        drift=judged.drift,
        next_experiment=_next(judged, choice, not_tried),
        not_tried=not_tried,
        parameters_before=_estimates(before, chosen, not_tried),
        parameters_after=_estimates(after, chosen, not_tried),
        plant=after.plant,
        residuals=residuals_of(choice.start, choice.first, choice.end, choice.base),
        run=run_residual(before, after, logs, rows.drive),
        remarks=(*rows.remarks, *judged.remarks, *_left_out(not_tried)),
        complete=judged.complete and not not_tried,
        left=judged.rest,
        command_period=rows.recorded.command_period,
        curves=free_curves(choice),
        missing_force=lacks,
        evidence=terms if choice.steps else (),
    )


def _left_out(not_tried: tuple[str, ...]) -> list[str]:
    """What is to be said of a trace that was halted."""
    said = MinorRemark(f"the trace ended early; not tried: {'; '.join(not_tried)}")
    return [said] if not_tried else []  # the verdict's sentence says it too


def _next(judged: Judgement, choice: Choice, not_tried: tuple[str, ...]) -> str:
    """The run that would tell more; of a halted trace that knows nothing yet, its rest."""
    if not_tried and judged.verdict in ("none", "unknown"):
        return "first the rest of this trace, which ended early: give it more time"
    return next_experiment(judged.verdict, choice, judged.left)


def _estimates(
    model: FittedStructure, chosen: Selection, not_tried: tuple[str, ...]
) -> dict[str, Estimate]:
    """The parameters of a model; a null of a halted trace is one for now."""
    found = parameters_of(model, chosen.plain.recorded)
    if not not_tried or model.fit is not None:
        return found
    return {
        k: e if e.value is not None else replace(e, reason=f"{FOR_NOW}: {e.reason}")
        for k, e in found.items()
    }


def _so_far(
    verdict: TraceVerdict, after: FittedStructure, not_tried: tuple[str, ...]
) -> TraceVerdict:
    """The verdict of a trace that may have been halted: what was not looked for may be missing."""
    unsure = verdict in ("none", "drift") and bool(not_tried) and after.misfit > COMPLETE
    return "unknown" if unsure else verdict
