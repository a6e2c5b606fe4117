"""Verdict: what is left on the test logs and on those of the fit, and what is to be said of it."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from identification.estimation.regression.equation_rows import MECHANICAL, MotionLog
from identification.estimation.structure_fit import FittedStructure
from identification.log import Rig
from identification.remarks import MinorRemark
from identification.thresholds import ASTRAY, OF_ACCOUNT
from identification.tracing.free_run.trial_structures import driven_only
from identification.tracing.levels_refitted import levels_refitted
from identification.tracing.model_errors import (
    NoiseFloor,
    OnTest,
    errors_of,
    follows,
    lacks,
    noise_floor,
    on_test,
    predicted,
    share_left,
)
from identification.tracing.parameter_drift import parameter_drift
from identification.tracing.probability import Evidence, is_probable, probability
from identification.tracing.regression.stepwise import Choice
from identification.tracing.remaining_structure import remaining_structure, strongest
from identification.tracing.result import Change, Dependence, Errors, Left, TraceVerdict
from identification.tracing.structure_search import Refinement, Selection, without_effects
from identification.tracing.verdict import explains_most, verdict_of

NOTHING = Dependence((), 0.0)
AS_LARGE_AS_FRICTION = (
    "what is left of the force is larger than friction itself, by these logs' noise or by what it"
    " hides"
)


@dataclass(frozen=True, eq=False)
class Judgement:
    """The verdict, the errors of the plain model and with the effects, and what is left of them."""

    verdict: TraceVerdict
    before: Mapping[str, Errors]
    after: Mapping[str, Errors]
    left: Dependence
    drift: tuple[Change, ...]
    remarks: tuple[str, ...]
    complete: bool
    rest: Left


@dataclass(frozen=True, eq=False)
class HeldOut:
    """What the plain model and the refined one leave of the test logs, and of the training logs.

    now: what the refined one leaves of the test logs; share: of what was missing there, that is
    left; changed: parameters; lacking: whether something of account is missing on the training
    logs; coulomb [N]: the larger level of the plain model; followed: whether the refined one's run
    of the test logs leaves their noise alone, where the plain one's leaves more.
    """

    before: Mapping[str, Errors]
    after: Mapping[str, Errors]
    now: OnTest
    noise: NoiseFloor
    share: float
    changed: tuple[Change, ...]
    lacking: bool
    coulomb: float
    followed: bool

    @property
    def proved(self) -> bool:
        """Whether what was found explains most of what was missing; a machine that changed beside
        leaves more, but no more than before."""
        beside = bool(self.changed) and self.share < 1.0 and not self.lacking
        return explains_most(self.share) or beside

    @property
    def hides_friction(self) -> bool:
        """Whether what is left of the force, however much of it is noise, is larger than friction
        itself, so that an effect of its size would not show."""
        left = self.after["test"]
        if left.force_rms is None or left.force_relative is None:
            return False
        return left.force_rms > self.coulomb and left.force_relative > OF_ACCOUNT


def held_out(chosen: Selection, found: Refinement, seen: Sequence[MotionLog], rig: Rig) -> HeldOut:
    """What a refined structure leaves; seen: the test logs, recorded as the others."""
    rows, plain = chosen.plain.rows, chosen.plain.model
    choice, after, logs = found.choice, found.model, list(rows.logs)
    slowest, unseen = choice.base[MECHANICAL].slowest, seen or logs
    errors_before = errors_of(plain, slowest, (), logs, seen, rows.drive)
    errors_after = errors_of(after, slowest, choice.steps, logs, seen, rows.drive)
    noise = noise_floor(choice.base)
    was = on_test(plain, errors_before["test"], unseen, rows.drive)
    now = was if after is plain else on_test(after, errors_after["test"], unseen, rows.drive)
    changed = parameter_drift(after, choice.steps, seen, rig) if seen else ()
    coulomb = max(plain.plant.friction.F_cp, plain.plant.friction.F_cn)
    return HeldOut(
        errors_before, errors_after, now, noise, share_left(was, now, noise, coulomb),
        tuple(changed), lacks(after, errors_after["train"], noise), coulomb, follows(was, now),
    )  # fmt: skip


def judgement(
    chosen: Selection, found: Refinement, held: HeldOut, terms: Evidence,
    seen: Sequence[MotionLog], rig: Rig,
) -> Judgement:  # fmt: skip
    """What is to be said of a refined structure that leaves `held`, and whose effects, if any, are
    proved by the held-out logs `seen`; terms: the evidence of these."""
    rows, plain = chosen.plain.rows, chosen.plain.model
    choice, after, logs = found.choice, found.model, list(rows.logs)
    changed = held.changed
    left = _left(choice, after, chosen) if held.lacking else NOTHING
    sure, doubts = probability(terms), list[str]()
    if choice.steps and not is_probable(sure):
        doubts.append(_hardly_probable(choice, sure))
    if held.hides_friction:
        doubts.append(AS_LARGE_AS_FRICTION)
    known = not doubts and (bool(choice.steps) or not held.lacking)
    verdict = verdict_of(choice, changed) if known else "unknown"
    if held.lacking and seen and not (doubts or choice.steps or after.imposed):
        told = plain.plant.friction if after.fit is None else after.fit.friction
        levels, how = levels_refitted(plain.plant, told, logs, seen, rows.drive, rig)
        verdict, changed = ("drift", levels) if levels else (verdict, changed)
        doubts = [how] if levels else doubts
    said = (*_remarks(choice, after, left, logs, seen, rig), *doubts)
    complete = verdict != "unknown" and predicted(held.now, held.noise)
    return Judgement(
        verdict, held.before, held.after,
        left if verdict == "unknown" else NOTHING, changed, said,
        complete=complete, rest=Left(0.0 if complete else held.share, left.depends_on),
    )  # fmt: skip


def _hardly_probable(choice: Choice, sure: float) -> str:
    """What to say of effects that are rather others' stand-ins than the machine's."""
    names = " and ".join(step.candidate.effect.key for step in choice.steps)
    return (
        f"like {names}, but rather another effect that resembles what they do: of machines on which"
        f" as much is left, {100 * sure:.0f} % have what is named"
    )


def _left(choice: Choice, after: FittedStructure, chosen: Selection) -> Dependence:
    """On what the rest depends, or all that was missing, where nothing tells of the rest."""
    plain, rows = chosen.plain, chosen.plain.rows
    left = strongest(choice, after, list(rows.logs), rows.drive)
    if choice.steps and not left.depends_on:
        left = remaining_structure(without_effects(plain, choice), plain.model)
    return left


def _remarks(
    choice: Choice,
    after: FittedStructure,
    left: Dependence,
    logs: Sequence[MotionLog],
    seen: Sequence[MotionLog],
    rig: Rig,
) -> Iterator[str]:
    """What whoever reads the trace has to know of it."""
    if after.imposed and after.stage.imposed:
        yield "the rig forces the motion, no inertia shows: errors are those of the force alone"
    elif after.imposed:
        yield "inertia does not show beside what is left, so errors are those of the force alone"
    elif choice.steps and after.misfit > ASTRAY:
        yield (
            f"the free run still leaves {np.sqrt(after.misfit):.0f} times the position's noise:"
            " band and stick limits are not to be trusted, or more is missing"
        )
    if left.swing > 0.0:
        yield (
            f"what is left swings at {left.swing:.3g} Hz whatever the motion does: a vibration from"
            " outside, or another loop"
        )
    if not after.imposed and driven_only(logs):
        motor = (
            " nor a dead zone of the command be distinguishable from friction"
            if rig.kind == "motor"
            else ""
        )
        yield (
            "the force hardly ever opposes the motion, so friction in proportion to it would not"
            f" show{motor} (a run that brakes hard would show it)"
        )
    if seen and not any(len(one.sliding.start) for one in seen):
        yield "the body does not slide in the test logs, so they say nothing of the force error"
    if not seen:
        yield MinorRemark("no test log: the test errors are those of stretches left out in turn")
