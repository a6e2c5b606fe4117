"""One effect more, or another, in the free run: searched, then refined on short and whole logs."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from identification.effects._base import MAX_SIGNALS, Acting, Effect
from identification.errors import UserError
from identification.estimation.regression.effect_columns import LEAST_LEFT_BY_LOAD
from identification.estimation.windowed_run.parameters import even, is_unanchored, on_bristle
from identification.estimation.windowed_run.refinement import Refit, descended, refit
from identification.estimation.windowed_run.run_errors import judge, loss
from identification.estimation.windowed_run.stick_search import start_band, stick_search
from identification.estimation.windowed_run.windows import RUN_WINDOW
from identification.model.karnopp import Karnopp
from identification.model.plant import Plant
from identification.thresholds import COMPLETE
from identification.tracing.free_run.backward_elimination import Setting
from identification.tracing.free_run.trial_structures import Trial, seen_in_run
from identification.tracing.regression.stepwise import Step

LARGER = 3  # starts of a play, from the best up
SCALED = [0, 1, 2, 3, 4, 7, 8]  # of the nine, those that a share of the force scales
LIMIT_BEGUN = 1.2  # times the Coulomb level, at which a search for a bristle's limits begins
SEED_OF_STOPS = 0  # of that search, whose outcome a refinement follows


@dataclass(frozen=True, eq=False)
class RunContender:
    """A structure in the free run: its steps but the last, the last effect, plant and misfit."""

    steps: tuple[Step, ...]
    effect: Effect
    plant: Plant
    misfit: float


@dataclass(frozen=True, eq=False)
class Entrant:
    """A structure to contend, from the best of its starts and larger ones; begun: refined from the
    best in a few steps."""

    plants: tuple[Plant, ...]
    begun: RunContender


def entrant(trial: Trial, setting: Setting) -> Entrant | None:
    """The effect from the best of its starts on the short logs; None where no plant can have it
    there."""
    plants = []
    if trial.effect.place.elastic and is_unanchored(trial.base, setting.drive):
        trial = replace(trial, base=_that_sticks(trial.base))
    for values in trial.values:
        try:
            acting = trial.effect.acting(values)
            base = less_load(trial.base, acting) if trial.effect.load_dependent else trial.base
            plants.append(replace(base, effects=(*base.effects, acting)))
        except UserError:
            continue
    if not plants:
        return None
    try:
        errors_of = judge(plants[0], setting.short, setting.drive, RUN_WINDOW)
        with ThreadPoolExecutor(2) as pool:
            costs = list(pool.map(lambda one: loss(errors_of(one)), plants))
        at = int(np.argmin(costs))
        best = plants[at]
        done = refit(best, setting.short, setting.drive, prior=even(best), effort="quick")
    except UserError:  # two effects of a kind that a plant takes one of
        return None
    larger = trial.effect.place.shows and len(trial.effect.params) == 1
    begun = RunContender(trial.steps, trial.effect, done.plant, done.misfit)
    return Entrant(tuple(plants[at : at + (LARGER if larger else 1)]), begun)


def contender(one: Entrant, setting: Setting) -> RunContender:
    """The structure searched and refined a little on the short logs, from its starts until it
    follows: the plain parameters are bent to do without it, so that a larger size may be better."""
    effect = one.begun.effect
    found = _near(one.plants[0], effect, setting)
    for other in one.plants[1:]:
        if found.misfit <= COMPLETE:
            break
        again = _near(other, effect, setting)
        found = min(found, again, key=lambda each: each.misfit)
    if found.misfit > one.begun.misfit:  # the search has led astray
        return one.begun
    return replace(one.begun, plant=found.plant, misfit=found.misfit)


def load_share(friction: Karnopp, acting: Acting) -> float:
    """Share of the applied force that load-dependent friction leaves to the motion."""
    none = np.zeros(MAX_SIGNALS)
    level = friction.F_cp
    taken = acting.effect.value(0.0, 0.0, 1.0, 1.0, 0.0, 1.0, 0.0, level, level, none, acting.array)
    return max(1.0 - taken, LEAST_LEFT_BY_LOAD)


def less_load(base: Plant, acting: Acting) -> Plant:
    """The plant with what load-dependent friction takes of the force taken off its own
    parameters."""
    nine = base.friction.array.copy()
    nine[SCALED] *= load_share(base.friction, acting)
    return replace(base, friction=Karnopp.from_array(nine))


def _near(plant: Plant, effect: Effect, setting: Setting) -> Refit:
    """The plant after a first search refined a little on the short logs."""
    first = _first(plant, effect, setting)
    return refit(first, setting.short, setting.drive, prior=even(first), effort="quick")


def _first(plant: Plant, effect: Effect, setting: Setting) -> Plant:
    """The plant after a first search on the short logs."""
    if is_unanchored(plant, setting.drive):
        if on_bristle(plant):
            return _stops_searched(plant, setting)
        return descended(plant, setting.short, setting.drive).plant
    if seen_in_run(effect) and not effect.load_dependent:  # the plain band and limits stood for it
        p = plant.friction
        return start_band(plant, setting.short, setting.drive, max(p.dv_p, -p.dv_n))
    return plant


def _that_sticks(plant: Plant) -> Plant:
    """The plant with stick limits above sliding friction, which a bristle takes no less of: those
    of a rigid body that crept, or whose limit a run had lost, lie below."""
    p = plant.friction
    F_sp, F_sn = max(p.F_sp, LIMIT_BEGUN * p.F_cp), min(p.F_sn, -LIMIT_BEGUN * p.F_cn)
    return replace(plant, friction=replace(p, F_sp=F_sp, F_sn=F_sn))


def _stops_searched(plant: Plant, setting: Setting) -> Plant:
    """A plant on a bristle with its bands and limits searched on the short logs."""
    rng = np.random.default_rng(SEED_OF_STOPS)
    return stick_search(_that_sticks(plant), setting.short, setting.drive, rng)


def on_whole_logs(one: RunContender, setting: Setting) -> Refit:
    """The contender refined on the whole logs."""
    logs, drive = setting.logs, setting.drive
    found = refit(one.plant, logs, drive, prior=even(one.plant), effort="near")
    if found.misfit > COMPLETE and on_bristle(found.plant) and is_unanchored(found.plant, drive):
        # Of the right stiffness it follows most, and may have lost a limit on its way there.
        searched = _stops_searched(found.plant, setting)
        again = refit(searched, logs, drive, prior=even(searched), effort="near")
        found = again if again.misfit < found.misfit else found
    return found
