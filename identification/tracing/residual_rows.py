"""Rows of a trace's residuals: in which equation and against which signal an effect shows in them,
and what it takes away there."""

from dataclasses import replace
from typing import Literal

import numpy as np

from identification.arrays import Array
from identification.effects._base import Acting, Effect
from identification.model.karnopp import Karnopp
from identification.simulation.effect_along_motion import contribution
from identification.tracing.result import Residual, Trace

Equation = Literal["mechanical", "actuator"]


def in_equation(effect: Effect) -> Equation | None:
    """The equation in whose residual an effect shows; None where in neither while sliding."""
    if effect.place.in_actuator:
        return "actuator"
    return None if effect.place.in_stops else "mechanical"


def shown_residuals(found: Trace) -> list[Residual]:
    """What is left of each equation: of motion, the force that is missing while the body slides."""
    if found.missing_force is None:
        return list(found.residuals)
    others = (one for one in found.residuals if one.equation != "mechanical")
    return [found.missing_force.sliding, *others]


def effect_at_rows(acting: Acting, residual: Residual, p: Karnopp) -> Array | None:
    """What an effect contributes at each row, (r,); None where it is no function of the signals."""
    effect = acting.effect
    if effect.place.sign is None or effect.evolve is not None or "v" not in residual.signals:
        return None
    blank = np.zeros(len(residual.t) + 1)  # a first row at t = 0, from which kernels count
    rows = {k: np.concatenate([[0.0], x]) for k, x in residual.signals.items()}
    signals = {"t": blank, "y": blank, "F": blank, "u": blank, **rows}
    signals["d"] = np.sign(signals["v"])
    value = contribution(effect, acting.values, signals, 1e-3, p)[1:]
    sign = effect.place.sign
    return np.asarray(value * (signals["d"][1:] if sign == 0.0 else sign))


def folded_at(residual: Residual, rate: float) -> Residual:
    """The first log's rows, with the part of a swing's period [1] at `rate` [Hz] as a signal.

    A swing keeps its rate from log to log, not its phase.
    """
    own = residual.log == residual.log[0]
    signals = {k: v[own] for k, v in residual.signals.items()}
    signals["phase"] = signals["t"] * rate % 1.0
    rows = {k: getattr(residual, k)[own] for k in ("t", "log", "before", "after", "noise")}
    return replace(residual, **rows, signals=signals)


def signal_of(effect: Effect, residual: Residual) -> str:
    """The signal against which an effect shows."""
    wanted = [*effect.depends_on, "v", "y"]
    for name in ["du", *wanted] if effect.place.delays else wanted:
        if name in residual.signals:
            return name
    return next(iter(residual.signals))


def share_inside(values: Array, noise: Array) -> float:
    """Points within two standard deviations of the noise [%]."""
    return 100 * float(np.mean(np.abs(values) <= 2 * noise))


def log_starts(residual: Residual) -> Array:
    """Time of each log's first row [s]."""
    return np.array([residual.t[residual.log == k].min() for k in np.unique(residual.log)])
