"""Verdict: what is left on the test logs and on those of the fit, and what is to be said of it."""

from collections.abc import Iterator

import numpy as np

from identification.remarks import MinorRemark
from identification.thresholds import ASTRAY
from identification.tracing.free_curve import free_curves
from identification.tracing.held_out import AS_LARGE_AS_FRICTION, HeldOut
from identification.tracing.levels_refitted import levels_refitted
from identification.tracing.model_errors import predicted
from identification.tracing.probability import is_probable, probability
from identification.tracing.recorded_rows import driven_only
from identification.tracing.remaining_structure import strongest
from identification.tracing.residuals import residuals_of, run_residual
from identification.tracing.result import Dependence, Left, Trace
from identification.tracing.verdict import (
    found_effect,
    next_experiment,
    parameters_before,
    parameters_of,
    rivals_of,
    verdict_of,
)

NOTHING = Dependence((), 0.0)


def judgement(held_out: HeldOut) -> Trace:
    """What is to be said of a refined structure whose effects, if any, are proved by the held-out
    logs."""
    plain, choice, after, changed = (
        held_out.plain,
        held_out.choice,
        held_out.model,
        held_out.changed,
    )
    before, rows, terms = plain.model, plain.rows, held_out.evidence
    on_test = held_out.shows_more_than_training
    lacking = held_out.lacking or held_out.lacks_force or on_test
    left = _left(held_out, on_test=on_test) if lacking else NOTHING
    doubts = [*_doubts(held_out)]
    known = not doubts and (bool(choice.steps) or not lacking)
    verdict = verdict_of(choice, changed) if known else "unknown"
    levels_alone = (
        held_out.lacking and not held_out.lacks_force
    )  # a force of account is no other level
    if levels_alone and held_out.seen and not (doubts or choice.steps or after.prescribed):
        friction = before.plant.friction if after.fit is None else after.fit.friction
        levels, how = levels_refitted(
            before.plant, friction, held_out.logs, held_out.seen, held_out.drive, plain.recorded.rig
        )
        if levels:
            verdict, changed, doubts = "drift", levels, [how]
    was = parameters_before if choice.steps else parameters_of
    complete = verdict != "unknown" and predicted(held_out.now, held_out.noise)
    unknown = left if verdict == "unknown" else NOTHING
    return Trace(
        verdict=verdict,
        before=held_out.before,
        after=held_out.after,
        noise_y=float(np.mean([one.noise.y for one in rows.logs])),
        noise_F=float(np.mean([one.noise.F for one in rows.logs])),
        noise_force=held_out.noise.force_rms or 0.0,
        noise_actuator=held_out.noise.actuator_rms,
        effects=tuple(found_effect(s, after, terms) for s in choice.steps),
        rivals=rivals_of(choice, held_out.seen),
        unknown=unknown,
        drift=changed,
        next_experiment=next_experiment(verdict, choice, unknown),
        parameters_before=was(before, plain.recorded),
        parameters_after=parameters_of(after, plain.recorded),
        plant=after.plant,
        residuals=residuals_of(choice),
        run=run_residual(before, after, rows.logs, rows.drive),
        remarks=(*rows.remarks, *_remarks(held_out, left), *doubts),
        complete=complete,
        left=Left(0.0 if complete else held_out.share, left.depends_on),
        command_period=rows.recorded.command_period,
        curves=free_curves(choice),
        missing_force=held_out.missing,
        evidence=terms if choice.steps else (),
    )


def _left(held_out: HeldOut, *, on_test: bool) -> Dependence:
    """On what the rest depends; on_test: the test logs lack more than those of the fit."""
    logs, judged = held_out.logs, held_out.choice
    if on_test:
        logs, judged = held_out.seen, held_out.choice_on_test
    missing = None if held_out.missing is None else held_out.missing.sliding
    return strongest(judged, held_out.model, logs, held_out.drive, missing)


def _doubts(held_out: HeldOut) -> Iterator[str]:
    """Why nothing is known, though effects may explain what was missing."""
    steps, sure = held_out.choice.steps, probability(held_out.evidence)
    if steps and not is_probable(sure):
        names = " and ".join(step.candidate.effect.key for step in steps)
        yield (
            f"like {names}, but rather another effect that resembles what they do: of machines on"
            f" which as much is left, {100 * sure:.0f} % have what is named"
        )
    if held_out.hides_friction:
        yield AS_LARGE_AS_FRICTION


def _remarks(held_out: HeldOut, left: Dependence) -> Iterator[str]:
    """What whoever reads the trace has to know of it."""
    model = held_out.model
    if model.prescribed and model.stage.prescribed:
        yield "the rig forces the motion, no inertia shows: errors are those of the force alone"
    elif model.prescribed:
        yield "inertia does not show beside what is left, so errors are those of the force alone"
    elif held_out.choice.steps and model.misfit > ASTRAY:
        yield (
            f"the free run still leaves {np.sqrt(model.misfit):.0f} times the position's noise:"
            " band and stick limits are not to be trusted, or more is missing"
        )
    if left.swing > 0.0:
        yield (
            f"what is left swings at {left.swing:.3g} Hz whatever the motion does: a vibration from"
            " outside, or another loop"
        )
    if driven_only(held_out.logs):
        motor = (
            " nor a dead zone of the command be distinguishable from friction"
            if held_out.plain.recorded.by_motor
            else ""
        )
        yield (
            "the force hardly ever opposes the motion, so friction in proportion to it would not"
            f" show{motor} (a run that brakes hard would show it)"
        )
    if held_out.seen and not any(len(one.sliding.start) for one in held_out.seen):
        yield "the body does not slide in the test logs, so they say nothing of the force error"
    if not held_out.seen:
        yield MinorRemark("no test log: the test errors are those of stretches left out in turn")
