"""Force that a plant with effects needs for a measured motion: the inverse model with effects."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from identification.arrays import Array
from identification.effects._base import Acting
from identification.effects._places import Place
from identification.log import Log
from identification.model.inverse_model import Smoothing, force_predicted
from identification.model.plant import Motor, Plant
from identification.signals.differentiate import differentiate
from identification.simulation.effect_along_motion import contribution, elastic_share
from identification.simulation.effect_run import effective_commands
from identification.simulation.effect_table import effect_table, signal_table

REVERSALS = 2  # substitutions by which a transducer's reading is inverted
# Of a force on which its own friction depends: at most, and of the largest what is near enough
MOST_SUBSTITUTIONS, OF_LARGEST_FORCE = 20, 1e-9


def force_needed(
    log: Log, plant: Plant, how: Smoothing, falling: tuple[float, float] = (0.0, 0.0)
) -> Array:
    """Force that the motion needs [N], (n,): as `inverse_model.force_predicted`, with effects.

    Friction of the effects is signed by the direction and their forces are taken off; inside the
    stick band it is the applied force within the limits, which is no prediction. Friction that
    depends on the applied force is that of the force needed: the measured one would predict itself.
    falling: slopes [N s/m] with which friction falls with speed, down to 0. Source: of the
    substitutions, Aitken, Proc. R. Soc. Edinburgh 46 (1926) 289.
    """
    if not (plant.effects or any(falling)):
        return force_predicted(log, plant.friction, how)
    force, motion = np.asarray(log["F"]), differentiate(log["y"], log.h, how.cutoff, how.method)
    p, v = plant.friction, motion.v
    d = np.where(v >= p.dv_p, 1.0, np.where(v <= p.dv_n, -1.0, 0.0))
    along = Along(motion.y, v, motion.a, d)
    if not any(one.effect.load_dependent for one in plant.effects):
        return force_along(log, force, plant, along, falling)
    for _ in range(MOST_SUBSTITUTIONS):
        once = force_along(log, force, plant, along, falling)
        first = once - force
        second = force_along(log, once, plant, along, falling) - once
        bend = second - first  # from each to the next it is nearer by the same share
        force = once + np.where(bend != 0.0, -first * second / np.where(bend, bend, 1.0), second)
        if float(np.max(np.abs(second))) <= OF_LARGEST_FORCE * float(np.max(np.abs(force))):
            break
    return force


class Along(NamedTuple):
    """A motion: position [m], speed [m/s], acceleration [m/s^2] and direction, 0 at rest, (n,)."""

    y: Array
    v: Array
    a: Array
    d: Array


def force_along(
    log: Log, force: Array, plant: Plant, motion: Along, falling: tuple[float, float] = (0.0, 0.0)
) -> Array:
    """As `force_needed`, of friction as this applied force makes it [N], (n,)."""
    p, v, d, blank = plant.friction, motion.v, motion.d, np.zeros(len(log))
    signals = {"u": blank, **log.signals, "F": force, "y": motion.y, "v": v, "d": d}
    pushed = _sum(plant, lambda place: place.drives, signals, log.h)
    slip = _sum(plant, lambda place: place.rubs, signals, log.h)
    stick = _sum(plant, lambda place: place.holds, signals, log.h)
    coulomb = _coulomb(plant, signals, log.h)
    slopes = p.F_vp + falling[0], p.F_vn + falling[1]
    viscous = np.where(d > 0, *slopes) * np.abs(v)
    # Friction never drives, but a bent bristle does.
    sliding = np.maximum(coulomb + viscous + slip, np.minimum(coulomb, 0.0))
    limits = np.minimum(p.F_sn - stick, 0.0), np.maximum(p.F_sp + stick, 0.0)
    resting = np.clip(log["F"] + pushed, *limits)
    return np.asarray(p.m * motion.a + np.where(d == 0, resting, d * sliding) - pushed)


def opposing_force(log: Log, plant: Plant, y: Array, v: Array, d: Array) -> Array:
    """Force that friction and the effects oppose to a motion, but for viscous friction [N], (n,).

    y, v: the motion; d: its direction, 0 where it is taken to rest, where this means nothing; all
    (n,). Viscous friction that is not the same in both directions is opposed by how far it lies
    from the mean.
    """
    p, blank = plant.friction, np.zeros(len(log))
    signals = {"u": blank, **log.signals, "y": y, "v": v, "d": d}
    pushed = _sum(plant, lambda place: place.drives, signals, log.h)
    slip = _sum(plant, lambda place: place.rubs, signals, log.h)
    uneven = 0.5 * (p.F_vp - p.F_vn) * np.abs(v)
    return np.asarray(d * (_coulomb(plant, signals, log.h) + slip) + uneven - pushed)


def of_body(log: Log, plant: Plant) -> Log:
    """The log with the body's position in place of what the transducer shows of it.

    A transducer with play is left as it is: the body's motion is the same while it moves.
    """
    sensors = [a for a in plant.effects if a.effect.place.shows and a.effect.evolve is None]
    blank = np.zeros(len(log))
    for one in reversed(sensors):
        true = shown = log["y"]
        for _ in range(REVERSALS):
            signals = {"F": blank, "u": blank, **log.signals, "y": true, "v": blank, "d": blank}
            true = shown - (_along(one, plant, signals, log.h) - true)
        log = log.with_signals(y=true)
    return log


def with_motor_force(log: Log, plant: Plant) -> Log:
    """The log with a motor's force by the command that reaches it, where effects change that."""
    late = any(one.effect.place.on_command for one in plant.effects)
    if not late or not isinstance(plant.actuator, Motor) or "u" not in log:
        return log
    table, s = effect_table(plant.effects), signal_table(plant.effects, log)
    z = np.zeros(len(plant.effects))
    reached = effective_commands(
        table.codes, table.addresses, table.p, s, z, np.array(log["t"]), np.array(log["u"]), log.h
    )
    return log.with_signals(F=plant.actuator.k_a * reached)


def _sum(
    plant: Plant, acts: Callable[[Place], bool], signals: Mapping[str, Array], h: float
) -> Array:
    """What the effects that act so add along the motion [N], (n,)."""
    parts = [_along(a, plant, signals, h) for a in plant.effects if acts(a.effect.place)]
    return np.sum(parts, axis=0) if parts else np.zeros(len(signals["t"]))


def _along(one: Acting, plant: Plant, signals: Mapping[str, Array], h: float) -> Array:
    return contribution(one.effect, one.values, signals, h, plant.friction)


def _coulomb(plant: Plant, signals: Mapping[str, Array], h: float) -> Array:
    """Friction against the motion without its viscous part [N], (n,).

    Where bristles replace sticking it is their elastic force, under a level that falls from the
    stick limit with speed (`effect_step`).
    """
    p, v, d = plant.friction, signals["v"], signals["d"]
    coulomb = np.where(d > 0, p.F_cp, p.F_cn)
    for one in plant.effects:
        if one.effect.place.elastic:
            share = d * elastic_share(one.effect, one.values, signals, h, p)
            edge = np.where(d > 0, p.dv_p, p.dv_n)
            limit = np.where(d > 0, p.F_sp, -p.F_sn)
            return np.asarray(share * (coulomb + (limit - coulomb) * np.exp(-((v / edge) ** 2))))
    return coulomb
