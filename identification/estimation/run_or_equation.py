"""What answers for a machine: its run over whole logs, in windows, or the equation of motion.

One place decides. A rig that prescribes the motion, or a run by a measured force that is not the
body's own, leaves the equation. Else the run is settled, whole where it is followed so
(`settling`); and where it leaves clearly more of the equation than the equation's own least squares
do on held-out stretches, or identifies less of mass and sliding friction without following the log,
the equation answers after all. Of a motor's noisy command both answer, each for what it shows.
"""

from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag

from identification.errors import NotIdentifiable
from identification.estimation.imposed_motion import (
    FEWEST_COMPARED,
    fit_imposed,
    fit_one_way,
    is_unexplained,
    without_estimates,
)
from identification.estimation.recorded_logs import RecordedLogs
from identification.estimation.regression.equation_rows import FIVE
from identification.estimation.regression.motion_rows import rows_and_windows
from identification.estimation.regression.row_fit import rms
from identification.estimation.regression.weighted_rows import left_unseen, stacked
from identification.estimation.settling import is_adequate, settled
from identification.estimation.structure_fit import FittedStructure
from identification.estimation.windowed_run.run_errors import misfit
from identification.model.estimates import KarnoppFit
from identification.model.karnopp import Karnopp
from identification.model.plant import Plant
from identification.progress import Halted, Progress
from identification.remarks import MinorRemark
from identification.thresholds import HOPELESS, MATERIAL, WORSE

WAYS_OF_SLIDING = (("F_cp", "F_vp"), ("F_cn", "F_vn"))
LOST_WHY = "no free run follows these logs (inertia does not show beside what is left)"
STEPS_WHY = (
    "nothing is identifiable from the equation of motion of steps of force; log a force that"
    " changes in a run"
)
FLOOR_WHY = (
    "the free run does not follow the logs, which biases mass and friction; stick limits and band"
    " are not identifiable"
)
STOPS_WHY = MinorRemark(
    "mass and sliding friction are those of the equation of motion, since the command is noisy;"
    " stick limits and bands those of the run"
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
    if recorded.drive == "force" and (found.imposed or is_no_run(found.misfit)):
        why = LOST_WHY if found.imposed else "no free run follows these logs"
        if recorded.steps:
            raise NotIdentifiable(f"{recorded.name}: {why}, and {STEPS_WHY}")
        return fit_imposed(recorded, why)
    if quick and not is_adequate(found.misfit):
        fit = by_equation_if_surer(found.plant.friction, recorded)
        if fit is not None:
            return fit
    try:
        fit = settled(found.plant, recorded, found.misfit, report, quick=quick)
    except Halted:
        with recorded.halt.closing():
            fit = settled(found.plant, recorded, found.misfit, report, quick=True)
    return on_the_floor(fit, recorded)


def on_the_floor(fit: KarnoppFit, recorded: RecordedLogs) -> KarnoppFit:
    """The fit, or that of the equation of motion alone, where the fit leaves clearly more of that
    equation than least squares do on held-out stretches: its run is not followed, or only down to a
    noise that the equation averages out. Source: cross-validation, Stone, J. R. Stat. Soc. B 36
    (1974) 111; the comparison is ours."""
    if fit.effects:
        return fit
    left = left_by(fit.friction, recorded)
    surer = left is not None and left.surer
    if left is not None and fit.adequate:
        surer = surer and left.is_material(max(fit.friction.F_cp, fit.friction.F_cn))
    # Of a run that is not followed, windows may identify next to nothing.
    if surer or not fit.adequate:
        other = _by_equation(recorded, LESS_ERROR_WHY if fit.adequate else FLOOR_WHY)
        if left is None and other is not None and is_no_run(other.chi_square):
            other = None  # of few rows, of which far more than noise is left
        if other is not None and (surer or _identified(other) > _identified(fit)):
            # A run that is followed to the noise lacks nothing, whichever gives its parameters.
            fit = replace(other, adequate=fit.adequate)
    elif recorded.by_noisy_command:
        fit = _with_stops(fit, recorded)
    return fit if left is None else _unless_unexplained(fit, left)


def _with_stops(fit: KarnoppFit, recorded: RecordedLogs) -> KarnoppFit:
    """A motor's mass and sliding friction by the equation of motion, and by the run what that does
    not show: stick limits and bands.

    Of a noisy command the equation has white errors, the run their integral over a window: weighed
    sample by sample it is the less exact and biased. Where its values do not follow the log that
    the run's follow, their errors are not of that noise, and the run's stand. Source: equation
    error against output error, Ljung, System Identification (1999), 7.3.
    """
    other = _by_equation(recorded, LESS_ERROR_WHY)
    if other is None or _identified(other) < _identified(fit):
        return fit
    five = {name: getattr(other.friction, name) for name in FIVE}
    mixed = Plant(replace(fit.friction, **five), fit.actuator)
    if not is_adequate(misfit(mixed, recorded.logs, recorded.drive)):
        return fit
    told = {name: other.estimates[name] for name in FIVE}
    for level, slope in WAYS_OF_SLIDING:  # known only without its partner
        one = fit.estimates[level]
        if one.value is None and slope not in other.free:
            told[level] = told[level].withheld(one.reason or "", five[level])
    stops = [name for name in fit.free if name not in FIVE]
    at = [fit.free.index(name) for name in stops]
    return replace(
        fit,
        friction=mixed.friction,
        estimates={**fit.estimates, **told},
        free=(*other.free, *stops),
        covariance=block_diag(other.covariance, fit.covariance[np.ix_(at, at)]),
        left=other.left,
        falling=other.falling,
        remarks=(*fit.remarks, STOPS_WHY),
    )


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
    for by in (fit_imposed, fit_one_way):
        with suppress(NotIdentifiable):
            return by(recorded, why)
    return None
