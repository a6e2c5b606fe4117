"""Force that a model needs for a measured motion, on a log of its card."""

from collections.abc import Iterable
from dataclasses import replace

from identification.arrays import Array
from identification.effects._base import Acting
from identification.errors import BadLog
from identification.log import Log, Rig
from identification.model.inverse_model import SURE_SLIDING, Smoothing
from identification.model.karnopp import VISCOUS_NAMES
from identification.model.plant import Plant
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
