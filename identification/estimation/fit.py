"""The one estimator: from logs of a machine to its parameters, with intervals and reasons.

The nine of friction, the actuator's, and those of effects; driven by the command, by the measured
force, or along a prescribed motion; from nothing, or from the model that was active.

1. The equations in weak form give a start (or the active model does).
2. The free run in windows from measured states, the states' uncertainty taken out, refines it.
3. Where more than noise is left, a search for the plain plant finds another start.
4. The last step (`run_or_equation`): whole runs where they are followed, windows elsewhere; the
   equation of motion where it is more informative. Events and spread decide what is identifiable.

The equations, with symbols, units and sources: `README.md` here and in each room below.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from identification.errors import NotIdentifiable
from identification.estimation.converged_fit import converged_fit
from identification.estimation.late_position import what_acts_beside
from identification.estimation.prescribed_motion import (
    fit_prescribed,
    of_one_way,
    way_of,
)
from identification.estimation.recorded_logs import (
    RecordedLogs,
    acts_directly,
    commanded,
    is_prescribed,
    recorded_logs,
)
from identification.estimation.regression.actuator_fit import fit_actuator
from identification.estimation.run_or_equation import answered, likeliest
from identification.estimation.shown_in_sliding import as_sliding_shows
from identification.estimation.structure_fit import (
    FittedStructure,
    by_exact_force,
    plain_structure,
)
from identification.estimation.surroundings import (
    surrounding_estimates,
    widened_friction,
)
from identification.estimation.two_masses import of_two_masses, two_masses
from identification.estimation.windowed_run.parameters import even
from identification.estimation.windowed_run.refinement import Refit, refit
from identification.log import Log, Rig
from identification.model.estimates import Drive, KarnoppFit
from identification.model.plant import Actuator, Plant
from identification.model.surroundings import Surroundings
from identification.progress import Halt, KeepGoing, Progress, quiet, without_end
from identification.signals.check import are_steps, check_driven
from identification.signals.one_way import ONE_WAY_WHY
from identification.thresholds import (
    COMPLETE,
    HOPELESS,
    MATERIAL,
)

PRESCRIBED_WHY = "prescribed motion: inertia is negligible in the force"
ENDED_EARLY = "ended early, with the best so far: give it more time with a larger budget"


def fit_plant(
    logs: Sequence[Log],
    rng: np.random.Generator,
    *,
    rig: Rig,
    drive: Drive | None = None,
    prior: Plant | None = None,
    on_progress: Progress | None = None,
    keep_going: KeepGoing = without_end,
) -> KarnoppFit:
    """The parameters of a machine from its logs.

    logs: each with y [m] and F [N] (F_e), and u [V] to drive it by the command, evenly sampled.
    drive: "command" or "force"; by default the command where a linear actuator explains the force.
    prior: the plant that was active, from which the fit begins, with the effects that it has.
    keep_going: asked before every run; once it says no, the best so far is the result, and a remark
    says so. Without a prior, a constant force, gravity and a lag of the columns are identified
    beside friction. Raises BadLog where a signal is missing, NotIdentifiable where nothing moves.
    Sources: weak form, Messenger, Bortz, J. Comput. Phys. 443 (2021) 110525; friction, the paper's
    eq. (1) (Karnopp 1985); windows, Bock (1983); the order of steps is ours.
    """
    halt = Halt(keep_going)
    if prior is not None:
        report = on_progress or quiet
        report("refining", 0.0)
        return _near_prior(prior, recorded_logs(logs, rig, drive, halt), rng, report, drive)
    check_driven(logs)
    beside = what_acts_beside(logs, rig, halt)
    return fit_beside(logs, beside, rng, rig, drive, on_progress, halt)


def fit_beside(
    logs: Sequence[Log], beside: Surroundings, rng: np.random.Generator, rig: Rig,
    drive: Drive | None, on_progress: Progress | None, halt: Halt, *, quick: bool = False,
) -> KarnoppFit:  # fmt: skip
    """As `fit_plant`, of logs of which it is known what acts beside the applied force.

    quick: as a preliminary fit has it, without a search or whole runs, and without a second mass
    where inertia does not show.
    """
    report = on_progress or quiet
    report("refining", 0.0)
    alone = [beside.taken_out(log) for log in logs]
    up = way_of(alone, zoh=rig.kind == "motor")
    turns = bool(beside.orders) and up is not None
    try:
        recorded = recorded_logs(alone, rig, drive, halt)
        fit = _plain_fit(recorded, rng, report, by=drive, quick=quick, turns=turns)
    except NotIdentifiable:
        if up is None or are_steps(alone):
            raise
        fit = fit_prescribed(recorded_logs(alone, rig, drive), ONE_WAY_WHY)
    else:
        if turns and not fit.adequate:  # what a run one way leaves open, it bends
            with suppress(NotIdentifiable):
                fit = fit_prescribed(recorded, ONE_WAY_WHY)
    fit = fit if up is None else of_one_way(fit, up, rig)
    shows = not quick or fit.estimates["m"].value is not None
    if shows and not (fit.adequate or beside.orders or halt.reached()):
        resonance = two_masses(alone, rig) if acts_directly(alone, rig, drive) else None
        if resonance is not None:
            beside = replace(beside, resonance=resonance)
            friction, estimates = of_two_masses(resonance, fit.friction, fit.estimates)
            fit = replace(fit, friction=friction, estimates=estimates)
    if halt.reached():
        fit = replace(fit, remarks=(ENDED_EARLY, *fit.remarks))
    if beside.none:
        return replace(fit, surroundings=beside)
    if beside.sampled:  # a measured current, which no period holds
        fit = replace(fit, command_period=0.0)
    reported = widened_friction(fit.estimates, beside, logs) | surrounding_estimates(beside)
    return replace(
        fit, surroundings=beside, effects=beside.effects, estimates={**fit.estimates, **reported}
    )


def _near_prior(
    prior: Plant, recorded: RecordedLogs, rng: np.random.Generator, report: Progress,
    by: Drive | None,
) -> KarnoppFit:  # fmt: skip
    """As `fit_plant`, from a plant that was active."""
    if prior.effects:
        fit = likeliest(_with_effects(prior, recorded, report), recorded)
        return replace(fit, remarks=(*recorded.remarks, *fit.remarks))
    near = refit(prior, recorded.logs, recorded.drive, prior={}, effort="near")
    if near.misfit > COMPLETE:
        return _plain_fit(recorded, rng, report, by=by, near=near)
    fit = likeliest(converged_fit(near.plant, recorded, near.misfit, report), recorded)
    return replace(fit, remarks=(*recorded.remarks, *fit.remarks))


def _plain_fit(
    recorded: RecordedLogs, rng: np.random.Generator, report: Progress, *, by: Drive | None,
    near: Refit | None = None, quick: bool = False, turns: bool = False,
) -> KarnoppFit:  # fmt: skip
    """The fit of logs beside whose applied force nothing acts.

    near: another plant, refined, which stands where it is the better; turns: they turn one way,
    with orders of the turn; raises NotIdentifiable where no run is near, which a long fit would not
    bring there.
    """
    begin, last, other = rng.spawn(3)
    recorded, found = by_exact_force(recorded, plain_structure(recorded, begin), other)
    if turns and found.misfit > HOPELESS:
        raise NotIdentifiable(ONE_WAY_WHY)
    if near is not None and near.misfit < found.misfit:
        found = found.refined(near)
    fit = _with_actuator(finished(found, recorded, last, report, by=by, quick=quick), recorded)
    return replace(fit, remarks=(*recorded.remarks, *fit.remarks))


def finished(
    found: FittedStructure, recorded: RecordedLogs, rng: np.random.Generator, report: Progress,
    *, by: Drive | None = None, quick: bool = False,
) -> KarnoppFit:  # fmt: skip
    """The fit from a plain structure, converged; quick: not fitted over whole runs.

    by: the drive that was asked for; without one, a run driven by the command that a nonlinear
    actuator spoils is driven by the measured force instead.
    """
    other, forced_rng = rng.spawn(2)
    if found.prescribed and is_prescribed(recorded) and not recorded.steps:
        return as_sliding_shows(fit_prescribed(recorded, PRESCRIBED_WHY), recorded)
    if by is None and recorded.by_command and found.misfit > COMPLETE:
        said = _not_linear(recorded)
        if said:
            forced = recorded_logs(recorded.plain, recorded.rig, "force", recorded.halt)
            start = plain_structure(forced, other)
            again = finished(start, forced, forced_rng, report, by="force", quick=quick)
            return replace(again, remarks=(said, *again.remarks))
    return answered(found, recorded, report, quick=quick)


def _with_effects(prior: Plant, recorded: RecordedLogs, report: Progress) -> KarnoppFit:
    """The fit of a plant with effects, from where it was; once more with its band searched,
    where that leaves more than noise."""
    logs, drive = recorded.logs, recorded.drive
    fixed = even(prior)
    best: Refit = refit(prior, logs, drive, prior=fixed, effort="near")
    if best.misfit > COMPLETE:
        p = prior.friction
        band = max(p.dv_p, -p.dv_n)
        again = refit(prior, logs, drive, prior=fixed, band=band)
        best = again if again.misfit < best.misfit else best
    return converged_fit(best.plant, recorded, best.misfit, report, refined=best)


def _with_actuator(fit: KarnoppFit, recorded: RecordedLogs) -> KarnoppFit:
    """A fit by the measured force with the actuator that a regression gives, where it explains most
    of the force: not identified by the fit, but good enough to simulate with."""
    if fit.drive == "command" or fit.actuator is not None or not commanded(recorded.plain):
        return fit
    found = fit_actuator(recorded.plain)
    return replace(fit, actuator=Actuator(found.k1, found.k2)) if found.plausible else fit


def _not_linear(recorded: RecordedLogs) -> str:
    """What to say where a linear actuator leaves much of the force; "" where it does not."""
    found = fit_actuator(recorded.plain)
    noise = [one.noise.F**2 + (found.k2 * one.noise.y) ** 2 for one in recorded.logs]
    if not leaves_much(found.relative, found.rms / float(np.sqrt(np.mean(noise)))):
        return ""
    return (
        f"a linear actuator leaves {100 * found.relative:.1f} % of the force, so the run was driven"
        " by the logged force, not by the command"
    )


def leaves_much(of_force: float, of_noise: float) -> bool:
    """Whether a linear actuator is none: it leaves so much of the force, so many times the noise.

    of_force, of_noise: root mean square that it leaves, over the force's own and the sensors'.
    """
    return of_force > MATERIAL and of_noise**2 > HOPELESS
