"""Structures to try in the forward run, and the values from which each begins."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from identification.arrays import Array
from identification.effects._base import Effect, Param
from identification.estimation.regressed_plant import inside
from identification.estimation.regression.effect_columns import slow_motion
from identification.estimation.regression.equation_rows import REST, MotionLog
from identification.estimation.regression.row_fit import RowFit, mean_square
from identification.estimation.structure_fit import FittedStructure
from identification.estimation.windowed_run.parameters import is_unanchored
from identification.model.plant import Plant
from identification.tracing.free_run.backward_elimination import Setting, without
from identification.tracing.regression.candidates import EffectCandidate
from identification.tracing.regression.library_search import ABSORBED
from identification.tracing.regression.shape_grid import median_rest, shape_grid
from identification.tracing.regression.stepwise import Choice, Step

RIGID_CONTACT = 2.0  # square of what is seen of it at rest, in noise units, of a rigid contact
RIVALS_TRIED = 3  # rivals of an effect taken that are tried in its place
MOST_TRIED = 40  # starts of one effect
FORCE_LEVELS = (0.05, 0.2, 0.6)  # of the Coulomb level, sizes of a force tried
REST_SHARES = (0.3, 1.0, 3.0)  # of the median rest


@dataclass(frozen=True, eq=False)
class Trial:
    """An effect to try beside the effects of `steps`, with values to begin from."""

    steps: tuple[Step, ...]
    base: Plant
    effect: Effect
    values: list[dict[str, float]]


def structures(choice: Choice, model: FittedStructure, setting: Setting) -> Iterator[Trial]:
    """One effect more, and another in the place of each."""
    yield from _beside(choice.steps, model.plant, choice.tried, setting, False)
    for i, step in enumerate(choice.steps):
        stay = (*choice.steps[:i], *choice.steps[i + 1 :])
        yield from _beside(stay, without(model, stay, setting), step.rivals, setting, True)


def _beside(
    steps: tuple[Step, ...],
    base: Plant,
    tried: Sequence[EffectCandidate],
    setting: Setting,
    instead: bool,
) -> Iterator[Trial]:
    """Effects not in `steps` that the run may show better than the equations do, with values to
    begin from; instead: of an effect taken, so the best of its rivals too."""
    keys = {step.candidate.effect.key for step in steps}
    regressed = {one.effect.key: one for one in tried}
    ranked = sorted(tried, key=lambda one: -one.gain)
    shown = {one.effect.key for one in ranked[: RIVALS_TRIED if instead else 0]}
    free = is_unanchored(base, setting.drive)
    for key, effect in setting.plain.library.items():
        if key in keys or key in ABSORBED:
            continue
        if setting.drive == "force" and effect.place.in_actuator:
            continue
        if effect.place.elastic and rigid(setting.plain.first):
            continue
        # Where every trial is a search, what the equations chose is not contested by all.
        if key in shown or (seen_in_run(effect) and not (instead and free)):
            values = [inside(effect, regressed[key].values)] if key in regressed else []
            values += grid(effect, base, setting.short)
            if values:
                yield Trial(steps, base, effect, values)


def rigid(first: Mapping[str, RowFit]) -> bool:
    """Whether the body is seen at rest and does not move there: on bristles it would."""
    return REST in first and mean_square(first[REST]) < RIGID_CONTACT


def seen_in_run(effect: Effect) -> bool:
    """Whether a free run may show the effect where the equations do not.

    One with a speed of its own shows in slow motion, most of which the equations leave out: a
    wider band stands for it there.
    """
    place = effect.place  # on signals, in place of sticking, at breakaway: in the run above all
    in_run = place.on_signals or place.at_rest
    return in_run or effect.load_dependent or slow_motion(effect)


def grid(effect: Effect, base: Plant, logs: Sequence[MotionLog]) -> list[dict[str, float]]:
    """Values from which an effect that the equations hardly show is tried."""
    if not seen_in_run(effect):
        return []
    if effect.signals and not all(any(k in one.log for k in effect.signals) for one in logs):
        return []
    each = [_starts_of(effect, p, base, logs) for p in effect.params]
    names = effect.names
    every = [dict(zip(names, map(float, x), strict=True)) for x in product(*each)]
    return [inside(effect, x) for x in every[:MOST_TRIED]]


def _starts_of(effect: Effect, p: Param, base: Plant, logs: Sequence[MotionLog]) -> Array:
    """Values of one parameter to begin from."""
    if p.unit in ("N", "N m"):
        return 0.5 * (base.friction.F_cp + base.friction.F_cn) * np.array(FORCE_LEVELS)
    if effect.place.in_stops and p.unit == "s":
        return median_rest(logs, p.typical) * np.array(REST_SHARES)
    return shape_grid(effect, p, logs)
