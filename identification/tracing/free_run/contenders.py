"""One effect more, or another, in the free run: searched, then refined on short and whole logs."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from identification.effects._base import Effect
from identification.errors import UserError
from identification.estimation.regression.effect_columns import by_load
from identification.estimation.windowed_run.closest import closer
from identification.estimation.windowed_run.nudged_search import (
    BREAKS_RANGE,
    CLOSE_RANGE,
    FAR_RANGE,
    FINER_RANGE,
    GROWTH_RANGE,
    MIDWAY_RANGE,
    SIDES_RANGE,
    SLIDING_RANGE,
    judge_nudged,
    less_load,
    nearer,
    nudged_search,
)
from identification.estimation.windowed_run.parameters import even, loose, on_bristle
from identification.estimation.windowed_run.refinement import Refit, briefly, onward, refit
from identification.estimation.windowed_run.run_errors import judge, loss, misfit
from identification.estimation.windowed_run.stick_search import start_band
from identification.estimation.windowed_run.windows import RUN_WINDOW
from identification.model.plant import Plant
from identification.thresholds import COMPLETE, NEARLY_FOLLOWED
from identification.tracing.free_run.backward_elimination import (
    Setting,
    known,
    refined_near,
)
from identification.tracing.free_run.trial_structures import Trial, seen_in_run
from identification.tracing.regression.stepwise import Step

MAY_BE_UNEVEN = 20.0  # misfit up to which unequal directions may be what is left
WORTH = 1.25  # times that, up to which an effect's other starts are tried
LARGER = 3  # starts of a play, from the best up


@dataclass(frozen=True, eq=False)
class RunContender:
    """A structure in the free run: its steps but the last, the last effect, plant and misfit."""

    steps: tuple[Step, ...]
    effect: Effect
    plant: Plant
    misfit: float


@dataclass(frozen=True, eq=False)
class Begun:
    """A trial after a first search: the plant before and after it, what that leaves (a run nudged
    along the log where nothing else holds it, and one let go), and other plants to begin from."""

    trial: Trial
    start: Plant
    plant: Plant
    loss: float
    misfit: float
    others: tuple[Plant, ...]


def begun_with(trial: Trial, setting: Setting) -> list[Begun]:
    """The effect at the best of its starts, after a first search; empty where it has none."""
    plants = []
    for values in trial.values:
        try:
            acting = trial.effect.acting(values)
            base = less_load(trial.base, acting) if by_load(trial.effect) else trial.base
            plants.append(replace(base, effects=(*base.effects, acting)))
        except UserError:
            continue
    if not plants:
        return []
    free = loose(plants[0], setting.drive)
    if free and not known(setting):
        errors_of = judge_nudged(plants[0], setting.short, setting.drive, 1.0)
    else:
        errors_of = judge(plants[0], setting.short, setting.drive, RUN_WINDOW)
    try:
        with ThreadPoolExecutor(2) as pool:
            costs = list(pool.map(lambda one: loss(errors_of(one)), plants))
        at = int(np.argmin(costs))
        first = _first(plants[at], trial.effect, setting)
        others: tuple[Plant, ...] = ()
        if free and (by_load(trial.effect) or trial.effect.place.in_stops):
            # What hardly shows by itself is small at its best start: another from the middle.
            others = (plants[len(plants) // 2],)
        elif trial.effect.place.shows and len(trial.effect.params) == 1:
            # The plain parameters are bent to do without it: a larger size may be the better start.
            others = tuple(plants[at + 1 : at + LARGER])
        left_by = misfit(first, setting.short, setting.drive)
        return [Begun(trial, plants[at], first, loss(errors_of(first)), left_by, others)]
    except UserError:  # two effects of a kind that a plant takes one of
        return []


def on_short_logs(one: Begun, setting: Setting, enough: float) -> RunContender | None:
    """The contender refined a little on the short logs, from its other starts too.

    enough: misfit from which it may be the best; far above it no other start is tried.
    """
    trial = one.trial
    free = loose(one.plant, setting.drive)
    try:
        found = near_start(one.start, one.plant, setting)
        for other in one.others:
            if found.misfit <= COMPLETE or (not free and found.misfit > WORTH * enough):
                break
            again = near_start(other, _first(other, trial.effect, setting), setting)
            found = min(found, again, key=lambda x: x.misfit)
    except UserError:
        return None
    return RunContender(trial.steps, trial.effect, found.plant, found.misfit)


def _first(plant: Plant, effect: Effect, setting: Setting) -> Plant:
    """The plant after a first search on the short logs."""
    if loose(plant, setting.drive):
        if not effect.place.in_stops and not on_bristle(plant):
            return briefly(plant, setting.short, setting.drive).plant
        # Growth shows in stops alone, of which brief windows see little.
        # Where the plain run is nearly followed, its band and limits are nearly right.
        around = MIDWAY_RANGE if setting.plain.misfit <= NEARLY_FOLLOWED else SLIDING_RANGE
        around = BREAKS_RANGE if effect.place.in_stops else around
        stage = (0.0, around) if known(setting) else (1.0, FAR_RANGE)
        return nudged_search(plant, setting.short, setting.drive, setting.rng, (stage,))
    if seen_in_run(effect) and not by_load(effect):  # the plain band and limits stood for it
        p = plant.friction
        return start_band(plant, setting.short, setting.drive, max(p.dv_p, -p.dv_n))
    return plant


def near_start(start: Plant, plant: Plant, setting: Setting) -> Refit:
    """The plant after a first search, or its start, refined a little on the short logs."""
    if loose(plant, setting.drive) and misfit(plant, setting.short, setting.drive) > COMPLETE:
        plant = nearer((plant, start), setting.short, setting.drive)
        plant = nudged_search(
            plant, setting.short, setting.drive, setting.rng, ((0.0, CLOSE_RANGE),)
        )
    return refit(plant, setting.short, setting.drive, prior=even(plant), effort="quick")


def on_whole_logs(one: RunContender, setting: Setting) -> Refit:
    """The contender refined on the whole logs; its asymmetries free where it falls short."""
    growth = one.effect.place.in_stops and loose(one.plant, setting.drive)
    found = _grown(one, setting) if growth else refined_near(one.plant, setting)
    if COMPLETE < found.misfit < MAY_BE_UNEVEN and even(found.plant):
        again = refit(found.plant, setting.logs, setting.drive, prior={}, effort="quick")
        found = again if again.misfit < found.misfit else found
        if found.misfit > COMPLETE and loose(found.plant, setting.drive):
            again = closer(found.plant, setting.logs, setting.drive, setting.rng, 2, SIDES_RANGE)
            found = again if again.misfit < found.misfit else found
    return found


def _grown(one: RunContender, setting: Setting) -> Refit:
    """A contender of growing stiction, searched and refined on the whole logs in turn.

    A breakaway is at one sample or the next, so a small change of its limit changes nothing, and
    where each start hangs on the rest before it, minima are many and narrow.
    """
    logs, drive = setting.logs, setting.drive
    begins = [one.plant]
    # All but the rare late breakaways
    if not one.steps and setting.plain.misfit <= NEARLY_FOLLOWED:
        begins.append(replace(one.plant, friction=setting.plain.plant.friction))
    best: Refit | None = None
    for around in (GROWTH_RANGE, GROWTH_RANGE, FINER_RANGE, FINER_RANGE):
        near = [nudged_search(x, logs, drive, setting.rng, ((0.0, around),)) for x in begins]
        found = onward(nearer((*begins, *near), logs, drive), logs, drive)
        best = found if best is None or found.misfit < best.misfit else best
        if not COMPLETE < best.misfit < MAY_BE_UNEVEN:
            break
        begins = [best.plant]
    assert best is not None
    return best
