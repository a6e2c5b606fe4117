"""Structures with fewer effects: what the run does as well without is taken out.

While the plain run is not followed its band is not known, and the passage through it looks like an
effect of slow motion; a second effect may have made the first one needless.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import takewhile

import numpy as np

from identification.approach import closer, more_load
from identification.choice import Choice, Step, absorb, material, settled
from identification.effects._base import Effect
from identification.evidence import Moving
from identification.library import Library
from identification.log import Rig
from identification.outcome import Outcome
from identification.plant import Plant
from identification.refit import COMPLETE, Refit, even, loose, refit
from identification.result import Drive
from identification.stage import Stage
from identification.structure import Model, band, model_of

NEAR = 8.0  # misfit up to which a run is nearly followed
NEEDLESS = 1.02  # relative misfit without an effect that is not needed


@dataclass(frozen=True, eq=False)
class Setting:
    """What every trial needs: logs whole and cut short, how they are driven, and the library."""

    logs: Sequence[Moving]
    short: Sequence[Moving]
    drive: Drive
    rig: Rig
    library: Library
    start: Stage
    first: Mapping[str, Outcome]
    plain: Model
    rng: np.random.Generator


def fitted(choice: Choice, setting: Setting) -> Model:
    """The model of a choice made on the equations."""
    near = None if setting.plain.led else setting.plain.plant.friction
    return model_of(
        choice.end, choice.base, choice.steps, setting.logs, setting.drive, setting.rig,
        setting.rng, near=near,
    )  # fmt: skip


def without_slow(choice: Choice) -> Choice:
    """The choice up to the first effect of slow or micro-motion, which is left to the run to find.

    While the band is not known, the passage through it may have been taken for one, and what was
    chosen after it was chosen beside it.
    """

    def sure(step: Step) -> bool:
        effect = step.candidate.effect
        return not slow_motion(effect) and effect.acts != "bristle"

    stay = tuple(takewhile(sure, choice.steps))
    if len(stay) == len(choice.steps):
        return choice
    end, base = with_steps(stay, choice.start, choice.first)
    return Choice(choice.start, choice.first, stay, end, base, choice.tried)


def doubted(choice: Choice, after: Model, setting: Setting) -> tuple[Choice, Model]:
    """Without an effect of slow motion that the run does as well without, or that its band hides.

    While the band was not known, the passage through it may have been taken for such an effect.
    """
    for step in choice.steps:
        if not slow_motion(step.candidate.effect):
            continue
        stay = tuple(one for one in choice.steps if one is not step)
        end, base = with_steps(stay, choice.start, choice.first)
        less = Choice(choice.start, choice.first, stay, end, base, choice.tried)
        found = refined(keeping(after.plant, stay), setting)
        other = Model(end, base, found.plant, found.sd, False, found.misfit)
        if other.misfit > COMPLETE:
            again = fitted(less, setting) if stay else setting.plain
            other = again if again.misfit < other.misfit else other
        beyond = replace(step.stage, band=band(after))
        shows = material(step.candidate, beyond, step.base)
        if not shows or other.misfit <= NEEDLESS * after.misfit:
            choice, after = less, other
    return choice, after


def pruned(choice: Choice, model: Model, setting: Setting) -> tuple[Choice, Model]:
    """Without the effects that a run which is followed does as well without."""
    for step in choice.steps:
        free = loose(model.plant, setting.drive)
        if (len(choice.steps) < 2 and not free) or model.misfit > NEAR:
            break
        stay = tuple(one for one in choice.steps if one is not step)
        base = without(model, stay, setting)
        if free:  # the search without the effect may have ended elsewhere
            base = replace(base, friction=more_load(model.plant).friction)
        found = refined(base, setting)
        if found.misfit > max(COMPLETE, NEEDLESS * model.misfit):
            continue
        end, outcomes = with_steps(stay, setting.start, setting.first)
        choice = Choice(setting.start, setting.first, stay, end, outcomes, choice.tried)
        model = Model(end, outcomes, found.plant, found.sd, False, found.misfit)
    return choice, model


def keeping(plant: Plant, stay: Sequence[Step]) -> Plant:
    """The plant with the effects of these steps only."""
    keys = {step.candidate.effect.key for step in stay}
    return replace(plant, effects=tuple(a for a in plant.effects if a.key in keys))


def without(model: Model, stay: Sequence[Step], setting: Setting) -> Plant:
    """The model's plant with the effects of these steps only; the plain one where none stays."""
    kept = keeping(model.plant, stay)
    return kept if stay else replace(kept, friction=setting.plain.plant.friction)


def with_steps(
    steps: Sequence[Step], start: Stage, first: Mapping[str, Outcome]
) -> tuple[Stage, Mapping[str, Outcome]]:
    """The stage with these effects in it, and what it leaves."""
    stage, outcomes = start, first
    for step in steps:
        stage, outcomes = settled(replace(absorb(stage, step.candidate), scales={}))
    return stage, outcomes


def slow_motion(effect: Effect) -> bool:
    """Whether the effect has a speed of its own."""
    return any(p.unit in ("m/s", "rad/s") for p in effect.params)


def refined(plant: Plant, setting: Setting) -> Refit:
    """The plant refined on the whole logs from close by."""
    logs, drive = setting.logs, setting.drive
    if loose(plant, drive):
        return closer(plant, logs, drive, setting.rng)
    return refit(plant, logs, drive, prior=even(plant), effort="near")
