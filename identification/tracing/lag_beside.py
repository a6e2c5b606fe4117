"""A lag of the columns that an effect hides: force and motion that are not of one instant.

A force that a drive holds for a period, and that is logged at its begin, is half a period ahead of
the motion. Beside a spring or falling friction, of which the plain equation knows nothing, that
does not show, and no plain run bears it out; then a second effect takes its place, or none fits. So
it is looked for again without the force of the first effect.
"""

from collections.abc import Sequence
from dataclasses import replace

from identification.effects._base import Acting
from identification.estimation.regression.motion_log import motion_log
from identification.estimation.surroundings import explains, surroundings
from identification.log import Log, Rig
from identification.model.plant import Plant
from identification.model.size import Size
from identification.simulation.inverse_dynamics import opposing_force
from identification.thresholds import WORSE
from identification.tracing.result import Trace


def lag_beside(plant: Plant, logs: Sequence[Log], rig: Rig) -> Size:
    """The lag of the force's column in logs of a plant, without the force of its first effect; not
    shown where the equation identifies none. Source: as `surroundings`, Gautier, Khalil (1988)."""
    return surroundings([_without(plant, plant.effects[:1], log, rig) for log in logs], rig).lag


def _without(plant: Plant, effects: tuple[Acting, ...], log: Log, rig: Rig) -> Log:
    """The log without the force of these effects along its motion."""
    if not effects or not all(one.effect.place.drives or one.effect.place.rubs for one in effects):
        return log
    one = motion_log(log, held=rig.kind == "motor", by_command=False)
    y, v, d = (one.signals[name] for name in ("smooth", "v", "d"))
    with_them, alone = (
        opposing_force(log, replace(plant, effects=own), y, v, d) for own in (effects, ())
    )
    return log.with_signals(F=log["F"] - (with_them - alone))


def follows_with_lag(without: Trace, with_it: Trace) -> bool:
    """Whether a trace of the logs without their lag leaves clearly less of the held-out force, and
    no more of the position, which no noise that a loop puts into its force can lessen."""
    before, after = without.after["test"], with_it.after["test"]
    if before.force_rms is None or after.force_rms is None:
        return False
    off = [one.position_rms for one in (before, after)]
    worse = off[0] is not None and (off[1] is None or off[1] > WORSE * off[0])
    return explains(before.force_rms**2, after.force_rms**2) and not worse
