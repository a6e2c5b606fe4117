"""What answers for a machine: its run over whole logs, in windows, or the equation of motion.

One place decides. A rig that prescribes the motion, or a run by a measured force that is not the
body's own, leaves the equation. Else the fit converges on the run, whole where it is followed so
(`converged_fit`); and where it leaves clearly more of the equation than the equation's own least
squares do on held-out stretches, or identifies less of mass and sliding friction without following
the log, the equation answers after all. Where the force or command is noisy, or a motor's run
loses its stops, mass and sliding friction are those of largest likelihood, if the run's are
significantly less likely (`prediction_error`).
"""

from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag

from identification.effects._base import AT_REST
from identification.errors import NotIdentifiable
from identification.estimation.converged_fit import (
    between_samples_sd,
    converged_fit,
    is_adequate,
    structure_estimates,
)
from identification.estimation.estimates import effect_estimates
from identification.estimation.prediction_error import prediction_error_fit
from identification.estimation.prescribed_motion import (
    FEWEST_COMPARED,
    fit_by_steady_speeds,
    fit_prescribed,
    is_unexplained,
    withheld,
    without_estimates,
)
from identification.estimation.recorded_logs import RecordedLogs
from identification.estimation.regression.equation_rows import ACTUATOR, FIVE, MECHANICAL
from identification.estimation.regression.motion_rows import rows_and_windows
from identification.estimation.regression.row_fit import first_stage, rms
from identification.estimation.regression.weighted_rows import left_unseen, stacked
from identification.estimation.shown_in_sliding import as_sliding_shows
from identification.estimation.structure_fit import FittedStructure
from identification.estimation.windowed_run.parameters import values_of
from identification.model.estimates import KarnoppFit
from identification.model.karnopp import Karnopp
from identification.model.plant import Motor, Plant
from identification.progress import Halted, Progress
from identification.remarks import MinorRemark
from identification.thresholds import HOPELESS, MATERIAL, OF_ACCOUNT, WORSE

LOST_WHY = "no free run follows these logs (inertia does not show beside what is left)"
STEPS_WHY = (
    "nothing is identifiable from the equation of motion of steps of force; log a force that"
    " changes in a run"
)
FLOOR_WHY = (
    "the free run does not follow the logs, which biases mass and friction; stick limits and band"
    " are not identifiable"
)
PREDICTS_WHY = (
    "neither the run nor the equation of motion follows these logs to the noise; add more sliding,"
    " at several speeds"
)
LIKELIEST = "sliding friction of largest likelihood"
LIKELIEST_WHY = MinorRemark(
    "mass and sliding friction are those that make the position measured while sliding likeliest,"
    " since the force or command is noisy; stick limits and bands those of the run"
)
LOST_STOPS_WHY = MinorRemark(
    "mass and sliding friction are those that make the position measured while sliding likeliest,"
    " since the run loses stops; stick limits and bands those of the run"
)
LESS_ERROR_WHY = (
    "the equation of motion gives mass and friction with less error than the free run, because of"
    " a noisy clock or command; stick limits and band are not identifiable"
)


@dataclass(frozen=True)
class LeftOfEquation:
    """Force [N], root mean squares, that is left of the equation of motion while sliding: by a
    plant, by its own least squares on held-out stretches, and with nothing taken out."""

    by_plant: float
    by_equation: float
    force: float

    @property
    def surer(self) -> bool:
        """Whether a plant leaves clearly more than the equation does by itself."""
        return self.by_plant > WORSE * self.by_equation

    @property
    def share(self) -> float:
        """Of the force, the less of what both leave."""
        return min(self.by_plant, self.by_equation) / self.force

    def is_material(self, coulomb: float) -> bool:
        """Whether what a plant leaves beyond the equation is of account beside friction [N]."""
        return self.by_plant**2 - self.by_equation**2 > (MATERIAL * coulomb) ** 2


def answered(
    found: FittedStructure, recorded: RecordedLogs, report: Progress, *, quick: bool = False
) -> KarnoppFit:
    """The fit of whatever answers for the logs, from a plain structure that has been searched.

    quick: not over whole runs, and not in windows where the equation is surer. Source: as
    `on_the_floor`, Stone (1974).
    """
    lost = found.prescribed or is_no_run(found.misfit)
    why = LOST_WHY if found.prescribed else "no free run follows these logs"
    if lost and recorded.steps:
        steady = fit_by_steady_speeds(recorded, why)
        if steady is None:
            raise NotIdentifiable(f"{recorded.name}: {why}, and {STEPS_WHY}")
        return steady
    if lost and recorded.drive == "force":
        return as_sliding_shows(fit_prescribed(recorded, why), recorded)
    if quick and not is_adequate(found.misfit):
        fit = by_equation_if_surer(found.plant.friction, recorded)
        if fit is not None:
            return as_sliding_shows(fit, recorded)
    try:
        fit = converged_fit(found.plant, recorded, found.misfit, report, quick=quick)
    except Halted:
        with recorded.halt.closing():
            fit = converged_fit(found.plant, recorded, found.misfit, report, quick=True)
    return on_the_floor(fit, recorded)


def on_the_floor(fit: KarnoppFit, recorded: RecordedLogs) -> KarnoppFit:
    """The fit by `likeliest`, or that of the equation of motion alone, where its run leaves clearly
    more of that equation than least squares do on held-out stretches: it is not followed, or only
    down to a noise that the equation averages out; or where the fit identifies less; either as
    sliding shows it. Source: cross-validation, Stone, J. R. Stat. Soc. B 36 (1974) 111; the
    comparison is ours."""
    reported = as_sliding_shows(likeliest(fit, recorded), recorded)
    if fit.effects:
        return reported
    # A run that is followed has been so with its own numbers; one that is not answers by none.
    left = left_by((fit if fit.adequate else reported).friction, recorded)
    surer = left is not None and left.surer
    if left is not None and fit.adequate:
        surer = surer and left.is_material(max(fit.friction.F_cp, fit.friction.F_cn))
    # Windows may identify next to nothing: where they do not follow, or a measured force drifts.
    if surer or _identified(reported) < len(FIVE):
        other = _by_equation(recorded, LESS_ERROR_WHY if fit.adequate else FLOOR_WHY)
        other = None if other is None else as_sliding_shows(other, recorded)
        if left is None and other is not None and not _explains(other):
            # Of few rows, or beside a band that takes the sliding, it leaves far more than noise.
            lost = not fit.adequate and is_no_run(fit.chi_square)
            if lost or not (fit.adequate or _identified(reported)):
                return withheld(other, PREDICTS_WHY)
            other = None
        if other is not None and (surer or _identified(other) > _identified(reported)):
            # A run that is followed to the noise lacks nothing, whichever gives its parameters.
            other = replace(other, adequate=fit.adequate)
            return other if left is None else _unless_unexplained(other, left)
    return reported if left is None else _unless_unexplained(reported, left)


def shown_sliding(plant: Plant) -> list[str]:
    """Names of the parameters that a plant shows while it slides: none of a stick limit, nor of an
    effect that acts at rest, which stops and reversals show, nor of an actuator's, whose force is
    measured."""
    motor = isinstance(plant.actuator, Motor)
    of_effects = [
        f"{acting.key}.{p.name}"
        for acting in plant.effects
        for p in acting.effect.params
        if not acting.effect.place.at_rest
        and p.name not in AT_REST
        and (motor or not acting.effect.place.in_actuator)
    ]
    return [*FIVE, *of_effects]


def likeliest(fit: KarnoppFit, recorded: RecordedLogs) -> KarnoppFit:
    """A fit with mass, sliding friction and effects of largest likelihood, where its own are
    significantly less likely: a run that a noisy force or command drives begins and ends its stops
    by that noise, and one that follows the sliding alone loses them; either is bent by what it
    loses. Stick limits and bands stay the run's.

    Source: prediction-error method, Ljung, System Identification (1999), 7.2.
    """
    noisy = any(one.has_random_walk(recorded.drive) for one in recorded.logs)
    loses_stops = not fit.adequate and recorded.drive == "command"
    if not (loses_stops or (noisy and fit.adequate)):
        return fit
    rows = first_stage(recorded.logs, recorded.by_command, (MECHANICAL, ACTUATOR))[1]
    if MECHANICAL not in rows:  # too little slides
        return fit
    plant = Plant(fit.friction, fit.actuator, fit.effects)
    names = [name for name in shown_sliding(plant) if name in fit.free]
    slowest = rows[MECHANICAL].slowest
    found = recorded.halt.tried(
        LIKELIEST, lambda: prediction_error_fit(plant, names, recorded.logs, slowest), None
    )
    if found is None or not found.is_likelier or _bends(found.plant, fit, recorded):
        return fit
    more = between_samples_sd(found.names, values_of(found.plant, found.names), recorded, of=1.0)
    covariance = found.covariance + np.diag(more**2)
    stops = [name for name in fit.free if name not in found.names]
    at = [fit.free.index(name) for name in stops]
    own = np.sqrt(np.diag(fit.covariance))
    sd = {name: float(own[i]) for name, i in zip(stops, at, strict=True)}
    sd |= dict(zip(found.names, np.sqrt(np.diag(covariance)).tolist(), strict=True))
    reported = structure_estimates(found.plant, sd, recorded)
    reported |= effect_estimates(found.plant.effects, sd)
    return replace(
        fit,
        friction=found.plant.friction,
        effects=found.plant.effects,
        estimates={**fit.estimates, **{name: reported[name] for name in found.names}},
        free=(*found.names, *stops),
        covariance=block_diag(covariance, fit.covariance[np.ix_(at, at)]),
        remarks=(*fit.remarks, LIKELIEST_WHY if fit.adequate else LOST_STOPS_WHY),
    )


def _bends(plant: Plant, fit: KarnoppFit, recorded: RecordedLogs) -> bool:
    """Whether the numbers of a plant without effects leave clearly more of the equation of motion
    than a fit's: then the force has not the noise by which they are likelier, as one that swings
    with the body where it seems to be noise."""
    if plant.effects:
        return False
    now, was = (left_by(p, recorded) for p in (plant.friction, fit.friction))
    return now is not None and was is not None and now.by_plant > WORSE * was.by_plant


def by_equation_if_surer(p: Karnopp, recorded: RecordedLogs) -> KarnoppFit | None:
    """The fit by the equation of motion, where a plant leaves clearly more of it; else None."""
    left = left_by(p, recorded)
    fit = _by_equation(recorded, FLOOR_WHY) if left is not None and left.surer else None
    return None if fit is None or left is None else _unless_unexplained(fit, left)


def left_by(p: Karnopp, recorded: RecordedLogs) -> LeftOfEquation | None:
    """What a plant of this friction, and the equation itself, leave of the force while sliding.

    None where too little slides. Of rows faster than the plant's band, in which it says something
    else of friction; where hardly any are, of all of a body driven by the measured force, whose run
    begins anew in every window, so that a band may take the sliding and still be followed. Source:
    cross-validation, Stone (1974).
    """
    theta = np.array([p.m, p.F_cp, p.F_cn, p.F_vp, p.F_vn])
    made = rows_and_windows(recorded.logs, theta)
    fast = np.concatenate([one.outside(p) for one in made])
    if np.count_nonzero(fast) < FEWEST_COMPARED:
        if recorded.drive == "command" or len(fast) < FEWEST_COMPARED:
            return None
        fast = np.ones(len(fast), dtype=np.bool_)
    rows = stacked([one.rows for one in made]).at(fast)
    return LeftOfEquation(rms(rows.b - rows.X @ theta), rms(left_unseen(rows)), rms(rows.b))


def is_no_run(misfit: float) -> bool:
    """Whether a run by the measured force that leaves so much is not the body's own motion."""
    return misfit > HOPELESS


def _unless_unexplained(fit: KarnoppFit, left: LeftOfEquation) -> KarnoppFit:
    """The fit, nothing reported where it and the equation leave most of the force."""
    return without_estimates(fit, left.share) if is_unexplained(left.share) else fit


def _explains(fit: KarnoppFit) -> bool:
    """Whether the equation of motion leaves hardly more than noise, or little of the force."""
    share = 1.0 if fit.left is None else fit.left[0]
    return share <= OF_ACCOUNT or not is_no_run(fit.chi_square)


def _identified(fit: KarnoppFit) -> int:
    """How many of mass and sliding friction a fit identifies."""
    return sum(fit.estimates[name].value is not None for name in FIVE)


def _by_equation(recorded: RecordedLogs, why: str) -> KarnoppFit | None:
    """The fit by the equation of motion, of both ways or of the one that there is, if it can be:
    not of steps, whose force has no errors, but velocity and acceleration have, so that least
    squares would draw mass and viscous friction to nothing (errors in variables: Söderström, Stoica
    (1989), 8.6)."""
    if recorded.steps:
        return None
    with suppress(NotIdentifiable):
        return fit_prescribed(recorded, why)
    return None
