"""Structures with fewer effects: what the run does as well without is taken out.

The equations see means over windows of sliding, in which one effect may stand for another.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from identification.estimation.recorded_logs import RecordedLogs
from identification.estimation.regression.effect_rows import EffectRows
from identification.estimation.regression.equation_rows import ACTUATOR, MECHANICAL, MotionLog
from identification.estimation.regression.row_fit import RowFit, mean_square
from identification.estimation.structure_fit import FittedStructure, fitted_structure
from identification.model.estimates import Drive
from identification.model.plant import Plant
from identification.progress import Halt
from identification.thresholds import ADEQUATE, ASTRAY, COMPLETE, EARNS, HOPELESS, OF_ACCOUNT
from identification.tracing.plain_model import PlainModel
from identification.tracing.regression.stepwise import Choice, Step, scaled_as, with_candidate


@dataclass(frozen=True, eq=False)
class Setting:
    """What every trial needs: the plain model and its logs, and these cut short.

    made: models by the keys of their effects.
    """

    plain: PlainModel
    rng: np.random.Generator
    short: Sequence[MotionLog] = ()
    made: dict[frozenset[str], FittedStructure] = field(default_factory=dict)

    @property
    def recorded(self) -> RecordedLogs:
        """The logs as the estimator takes them."""
        return self.plain.rows.recorded

    @property
    def logs(self) -> tuple[MotionLog, ...]:
        """The logs, whole."""
        return self.recorded.logs

    @property
    def drive(self) -> Drive:
        """What drives their runs."""
        return self.recorded.drive

    @property
    def halt(self) -> Halt:
        """Whether trials are to go on."""
        return self.recorded.halt


def enough(setting: Setting, steps: Sequence[Step]) -> float:
    """Misfit up to which a run is not contested: nothing is missing, or the effects that the
    equations call for are beyond doubt in it too."""
    if not steps:
        return ADEQUATE
    least = ADEQUATE if setting.drive == "command" else ASTRAY
    return max(least, 1.0 + OF_ACCOUNT * (setting.plain.model.misfit - 1.0))


def fitted(choice: Choice, setting: Setting) -> FittedStructure:
    """The model of a choice made on the equations; the plant of the same effects is made once."""
    keys = frozenset(step.candidate.effect.key for step in choice.steps)
    if keys not in setting.made:
        setting.made[keys] = _model(choice, setting)
    return replace(setting.made[keys], stage=choice.end, outcomes=choice.base)


def _model(choice: Choice, setting: Setting) -> FittedStructure:
    plain = setting.plain.model
    near = None if plain.prescribed else plain.plant.friction
    model = fitted_structure(
        choice.end, choice.base, choice.effects, setting.recorded, setting.rng, near=near
    )
    if setting.halt.reached() and not model.prescribed:
        keys = ", ".join(step.candidate.effect.key for step in choice.steps)
        setting.halt.left_out(f"the refinement of {keys} on the free run, to its end")
    return model


def suffices(choice: Choice, setting: Setting) -> bool:
    """Whether neither the equations nor the run call for another effect beside those chosen."""
    if not (choice.steps and equations_explained(choice.base)):
        return False
    model = fitted(choice, setting)
    return model.prescribed or model.misfit <= followed_up_to(choice, setting, False)


def fewest(choice: Choice, setting: Setting) -> tuple[Choice, FittedStructure]:
    """The fewest of the leading effects with which the run is followed, and the model.

    Where it is not with any, the fewest beside which no more leave clearly less. Halted, they are
    those tried so far.
    """
    best, least = (choice, setting.plain.model), np.inf
    for n in range(1, len(choice.steps) + 1):
        part, whole = only(choice, choice.steps[:n]), n == len(choice.steps)
        if not whole and not equations_explained(choice.steps[n].base):
            continue
        model = fitted(part, setting)
        if model.prescribed or model.misfit <= followed_up_to(part, setting, whole):
            return part, model
        if model.misfit < earned(least):
            best, least = (part, model), model.misfit
        if setting.halt.reached():
            for step in choice.steps[n:]:
                setting.halt.left_out(
                    f"{step.candidate.effect.key}, called for by the equations, on the free run"
                )
            break
    return best


def earned(before: float) -> float:
    """Misfit below which one effect more earns its place; before: what is left without it."""
    return 1.0 + EARNS * max(before - 1.0, 0.0)


def followed_up_to(choice: Choice, setting: Setting, whole: bool) -> float:
    """Misfit up to which a run is followed; whole: with all effects that the equations call for."""
    if whole:
        return min(enough(setting, choice.steps), HOPELESS)
    bristle = any(step.candidate.effect.place.elastic for step in choice.steps)
    return ADEQUATE if bristle else COMPLETE


def equations_explained(base: Mapping[str, RowFit]) -> bool:
    """Whether the equations leave hardly more than the sensors' noise."""
    return all(mean_square(base[e]) <= ASTRAY for e in (MECHANICAL, ACTUATOR) if e in base)


def only(choice: Choice, stay: tuple[Step, ...]) -> Choice:
    """The choice with these of its steps; those tried are remembered."""
    if len(stay) == len(choice.steps):
        return choice
    end, base = with_steps(stay, choice.start, choice.first)
    return replace(choice, steps=stay, end=end, base=base)


def without(model: FittedStructure, stay: Sequence[Step], setting: Setting) -> Plant:
    """The model's plant with the effects of these steps only; the plain one where none stays."""
    keys = {step.candidate.effect.key for step in stay}
    kept = replace(model.plant, effects=tuple(a for a in model.plant.effects if a.key in keys))
    return kept if stay else replace(kept, friction=setting.plain.model.plant.friction)


def with_steps(
    steps: Sequence[Step], start: EffectRows, first: Mapping[str, RowFit]
) -> tuple[EffectRows, Mapping[str, RowFit]]:
    """The stage with these effects in it, and what it leaves."""
    stage, outcomes = start, first
    for step in steps:
        stage, outcomes = with_candidate(scaled_as(step, stage), step.candidate)
    return stage, outcomes
