"""Force that a model needs for a measured motion on a log of its card, and that which it lacks."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from identification.arrays import Array
from identification.effects._base import Acting
from identification.errors import BadLog
from identification.estimation.latent_force import LatentForces, latent_forces
from identification.estimation.recorded_logs import RecordedLogs, plain_share, with_share
from identification.estimation.structure_fit import ABOVE_BAND
from identification.log import Log, Rig
from identification.model.estimates import Drive
from identification.model.inverse_model import SURE_SLIDING, Smoothing
from identification.model.karnopp import VISCOUS_NAMES
from identification.model.plant import Motor, Plant
from identification.model.size import NOT_SHOWN, Size
from identification.model.surroundings import Surroundings
from identification.signals.clean import applied_force
from identification.signals.differentiate import differentiate
from identification.simulation.inverse_dynamics import force_needed
from workbench.documents.model import Model, used


def seen_moving(model: Model, log: Log) -> Plant:
    """The plant for a motion that was measured: a stick band that no log identifies is no wider
    than the speed from which the body surely moves, since a body seen to slide is not stuck."""
    plant = model.simulated
    if not {"dv_p", "dv_n"} & set(model.assumed):
        return plant
    sure, p = SURE_SLIDING * differentiate(log["y"], log.h).v_noise, plant.friction
    dv_p = min(p.dv_p, sure) if "dv_p" in model.assumed else p.dv_p
    dv_n = max(p.dv_n, -sure) if "dv_n" in model.assumed else p.dv_n
    return replace(plant, friction=replace(p, dv_p=dv_p, dv_n=dv_n))


def force_by_model(model: Model, log: Log, how: Smoothing) -> Array:
    """Force that the model needs for a motion that was measured [N], (n,)."""
    up, down = (used(model.falling[k]) if k in model.falling else 0.0 for k in VISCOUS_NAMES)
    return force_needed(log, seen_moving(model, log), how, (up, down))


def with_applied_force(log: Log, rig: Rig) -> Log:
    """The log with F, by the rig where it is not logged; raises BadLog where that gives none."""
    if "F" in log:
        return log
    force = applied_force(log, rig)
    if force is None:
        raise BadLog(
            f"{log.name}: no applied force; give the card F, both pressures, or force_per_command"
        )
    return log.with_signals(F=force)


def of_one_instant(log: Log, model: Model) -> Log:
    """The log with its force at the instants of its position, where its columns are apart and no
    effect of the model says so, and held between them as the model's logs showed it."""
    held = model.rig.kind == "force" and model.fit.command_period is not None
    if "input_delay" in model.effects or (model.lag is None and not held):
        return log
    drive = model.simulated.actuator
    gives = drive.k_a if isinstance(drive, Motor) else None
    lag = NOT_SHOWN if model.lag is None else Size(used(model.lag))
    return Surroundings(lag=lag, gives=gives, held=held).of_one_instant(log)


def missing_force(model: Model, logs: Sequence[Log]) -> LatentForces | None:
    """The latent force of a model on logs of its machine; None where no body slides, and where two
    masses swing behind each other, of which the one body of a latent force is none. A slope by
    which friction falls with speed is no viscous friction, so it is among what is missing."""
    if model.resonance is not None:
        return None
    given = [of_one_instant(with_applied_force(log, model.rig), model) for log in logs]
    drive: Drive = "command" if model.rig.kind == "motor" else "force"
    read = RecordedLogs((), model.rig, drive, imposed=model.prescribed_motion).of(given)
    recorded = with_share(read, plain_share(read))
    plants = [seen_moving(model, log) for log in given]
    plant = max(plants, key=lambda one: one.friction.dv_p - one.friction.dv_n)
    p = plant.friction
    found = latent_forces(plant, recorded.logs, ABOVE_BAND * max(p.dv_p, -p.dv_n))
    return found if any(np.any(one.slides) for one in found.logs) else None


def refuse_missing(log: Log, effects: Iterable[Acting]) -> None:
    """Raises BadLog where an effect would act by signals of which the log has none."""
    for one in effects:
        wanted = one.effect.signals
        missing = [key for key in wanted if key not in log]
        if missing and (set(missing) & set(one.effect.needs) or len(missing) == len(wanted)):
            raise BadLog(
                f"{log.name}: effect {one.key!r} of the model acts by {', '.join(missing)}, which"
                " the log has not; name its column in the card"
            )
