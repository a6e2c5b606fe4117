"""Structures with fewer effects: what the run does as well without is taken out.

While the plain run is not followed its band is not known, and the passage through it looks like an
effect of slow motion; a second effect may have made the first one needless.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import takewhile

import numpy as np

from identification.arrays import Array
from identification.effects._library import Library
from identification.estimation.recorded_logs import RecordedLogs
from identification.estimation.regression.effect_columns import slow_motion
from identification.estimation.regression.effect_rows import EffectRows
from identification.estimation.regression.equation_rows import ACTUATOR, FIVE, MECHANICAL, MotionLog
from identification.estimation.regression.row_fit import RowFit, mean_square, settled_fits
from identification.estimation.structure_fit import FittedStructure, band, fitted_structure
from identification.estimation.windowed_run.closest import closer
from identification.estimation.windowed_run.nudged_search import more_load, nearer
from identification.estimation.windowed_run.parameters import even, loose, on_bristle
from identification.estimation.windowed_run.refinement import Refit, refit
from identification.estimation.windowed_run.run_errors import misfit
from identification.log import Rig
from identification.model.estimates import Drive
from identification.model.karnopp import Karnopp
from identification.model.plant import Plant
from identification.progress import Halt
from identification.thresholds import (
    ADEQUATE,
    ASTRAY,
    COMPLETE,
    DOES_NOTHING,
    EARNS,
    FOLLOWED,
    IDLE,
    MUCH,
    NEARLY_FOLLOWED,
    NEEDLESS,
    UNCONTESTED,
)
from identification.tracing.regression.candidates import EffectCandidate
from identification.tracing.regression.stepwise import Choice, Step, absorb, material

LEAST_MASS = 0.1  # of the mass before, that a regression may leave
VAIN = 0.9  # of the plain model's misfit, that effects leave which do not help
ONCE_MORE = 2  # searches of a run that is all but followed


@dataclass(frozen=True, eq=False)
class Setting:
    """What every trial needs: logs whole and cut short, how they are driven, and the library.

    doubted: steps of a choice of which those of slow motion have been tried without already; made:
    models by the keys of their effects.
    """

    logs: Sequence[MotionLog]
    short: Sequence[MotionLog]
    drive: Drive
    rig: Rig
    library: Library
    start: EffectRows
    first: Mapping[str, RowFit]
    plain: FittedStructure
    rng: np.random.Generator
    doubted: tuple[Step, ...] = ()
    made: dict[frozenset[str], FittedStructure] = field(default_factory=dict)

    @property
    def recorded(self) -> RecordedLogs:
        """The logs as the estimator takes them."""
        return RecordedLogs(tuple(self.logs), self.rig, self.drive, halt=self.halt)

    @property
    def halt(self) -> Halt:
        """Whether trials are to go on."""
        return self.logs[0].halt


def enough(setting: Setting, steps: Sequence[Step]) -> float:
    """Misfit up to which a run is not contested: nothing is missing, or the effects that the
    equations call for are beyond doubt in it too."""
    if not steps:
        return ADEQUATE
    least = ADEQUATE if setting.drive == "command" else ASTRAY
    return max(least, 1.0 + UNCONTESTED * (setting.plain.misfit - 1.0))


def seconds(setting: Setting) -> float:
    """Duration of all logs [s]; what a run leaves counts as one independent sample a second."""
    return sum(one.log.duration for one in setting.logs)


def known(setting: Setting) -> bool:
    """Whether the plain plant's sliding is right: its run, or at least the equations, show no less.

    Then an effect in stops and reversals is searched in the run itself, without nudging.
    """
    return setting.plain.misfit <= NEARLY_FOLLOWED or equations_explained(setting.first)


def fitted(choice: Choice, setting: Setting) -> FittedStructure:
    """The model of a choice made on the equations; the plant of the same effects is made once."""
    keys = frozenset(step.candidate.effect.key for step in choice.steps)
    if keys not in setting.made:
        setting.made[keys] = _model(choice, setting)
    return replace(setting.made[keys], stage=choice.end, outcomes=choice.base)


def _model(choice: Choice, setting: Setting) -> FittedStructure:
    near = None if setting.plain.imposed else setting.plain.plant.friction
    model = fitted_structure(
        choice.end, choice.base, choice.effects, setting.recorded, setting.rng, near=near,
    )  # fmt: skip
    if model.imposed:
        return model
    keys = ", ".join(step.candidate.effect.key for step in choice.steps)
    if setting.halt.reached():
        setting.halt.left_out(f"the refinement of {keys} on the free run, to its end")
        return model
    found = setting.halt.tried(
        f"a closer search with {keys}",
        lambda: insisted(model.plant, model.misfit, setting), None,
    )  # fmt: skip
    if found is None:
        return model
    return replace(model, plant=found.plant, sd=found.sd, misfit=found.misfit)


def vain(setting: Setting) -> float:
    """Misfit beyond which effects that the equations call for do not help the run.

    Where sliding lacks hardly anything without them, they may be a trifle.
    """
    return VAIN * setting.plain.misfit if equations_explained(setting.first) else np.inf


def first_alone(choice: Choice, setting: Setting) -> FittedStructure | None:
    """The model of a choice of one effect, where the equations call for no other."""
    free = loose(setting.plain.plant, setting.drive)
    choice = without_growth(choice) if free else choice
    return fitted(choice, setting) if choice.steps and equations_explained(choice.base) else None


def suffices(alone: FittedStructure | None, choice: Choice, setting: Setting) -> bool:
    """Whether the run is followed with the effects of a choice, so that no other is looked for."""
    return alone is not None and (
        alone.imposed or alone.misfit <= followed_up_to(choice, setting, False)
    )


def fewest(choice: Choice, setting: Setting, unsure: bool) -> tuple[Choice, FittedStructure]:
    """The fewest of the leading effects with which the run is followed, and the model.

    Where it is not with any, the fewest beside which no more leave clearly less; but where nothing
    brings the run back to the log and its band is unknown (unsure), the one without effects of slow
    and micro-motion, and none where they help nothing. Halted, they are those tried so far.
    """
    free = loose(setting.plain.plant, setting.drive)
    unsure = unsure and free
    choice = without_growth(choice) if free else choice
    if not choice.steps:
        return choice, setting.plain
    best: tuple[Choice, FittedStructure] | None = None
    for n in range(1, len(choice.steps) + 1):
        part, whole = first_steps(choice, n), n == len(choice.steps)
        if not whole and not equations_explained(choice.steps[n].base):
            continue
        model = fitted(part, setting)
        if model.imposed or model.misfit <= followed_up_to(part, setting, whole):
            return part, model
        if best is None or model.misfit < earned(best[1].misfit):
            best = part, model
        if setting.halt.reached():
            for step in choice.steps[n:]:
                setting.halt.left_out(
                    f"{step.candidate.effect.key}, called for by the equations, on the free run"
                )
            return best
    if free and best is not None and best[1].misfit > vain(setting):
        return only(choice, (), [step.candidate for step in choice.steps]), setting.plain
    if best is not None and (not unsure or best[1].misfit <= ASTRAY):
        return best
    less = without_slow(choice) if unsure else choice
    if best is not None and len(less.steps) == len(best[0].steps):
        return best
    return less, fitted(less, setting) if less.steps else setting.plain


def earned(before: float) -> float:
    """Misfit below which one effect more earns its place; before: what is left without it."""
    return 1.0 + EARNS * max(before - 1.0, 0.0)


def followed_up_to(choice: Choice, setting: Setting, whole: bool) -> float:
    """Misfit up to which a run is followed; whole: with all effects that the equations call for."""
    if whole:
        return min(enough(setting, choice.steps), NEARLY_FOLLOWED)
    bristle = any(step.candidate.effect.place.elastic for step in choice.steps)
    if bristle and loose(setting.plain.plant, setting.drive):  # minima are many and narrow
        return FOLLOWED
    return ADEQUATE if bristle or setting.drive == "force" else COMPLETE


def equations_explained(base: Mapping[str, RowFit]) -> bool:
    """Whether the equations leave hardly more than the sensors' noise."""
    return all(mean_square(base[e]) <= MUCH**2 for e in (MECHANICAL, ACTUATOR) if e in base)


def first_steps(choice: Choice, count: int) -> Choice:
    """The choice up to so many effects."""
    if count == len(choice.steps):
        return choice
    return only(choice, choice.steps[:count])


def only(choice: Choice, stay: tuple[Step, ...], gone: Sequence[EffectCandidate] = ()) -> Choice:
    """The choice with these of its steps; gone: to be tried again beside them."""
    end, base = with_steps(stay, choice.start, choice.first)
    return Choice(choice.start, choice.first, stay, end, base, (*choice.tried, *gone))


def without_slow(choice: Choice) -> Choice:
    """The choice up to the first effect of slow or micro-motion, which is left to the run to find.

    While the band is not known, the passage through it may have been taken for one, and what was
    chosen after it was chosen beside it.
    """
    return first_steps(choice, len(tuple(takewhile(lambda step: not _slow(step), choice.steps))))


def without_growth(choice: Choice) -> Choice:
    """The choice without stiction that grows, which is left to the run to find.

    Its breakaways are few and tell its size at one time of rest; the run tells both. Where sliding
    lacks nothing, an effect of slow motion that was chosen too is its shadow, or the run's to find.
    """
    kept = [step for step in choice.steps if not step.candidate.effect.place.in_stops]
    if len(kept) == len(choice.steps):
        return choice
    slides = equations_explained(choice.first)
    stay = tuple(step for step in kept if not (slides and _slow(step)))
    return only(choice, stay, [step.candidate for step in choice.steps if step not in stay])


def _slow(step: Step) -> bool:
    """Whether the effect of a step is one of slow or micro-motion."""
    effect = step.candidate.effect
    return slow_motion(effect) or effect.place.elastic


def doubted(
    choice: Choice, after: FittedStructure, setting: Setting
) -> tuple[Choice, FittedStructure]:
    """Without an effect of slow or micro-motion that the run does as well without, or that its band
    hides.

    While the band was not known, the passage through it may have been taken for such an effect, or
    short stops of a creeping body for a bristle.
    """
    for step in choice.steps:
        if not _slow(step):
            continue
        stay = tuple(one for one in choice.steps if one is not step)
        less = only(choice, stay)
        found = refined_near(keeping(after.plant, stay), setting)
        other = FittedStructure(less.end, less.base, found.plant, found.sd, False, found.misfit)
        if other.misfit > COMPLETE:
            again = fitted(less, setting) if stay else setting.plain
            other = again if again.misfit < other.misfit else other
        beyond = replace(step.stage, band=band(after))
        shows = material(step.candidate, beyond, step.base)
        if not shows or is_needless(other.misfit, after.misfit):
            choice, after = less, other
    return choice, after


def pruned(
    choice: Choice, model: FittedStructure, setting: Setting
) -> tuple[Choice, FittedStructure]:
    """Without the effects that a run which is followed does as well without."""
    for step in choice.steps:
        free = loose(model.plant, setting.drive)
        if model.misfit > NEARLY_FOLLOWED:
            break
        stay = tuple(one for one in choice.steps if one is not step)
        less = only(choice, stay)
        bare = keeping(model.plant, stay)
        as_it_is = misfit(bare, setting.logs, setting.drive)
        if len(choice.steps) < 2 and not free:
            return (less, setting.plain) if is_idle(as_it_is, model.misfit) else (choice, model)
        if _slow(step) and choice.steps == setting.doubted:
            continue
        if free and does_nothing(as_it_is, model.misfit):
            found = refit(bare, setting.logs, setting.drive, prior=even(bare), effort="near")
        elif (
            free
            and not _slow(step)
            and equations_explained(choice.base)
            and not equations_explained(less.base)
        ):
            continue  # sliding alone calls for it: a search would not find otherwise
        else:
            base = without(model, stay, setting)
            if free:  # the search without the effect may have ended elsewhere
                base = replace(base, friction=more_load(model.plant).friction)
                level = replace(base, friction=levelled(base.friction, less.end.theta))
                base = nearer((base, level), setting.logs, setting.drive)
            elif stay:
                base = replace(base, friction=levelled(base.friction, less.end.theta))
            found = refined_near(base, setting)
            found = insisted(found.plant, found.misfit, setting) or found
        if found.misfit > COMPLETE and not is_needless(found.misfit, model.misfit):
            continue
        choice = less
        model = FittedStructure(less.end, less.base, found.plant, found.sd, False, found.misfit)
    return choice, model


def is_needless(without: float, before: float) -> bool:
    """Whether a plant fitted anew without an effect leaves about as small a misfit as before."""
    return without <= NEEDLESS * before


def does_nothing(without: float, before: float) -> bool:
    """Whether a plant leaves the same misfit as before, an effect just taken out of it."""
    return without <= DOES_NOTHING * before


def is_idle(without: float, before: float) -> bool:
    """Whether a plant leaves the same misfit to the last digits that noise tells: what was taken
    out of it had no size."""
    return without <= IDLE * before


def keeping(plant: Plant, stay: Sequence[Step]) -> Plant:
    """The plant with the effects of these steps only."""
    keys = {step.candidate.effect.key for step in stay}
    return replace(plant, effects=tuple(a for a in plant.effects if a.key in keys))


def without(model: FittedStructure, stay: Sequence[Step], setting: Setting) -> Plant:
    """The model's plant with the effects of these steps only; the plain one where none stays."""
    kept = keeping(model.plant, stay)
    return kept if stay else replace(kept, friction=setting.plain.plant.friction)


def levelled(friction: Karnopp, theta: Array) -> Karnopp:
    """The friction with the sliding of a regression, (5,), and its stick limits as far above it.

    What an effect of friction took of the levels is theirs again where it is taken out.
    """
    least = [LEAST_MASS * friction.m, *np.full(4, 1e-9)]
    five = dict(zip(FIVE, np.maximum(theta, least).tolist(), strict=True))
    up, down = five["F_cp"] - friction.F_cp, five["F_cn"] - friction.F_cn
    return replace(
        friction, **five,
        F_sp=max(friction.F_sp + up, 1e-9), F_sn=min(friction.F_sn - down, -1e-9),
    )  # fmt: skip


def with_steps(
    steps: Sequence[Step], start: EffectRows, first: Mapping[str, RowFit]
) -> tuple[EffectRows, Mapping[str, RowFit]]:
    """The stage with these effects in it, and what it leaves."""
    stage, outcomes = start, first
    for step in steps:
        stage, outcomes = settled_fits(replace(absorb(stage, step.candidate), scales={}))
    return stage, outcomes


def insisted(plant: Plant, left: float, setting: Setting) -> Refit | None:
    """A plant whose run is all but followed, to a misfit `left`, searched close by once more.

    Its minima are many where nothing holds the run to the log's position. None where that finds
    nothing better.
    """
    best: Refit | None = None
    free = setting.drive == "command" and loose(plant, setting.drive)  # a measured force has noise
    if on_bristle(plant) or not free:
        return best
    for _ in range(ONCE_MORE):
        if not COMPLETE < left <= ADEQUATE:
            break
        found = closer(plant, setting.logs, setting.drive, setting.rng, 1)
        plant = found.plant  # what has left a minimum for a worse one may find a better one next
        if found.misfit < left:
            best, left = found, found.misfit
    return best


def refined_near(plant: Plant, setting: Setting) -> Refit:
    """The plant refined on the whole logs from close by."""
    logs, drive = setting.logs, setting.drive
    if loose(plant, drive):
        return closer(plant, logs, drive, setting.rng)
    return refit(plant, logs, drive, prior=even(plant), effort="near")
