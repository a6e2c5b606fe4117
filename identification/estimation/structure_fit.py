"""A structure with its numbers: from the regression's sizes to a plant refined on its free run."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from identification.effects._base import Effect
from identification.errors import UserError
from identification.estimation.recorded_logs import RecordedLogs, is_prescribed
from identification.estimation.regressed_plant import (
    RegressedPlant,
    first_plant,
    inertia_is_lost,
    regressed_plant,
)
from identification.estimation.regression.effect_columns import Values
from identification.estimation.regression.effect_rows import EffectRows
from identification.estimation.regression.equation_rows import ACTUATOR, MECHANICAL, MotionLog
from identification.estimation.regression.intersample_command import is_faster_loop
from identification.estimation.regression.row_fit import RowFit, first_stage, mean_square, rough
from identification.estimation.windowed_run.parameters import even, is_unanchored, on_bristle
from identification.estimation.windowed_run.plant_search import searched_plant
from identification.estimation.windowed_run.refinement import (
    Effort,
    HaltedRefit,
    Refit,
    descended,
    refit,
)
from identification.estimation.windowed_run.run_errors import misfit
from identification.estimation.windowed_run.stick_search import (
    nearest_limits,
    stick_search,
    widest_band,
    without_band,
)
from identification.model.estimates import Drive, KarnoppFit
from identification.model.karnopp import Karnopp
from identification.model.plant import Plant
from identification.progress import Halted
from identification.thresholds import ADEQUATE, ASTRAY, COMPLETE, HOPELESS, WORSE

ABOVE_BAND = 1.3  # times the band, above which sliding friction is compared


@dataclass(frozen=True, eq=False)
class FittedStructure:
    """A structure with its numbers: outcomes by equation, the plant, standard deviations by name.

    prescribed: the motion is prescribed, so the plant has no free run to be refined on; misfit: of
    the free run, 1 where it leaves the sensors' noise; fit: what it converged to, where it has
    been.
    """

    stage: EffectRows
    outcomes: Mapping[str, RowFit]
    plant: Plant
    sd: Mapping[str, float]
    prescribed: bool
    misfit: float = np.inf
    fit: KarnoppFit | None = None

    def refined(self, done: Refit) -> "FittedStructure":
        """The same with the plant that a refinement has come to."""
        return replace(self, plant=done.plant, sd=done.sd, misfit=done.misfit, prescribed=False)


def fitted_structure(
    stage: EffectRows, outcomes: Mapping[str, RowFit], effects: Sequence[tuple[Effect, Values]],
    recorded: RecordedLogs, rng: np.random.Generator, *, near: Karnopp | None = None,
) -> FittedStructure:  # fmt: skip
    """The plant of a structure: the regression's numbers, refined on the free run.

    rng: of the search where nothing holds the run to the log's position; near: band and stick
    limits to begin from too, where those of the regression lead nowhere. Halted, it gives the best
    so far, with the deviations that the regression gives. Sources: of the equations, Messenger,
    Bortz (2021); of the run, Bock (1983), Levenberg (1944), Marquardt (1963).
    """
    logs, drive = recorded.logs, recorded.drive
    regressed = regressed_plant(stage, outcomes, effects, recorded)
    plant, prior = regressed.plant, dict(regressed.prior)
    lost = drive == "force" and inertia_is_lost(outcomes[MECHANICAL])
    spreads = {**prior, **regressed.unidentified}
    model = FittedStructure(stage, outcomes, plant, spreads, lost)
    if lost:
        return model
    # Where sliding itself is not explained, no other band of a plant with effects will do. A state
    # follows the velocity as the log shows it, so even of the right effect more than noise is left.
    remembers = any(effect.evolve and effect.place.rubs for effect, _ in effects)
    left = [mean_square(outcomes[e]) for e in (MECHANICAL, ACTUATOR) if e in outcomes]
    missing = max(left) > ASTRAY and not remembers
    hopeless = missing and (bool(effects) or rough(outcomes))
    done: Refit | None = None
    try:
        free, followed = is_unanchored(plant, drive), ADEQUATE if effects else COMPLETE
        if free and not (missing or on_bristle(plant)):
            stopped = stick_search(plant, logs, drive, rng)
            done = refit(stopped, logs, drive, prior=prior, effort="near")
            # A noisy force's run that seems to follow may have a band in place of its limits.
            if done.misfit > followed or any(one.has_random_walk(drive) for one in logs):
                stopped = stick_search(without_band(plant, logs), logs, drive, rng)
                other = refit(stopped, logs, drive, prior=prior, effort="near")
                done = _better(done, other, recorded)
            gains = done.misfit <= HOPELESS
            while gains and done.misfit > followed:
                nearer = nearest_limits(done.plant, logs, drive)
                again = refit(nearer, logs, drive, prior=prior, effort="near")
                gains = WORSE * again.misfit < done.misfit
                done = again if gains else done
            if done.misfit <= followed:
                return model.refined(done)
        done = _refined(regressed, logs, drive, near, "rough" if hopeless else "whole", done)
        smooth = not on_bristle(plant) and (free or bool(even(done.plant)))
        if smooth and not hopeless:
            done = _from_far_off(done, [] if effects else [plant], recorded)
        return model.refined(replace(done, prior=prior))
    except Halted as halted:
        best, least = _best_so_far(plant, done, halted, recorded)
        return replace(model, plant=best, misfit=least)


def _better(one: Refit, other: Refit, recorded: RecordedLogs) -> Refit:
    """The refinement that leaves less at the weights of the first, or the one that drifts more with
    the noise of its force would be the better."""
    logs, drive = recorded.logs, recorded.drive
    left = misfit(other.plant, logs, drive, weighed_by=one.plant)
    return other if left < one.misfit else one


def _from_far_off(done: Refit, others: Sequence[Plant], recorded: RecordedLogs) -> Refit:
    """A refinement, where it leaves more than noise the best that windows that grow lead to from
    it, then from the others."""
    for plant in (done.plant, *others):
        if done.misfit <= COMPLETE:
            break
        again = descended(plant, recorded.logs, recorded.drive)
        done = again if again.misfit < done.misfit else done
    return done


def _best_so_far(
    plant: Plant, done: Refit | None, halted: Halted, recorded: RecordedLogs
) -> tuple[Plant, float]:
    """The best of a plant, of its refinement, if any, and of what a halted one has come to; and
    what it leaves."""
    begun = [halted.plant] if isinstance(halted, HaltedRefit) else []
    if done is None:
        begun = begun or [plant]
    found = [] if done is None else [(done.plant, done.misfit)]
    with recorded.halt.closing():
        found += [(one, misfit(one, recorded.logs, recorded.drive)) for one in begun]
    return min(found, key=lambda one: one[1])


def _refined(
    regressed: RegressedPlant, logs: Sequence[MotionLog], drive: Drive, near: Karnopp | None,
    effort: Effort, before: Refit | None,
) -> Refit:  # fmt: skip
    """The regression's plant refined on the free run, from another band too where that leaves more
    than noise; or one of before, if that is better."""
    plant, prior = regressed.plant, dict(regressed.prior)
    done = refit(plant, logs, drive, band=max(regressed.slow, 1e-4), prior=prior, effort=effort)
    done = done if before is None or done.misfit <= before.misfit else before
    if near is None or is_unanchored(plant, drive) or done.misfit <= COMPLETE:
        return done
    same = {name: getattr(near, name) for name in ("dv_p", "dv_n", "F_sp", "F_sn")}
    beside = replace(plant, friction=replace(plant.friction, **same))
    with suppress(Halted):  # which the next ask halts
        widest = max(near.dv_p, -near.dv_n)
        other = refit(beside, logs, drive, band=widest, prior=prior, effort=effort)
        done = other if other.misfit < done.misfit else done
    return done


def band(model: FittedStructure) -> float:
    """Speed [m/s] above which the free run shows sliding friction; 0 without a free run."""
    p = model.plant.friction
    # A run that is not followed may have any band; most of the sliding is compared all the same.
    widest = widest_band(model.stage.logs)
    return 0.0 if model.prescribed else min(ABOVE_BAND * max(p.dv_p, -p.dv_n), widest)


def plain_structure(recorded: RecordedLogs, rng: np.random.Generator) -> FittedStructure:
    """The plant without effects: by the equations, refined on its free run.

    Where these have too few rows of sliding, the run alone is fitted, from a first estimate. A
    search follows where the equations of an actuator's plant are right but its run is not. Ours, of
    the paper's plant.
    """
    regressed, search = rng.spawn(2)
    stage, first = first_stage(recorded.logs, recorded.by_command)
    if MECHANICAL not in first:
        return _from_first_estimate(stage, first, recorded)
    model = fitted_structure(stage, first, (), recorded, regressed)
    # It takes long where nothing brings a run back, and hardly has a chance where much is left.
    hard = is_unanchored(model.plant, recorded.drive) or rough(model.outcomes)
    if model.prescribed or model.misfit <= COMPLETE or hard:
        return model
    return searched(model, recorded, search)


def by_exact_force(
    recorded: RecordedLogs, found: FittedStructure, rng: np.random.Generator
) -> tuple[RecordedLogs, FittedStructure]:
    """The logs of a motor with a force without noise, and the plant as these have it, where it
    leaves no more than the position's noise: what a controller makes of a noise that no signal
    shows is no error of the force. Ours."""
    noisy = recorded.by_motor and any(one.noise.F > 0.0 for one in recorded.logs)
    changes = is_faster_loop(recorded.share)
    if not noisy or found.prescribed or found.misfit > COMPLETE or changes:
        return recorded, found
    exact = recorded.with_exact_force()
    again = plain_structure(exact, rng)
    return (exact, again) if again.misfit <= COMPLETE else (recorded, found)


def _from_first_estimate(
    stage: EffectRows, first: Mapping[str, RowFit], recorded: RecordedLogs
) -> FittedStructure:
    plant = first_plant(recorded)
    model = FittedStructure(stage, first, plant, {}, is_prescribed(recorded))
    if model.prescribed:
        return model
    try:
        band = max(plant.friction.dv_p, -plant.friction.dv_n)
        done = refit(plant, recorded.logs, recorded.drive, prior={}, band=band)
        return model.refined(_from_far_off(done, [], recorded))
    except Halted as halted:
        best, least = _best_so_far(plant, None, halted, recorded)
        return replace(model, plant=best, misfit=least)


def searched(
    model: FittedStructure, recorded: RecordedLogs, rng: np.random.Generator
) -> FittedStructure:
    """The plain model from a global search, where that follows the logs better.

    Halted, it is the best so far.
    """
    logs, drive = recorded.logs, recorded.drive
    with suppress(UserError, Halted):
        plant = searched_plant(first_plant(recorded), logs, drive, rng)
        found = refit(plant, logs, drive, prior={}, effort="near")
        model = model.refined(found) if found.misfit < model.misfit else model
    return model
