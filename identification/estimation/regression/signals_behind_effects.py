"""Signals as they are behind an effect: of the sensor, or between command and actuator."""

import numpy as np

from identification.arrays import Array
from identification.effects._base import Effect
from identification.estimation.regression.effect_columns import Values
from identification.estimation.regression.equation_rows import MotionLog, integral
from identification.model.karnopp import Karnopp
from identification.simulation.effect_along_motion import contribution


def shown_to_true(effect: Effect, values: Values, one: MotionLog, friction: Karnopp) -> Array:
    """Position of the body [m] behind the measured one, (n,), by the sensor effect's own equation.

    A play is crossed while the measured position rests, so the body is on the side of the last
    motion; any other transducer is inverted by two substitutions.
    """
    y = np.asarray(one.log["y"])
    signals = dict(one.signals)
    if effect.evolve is not None:
        return y + 0.5 * values[effect.params[0].name] * _last_direction(one.signals["d"])
    true = y
    for _ in range(2):
        signals["y"] = true
        true = y - (contribution(effect, values, signals, one.log.h, friction) - true)
    return true


def driven(one: MotionLog, reached: Array) -> Array:
    """Force of a motor [N], (n,), by the integral of the command that reaches it [V s]."""
    u = np.asarray(one.log["u"])
    k_a = float(u @ one.log["F"]) / max(float(u @ u), 1e-300)
    return np.asarray(k_a * command_of(one, reached))


def command_of(one: MotionLog, reached: Array) -> Array:
    """Command [V], (n,), by its integral."""
    return np.append(np.diff(reached), 0.0) / one.log.h


def _last_direction(d: Array) -> Array:
    """d (n,) with every 0 replaced by the last direction before it."""
    at = np.maximum.accumulate(np.where(d != 0, np.arange(len(d)), 0))
    return d[at]


def reached(effect: Effect, values: Values, one: MotionLog, friction: Karnopp) -> Array:
    """Integral of the command that reaches the actuator [V s], (n,)."""
    h, u = one.log.h, np.asarray(one.log["u"])
    given = contribution(effect, values, one.signals, h, friction)
    if not effect.place.delays:
        return integral(given, h)
    t = h * np.arange(len(u))
    return np.asarray(np.interp(t - float(given[0]), t, integral(u, h)))
