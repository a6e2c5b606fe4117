"""Verdict: what is left on the test logs and on those of the fit, and what is to be said of it."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from identification.log import Rig
from identification.remarks import MinorRemark
from identification.thresholds import ASTRAY
from identification.tracing.free_run.trial_structures import driven_only
from identification.tracing.held_out import AS_LARGE_AS_FRICTION, HeldOut
from identification.tracing.levels_refitted import levels_refitted
from identification.tracing.model_errors import predicted
from identification.tracing.probability import is_probable, probability
from identification.tracing.remaining_structure import strongest
from identification.tracing.result import Change, Dependence, TraceVerdict
from identification.tracing.verdict import verdict_of

NOTHING = Dependence((), 0.0)


@dataclass(frozen=True, eq=False)
class Judgement:
    """The verdict, on what the rest depends, what changed, and whether nothing is missing."""

    verdict: TraceVerdict
    left: Dependence
    drift: tuple[Change, ...]
    remarks: tuple[str, ...]
    complete: bool


def judgement(held: HeldOut) -> Judgement:
    """What is to be said of a refined structure whose effects, if any, are proved by the held-out
    logs."""
    choice, model, plain = held.found.choice, held.found.model, held.plain
    rig, changed = plain.recorded.rig, held.changed
    left = NOTHING
    if held.lacking:
        left = strongest(choice, model, held.logs, plain.rows.drive)
    doubts = [*_doubts(held)]
    known = not doubts and (bool(choice.steps) or not held.lacking)
    verdict = verdict_of(choice, changed) if known else "unknown"
    if held.lacking and held.seen and not (doubts or choice.steps or model.imposed):
        told = plain.model.plant.friction if model.fit is None else model.fit.friction
        levels, how = levels_refitted(
            plain.model.plant, told, held.logs, held.seen, plain.rows.drive, rig
        )
        if levels:
            verdict, changed, doubts = "drift", levels, [how]
    return Judgement(
        verdict, left, changed, (*_remarks(held, left, rig), *doubts),
        complete=verdict != "unknown" and predicted(held.now, held.noise),
    )  # fmt: skip


def _doubts(held: HeldOut) -> Iterator[str]:
    """Why nothing is known, though effects may explain what was missing."""
    steps, sure = held.found.choice.steps, probability(held.evidence)
    if steps and not is_probable(sure):
        names = " and ".join(step.candidate.effect.key for step in steps)
        yield (
            f"like {names}, but rather another effect that resembles what they do: of machines on"
            f" which as much is left, {100 * sure:.0f} % have what is named"
        )
    if held.hides_friction:
        yield AS_LARGE_AS_FRICTION


def _remarks(held: HeldOut, left: Dependence, rig: Rig) -> Iterator[str]:
    """What whoever reads the trace has to know of it."""
    model = held.found.model
    if model.imposed and model.stage.imposed:
        yield "the rig forces the motion, no inertia shows: errors are those of the force alone"
    elif model.imposed:
        yield "inertia does not show beside what is left, so errors are those of the force alone"
    elif held.found.choice.steps and model.misfit > ASTRAY:
        yield (
            f"the free run still leaves {np.sqrt(model.misfit):.0f} times the position's noise:"
            " band and stick limits are not to be trusted, or more is missing"
        )
    if left.swing > 0.0:
        yield (
            f"what is left swings at {left.swing:.3g} Hz whatever the motion does: a vibration from"
            " outside, or another loop"
        )
    if not model.imposed and driven_only(held.logs):
        motor = (
            " nor a dead zone of the command be distinguishable from friction"
            if rig.kind == "motor"
            else ""
        )
        yield (
            "the force hardly ever opposes the motion, so friction in proportion to it would not"
            f" show{motor} (a run that brakes hard would show it)"
        )
    if held.seen and not any(len(one.sliding.start) for one in held.seen):
        yield "the body does not slide in the test logs, so they say nothing of the force error"
    if not held.seen:
        yield MinorRemark("no test log: the test errors are those of stretches left out in turn")
