"""A plant by the equations alone, with the deviation of each of its parameters."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.arrays import Array
from identification.effects._base import AT_REST, Effect
from identification.estimation.recorded_logs import RecordedLogs
from identification.estimation.regression.actuator_fit import fit_actuator
from identification.estimation.regression.effect_columns import Values
from identification.estimation.regression.effect_rows import EffectRows
from identification.estimation.regression.equation_rows import ACTUATOR, BREAKAWAY, FIVE, MECHANICAL
from identification.estimation.regression.first_estimate import USUAL_STICK, first_estimate
from identification.estimation.regression.row_fit import RowFit, with_sizes
from identification.estimation.regression.standstill import borne
from identification.estimation.regression.weighted_rows import OVERLAP, inverse_of_gram
from identification.log import Rig
from identification.model.karnopp import NAMES, NEGATIVE, Karnopp
from identification.model.plant import Actuator, Motor, Plant
from identification.thresholds import TWICE

LEAST_OF_FIRST = 1e-9  # of a first estimate's largest value, that each has at least
MOST_STICK = 3.0  # times the Coulomb level, that a stick limit begins with at most
SHAPE = 0.03  # relative trust in a searched parameter
FAR_BEYOND = 1e3  # times its size, a deviation from which a part of an effect begins as none
QUICK = 20.0  # part of a sample, in which a body hardly moves on its own


@dataclass(frozen=True, eq=False)
class RegressedPlant:
    """A structure by the equations alone: its plant, the deviation of each parameter by name,
    and parameters that they do not identify; slow [m/s]: speed below which they do not
    hold."""

    plant: Plant
    prior: Mapping[str, float]
    unidentified: Mapping[str, float]
    slow: float


def regressed_plant(
    stage: EffectRows, outcomes: Mapping[str, RowFit], effects: Sequence[tuple[Effect, Values]],
    recorded: RecordedLogs,
) -> RegressedPlant:  # fmt: skip
    """The plant by the equations alone: weighted least squares in weak form.

    Sources: Messenger, Bortz (2021); inverse dynamic model, Gautier, Khalil, CDC 1988.
    """
    five = dict(zip(FIVE, np.maximum(stage.theta, 1e-9).tolist(), strict=True))
    sliding = outcomes[MECHANICAL]
    prior = dict(zip(FIVE, deviations(sliding)[:5].tolist(), strict=True))
    up, down = borne(recorded.logs)
    stick_p, stick_n = _limit(five["F_cp"], up), -_limit(five["F_cn"], down)
    if BREAKAWAY in outcomes:
        found = outcomes[BREAKAWAY].fit.theta
        stick_p = float(found[0]) if found[0] > 0 else stick_p
        stick_n = -float(found[1]) if found[1] > 0 else stick_n
    slow = max(sliding.slowest, float(np.min([5.0 * one.noise.v for one in stage.logs])))
    nine = Karnopp(**five, dv_p=slow, dv_n=-slow, F_sp=stick_p, F_sn=stick_n)
    drives: Actuator | Motor | None = motor_of(recorded.rig)
    if ACTUATOR in outcomes:
        k1, k2 = (float(x) for x in outcomes[ACTUATOR].fit.theta[:2])
        drives = Actuator(max(k1, 1e-9), max(k2, 0.0))
        prior |= dict(zip(("k1", "k2"), deviations(outcomes[ACTUATOR])[:2].tolist(), strict=True))
    acting, unidentified = [], dict[str, float]()
    for effect, shape in effects:
        values, spreads, none = _of_effect(effect, shape, outcomes)
        acting.append(effect.acting(values))
        prior |= spreads
        unidentified |= dict.fromkeys(none, np.inf)
    nine = replace(nine, m=max(nine.m, least_mass(nine, drives, recorded.logs[0].log.h)))
    return RegressedPlant(Plant(nine, drives, tuple(acting)), prior, unidentified, slow)


def first_plant(recorded: RecordedLogs) -> Plant:
    """The plant of the first estimates, the median over the logs: before any equation's rows."""
    found = [first_estimate(one).nine for one in recorded.logs]
    nine = np.median(found, axis=0)
    least = LEAST_OF_FIRST * max(float(np.max(np.abs(nine))), 1e-300)
    signs = np.array([-1.0 if name in NEGATIVE else 1.0 for name in NAMES])
    drives = fit_actuator(recorded.plain).nearest if recorded.by_command else motor_of(recorded.rig)
    return Plant(Karnopp.from_array(signs * np.maximum(signs * nine, least)), drives)


def motor_of(rig: Rig) -> Motor | None:
    """The motor of a rig, if one drives it."""
    gives = rig.force_per_command
    return Motor(gives) if rig.kind == "motor" and gives is not None else None


def _of_effect(
    effect: Effect, shape: Values, outcomes: Mapping[str, RowFit]
) -> tuple[dict[str, float], dict[str, float], list[str]]:
    """An effect's parameters by the equations, the deviation of each (as key.name), and those (as
    key.name) that they do not identify."""
    values = inside(effect, with_sizes(effect, shape, outcomes))
    spreads = effect_sd(effect, values, outcomes)
    unidentified: list[str] = []
    for p in effect.params:  # a signal that is not there identifies no parameter
        if p.name in AT_REST:  # nor do the equations identify a stick limit
            unidentified.append(f"{effect.key}.{p.name}")
            spreads.pop(p.name)
        elif p.name in effect.linear and spreads.get(p.name) == 0.0:  # nor a signal of nothing
            unidentified.append(f"{effect.key}.{p.name}")
            values[p.name] = float(np.clip(0.0, p.low, p.high))
        elif far_beyond(spreads.get(p.name), values[p.name], p.typical):
            values[p.name] = float(np.clip(0.0, p.low, p.high))
    return values, {f"{effect.key}.{k}": x for k, x in spreads.items()}, unidentified


def far_beyond(sd: float | None, value: float, typical: float) -> bool:
    """Whether a deviation is so far beyond its parameter that no search should begin from it."""
    return sd is not None and not sd < FAR_BEYOND * max(abs(value), abs(typical))


def _limit(coulomb: float, bearing: float) -> float:
    """A stick limit [N] to begin from; a body at rest against a stop bears more than any."""
    return min(max(USUAL_STICK * coulomb, bearing), MOST_STICK * coulomb)


def least_mass(nine: Karnopp, drives: Actuator | Motor | None, h: float) -> float:
    """Mass [kg] below which a body's motion is over within a small part of a sample of h [s].

    A regression bent by what the model lacks may leave none, and a run with none takes for ever.
    """
    k2 = drives.k2 if isinstance(drives, Actuator) else 0.0
    return max(max(nine.F_vp, nine.F_vn) * h / QUICK, k2 * (h / QUICK) ** 2)


def inertia_is_lost(o: RowFit) -> bool:
    """Whether the motion is prescribed: inertia is negligible beside what the model leaves."""
    keep = o.rows.speed >= o.slowest
    inertia = float(np.std((o.rows.X[:, 0] * o.fit.theta[0])[keep]))
    left = float(np.std((o.fit.residual * o.rows.sd)[keep]))
    return inertia < TWICE * left


def inside(effect: Effect, values: Mapping[str, float]) -> dict[str, float]:
    """The values, those out of bounds put at the bound."""
    return {p.name: float(np.clip(values[p.name], p.low, p.high)) for p in effect.params}


def deviations(o: RowFit) -> Array:
    """Standard deviations of theta, (k,), of weighted least squares (Aitken 1936), widened by what
    the rows leave and their overlap.

    0 where a column is nothing.
    """
    keep = o.rows.speed >= o.slowest
    A = (o.rows.X / o.rows.sd[:, np.newaxis])[keep]
    left = float(np.mean(o.fit.residual[keep] ** 2)) if np.any(keep) else 1.0
    square = np.maximum(np.diag(inverse_of_gram(A)), 0.0)
    return np.asarray(np.sqrt(square * OVERLAP * max(left, 1.0)))


def effect_sd(
    effect: Effect, values: Mapping[str, float], outcomes: Mapping[str, RowFit]
) -> dict[str, float]:
    """Standard deviations of an effect's parameters for the prior; 0 holds one at its value."""
    out: dict[str, float] = {}
    for p in effect.params:
        if p.at_default(values[p.name]):
            out[p.name] = 0.0
        else:
            out[p.name] = SHAPE * abs(values[p.name]) if values[p.name] else 0.0
    for o in outcomes.values():
        spreads = dict(zip(o.rows.names, deviations(o).tolist(), strict=True))
        for name in effect.linear:
            full = f"{effect.key}.{name}"
            if full in spreads:
                out[name] = spreads[full]
            elif f"{full}+" in spreads:
                out[name] = 0.5 * float(np.hypot(spreads[f"{full}+"], spreads[f"{full}-"]))
                out["asymmetry"] = out[name] / max(abs(values[name]), 1e-300)
    return out
