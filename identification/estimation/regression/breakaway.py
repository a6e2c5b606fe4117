"""Stick limit at each breakaway: that with which a simulated body starts when the real one did.

The motion after a breakaway gives its instant within a fraction of a sample, and with it the force
at which the body let go: from sliding friction and band, found before, and one number a breakaway.

A drive's loop is often faster than its log. The peak of its force, at which a body lets go, is then
in no sample: a run by the logged force finds the stick limit too low. What the force had risen to
when the motion was seen (`risen_to`) errs to the other side, by what it rises in a sample or two.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from identification.arrays import Array
from identification.estimation.regression.equation_rows import MotionLog
from identification.estimation.regression.standstill import (
    MEAN,
    ONSET,
    RATE,
    Breakaways,
    rest_stretches,
)
from identification.log import Log
from identification.model.karnopp import Karnopp
from identification.model.plant import Plant
from identification.model.size import Size
from identification.signals.sampling import samples
from identification.signals.steps import MEDIAN_OF_NOISE
from identification.simulation.free_run import released
from identification.simulation.inverse_dynamics import of_body, opposing_force, with_motor_force
from identification.thresholds import EVENTS_NEEDED

SAMPLES_BEFORE, SAMPLES_AFTER = 30, 25  # samples of 2 ms of rest and of motion that are compared
EXACT_POSITION = 1e-12  # m or rad: a position without noise
GRID = 25  # limits tried between the smallest and the largest force around the breakaway
NARROWED = 2  # times that the grid is drawn around its best
MOVED = 20.0  # times the position's noise that a body goes on to move, or it was no breakaway
LOST = 1e4  # square in noise units, beyond which one sample is as far off as another
SHORT_REST, LINE = 6, 10  # samples at rest at least; samples of 2 ms, whose force is a line
FEWEST_ON_LINE = 4
# Of a stick limit; a body that let go later had been caught again.
LIMITS_PER_COULOMB = (0.96, 2.8)
# Of the fastest speed, that are tried where no band is known.
USUAL_BANDS = (0.0, 0.01, 0.03, 0.1, 0.3)
UNDERSTOOD = 9.0  # mean square in noise units up to which an event counts as understood


@lru_cache(maxsize=16)
def breakaway_limits(one: MotionLog, friction: Karnopp) -> Breakaways:
    """Breakaways of a log: a rest of at least 48 ms, then motion; `force` is the stick limit.

    friction: sliding and band as the model without effects has them. Source: stick limits of the
    paper's eq. (1) (Karnopp 1985); their estimate is ours.
    """
    stretches = rest_stretches(one, 3 * samples(MEAN, one.log.h))
    events = (_event(one, friction, low, high) for low, high in stretches)
    return Breakaways.of([event for event in events if event is not None])


def with_shown_band(one: MotionLog, friction: Karnopp) -> Karnopp:
    """Sliding friction with that of a few bands, alike both ways, with which the breakaways of a
    log are understood best. Source: as `breakaway_limits`."""
    fastest = float(np.max(np.abs(one.signals["v"])))
    tried = [replace(friction, dv_p=x * fastest, dv_n=-x * fastest) for x in USUAL_BANDS]
    return min(tried, key=lambda x: float(np.sum(breakaway_limits(one, x).left - UNDERSTOOD)))


def _event(
    one: MotionLog, friction: Karnopp, low: int, high: int
) -> tuple[float, float, float, float, float, float] | None:
    """Last sample at rest, direction, time at rest, limit, rate of force and what is left of the
    position; None: no breakaway."""
    y, F, h = one.log["y"], one.log["F"], one.log.h
    mean, of_rate = samples(MEAN, h), samples(RATE, h)
    first, last = (
        max(low + mean, high - samples(SAMPLES_BEFORE, h)),
        high + samples(SAMPLES_AFTER, h),
    )
    if last >= len(y) or first + mean >= high:
        return None
    way = float(np.sign(one.signals["d"][high]))
    level = float(np.mean(y[first : first + mean]))
    if way * (y[last - 1] - level) < MOVED * one.noise.y:
        return None
    driven = one.log if one.by_motor else one.driving
    part = Log(one.log.name, {key: driven[key][first:last] for key in ("t", "y", "F")})
    pushed = way * driven["F"][first : high + mean // 2]
    lowest, highest = float(np.min(pushed)), float(np.max(pushed))
    if highest <= max(lowest, 0.0):
        return None
    lowest = max(lowest, 0.0)
    best, left, span = 0.0, np.inf, highest - lowest
    tried = np.linspace(lowest, highest, GRID)
    for _ in range(NARROWED + 1):
        costs = _costs(one, friction, part, level, way, tried)
        left = float(np.min(costs))
        best = float(np.mean(tried[costs <= left * (1.0 + 1e-9)]))  # it may jump
        span = 2.0 * span / (GRID - 1)
        tried = np.linspace(max(best - span, 0.0), best + span, GRID)
    if left > UNDERSTOOD or best >= highest:
        return None
    risen = np.flatnonzero(pushed >= best)
    at = first + max(int(risen[0]) - 1, 0) if len(risen) else high
    rate = way * float(F[at + 1] - F[max(at - of_rate, 0)]) / ((of_rate + 1) * h)
    return float(at), way, (at - low + 1) * h, way * best, rate, left


def _costs(
    one: MotionLog, friction: Karnopp, part: Log, level: float, way: float, limits: Array
) -> Array:
    """Mean square of the position's error in noise units from rest on with these stick limits [N],
    (k,) each."""
    name = "F_sp" if way > 0 else "F_sn"
    nine = [replace(friction, **{name: way * float(limit)}) for limit in limits]
    y = released(nine, part["F"], one.log.h, hold=one.zoh, level=level)
    r = (y - part["y"]) / max(one.noise.y, EXACT_POSITION)
    return np.asarray(np.mean(np.minimum(np.nan_to_num(r**2, nan=LOST), LOST), axis=1))


def usual_limits(logs: Sequence[MotionLog], plant: Plant) -> tuple[dict[str, Size], float]:
    """F_sp and F_sn [N] of most breakaways, each by itself with the plant's band, of the directions
    that have any; and by how much the force rises in a sample there.

    A median, since a body that is caught again at once seems to let go much later; its deviation by
    the median of theirs, infinite where they are few. Sources: as `breakaway_limits`; median and
    its spread, Huber, Robust Statistics (1981), 5.1.
    """
    p = plant.friction
    found = [breakaway_limits(_alone(one, plant), p) for one in logs]
    force = np.concatenate([one.force for one in found])
    rises = [np.abs(one.rate) * log.log.h for one, log in zip(found, logs, strict=True)]
    out: dict[str, Size] = {}
    for name, coulomb, way in (("F_sp", p.F_cp, 1.0), ("F_sn", p.F_cn, -1.0)):
        own = way * force[np.sign(force) == way]
        least, most = (factor * coulomb for factor in LIMITS_PER_COULOMB)
        own = own[(least < own) & (own < most)]
        if len(own):
            middle = float(np.median(own))
            spread = float(np.median(np.abs(own - middle))) / MEDIAN_OF_NOISE
            enough = len(own) >= EVENTS_NEEDED
            out[name] = Size(way * middle, spread / np.sqrt(len(own)) if enough else np.inf)
    return out, float(np.median(np.concatenate(rises))) if len(force) else 0.0


def _alone(one: MotionLog, plant: Plant) -> MotionLog:
    """The log with the force that is left to move the body and its friction."""
    if not plant.effects:
        return one
    log = of_body(with_motor_force(one.log, plant), plant)
    y, none = np.asarray(log["y"]), np.zeros(len(log))
    force = np.asarray(log["F"]) - opposing_force(log, plant, y, none, none)
    return replace(one, log=log.with_signals(F=force))


def risen_to(logs: Sequence[MotionLog], plant: Plant) -> dict[str, Size]:
    """F_sp and F_sn [N] by the force at the instants from which motion is seen after a rest,
    however short; none of a direction with too few such.

    The force is a line through its samples at rest, less noisy than any of them, but for the last,
    in which the body may have let go; with what the plant's effects push. Each counts by its
    deviation: that of the line, and what it rises by in a sample. Source: weighted mean and its
    spread, Aitken (1936); the rest is ours: `README.md`, (6).
    """
    found = np.array([event for one in logs for event in _rises(one, plant)]).reshape(-1, 3)
    out: dict[str, Size] = {}
    for name, way in (("F_sp", 1.0), ("F_sn", -1.0)):
        force, sd = found[found[:, 0] == way, 1:].T
        if len(force) >= EVENTS_NEEDED:
            weight = 1.0 / sd**2
            mean = float(np.average(force, weights=weight))
            spread = float(np.mean(((force - mean) / sd) ** 2))
            out[name] = Size(way * mean, float(np.sqrt(max(spread, 1.0) / np.sum(weight))))
    return out


def _rises(one: MotionLog, plant: Plant) -> list[tuple[float, float, float]]:
    """Of each rest that ends: the way that the body then goes, force that way [N], deviation."""
    log = of_body(with_motor_force(one.log, plant), plant)
    y, h, none = np.asarray(log["y"]), log.h, np.zeros(len(log))
    force = np.asarray(log["F"]) - opposing_force(log, plant, y, none, none)
    out = list[tuple[float, float, float]]()
    for low, high in rest_stretches(one, SHORT_REST):
        if high + SHORT_REST >= len(y):
            continue
        way = float(np.sign(one.signals["d"][high]))
        gone = way * (y[low : high + SHORT_REST] - float(np.median(y[low:high])))
        seen = np.flatnonzero(gone[(high - low) // 2 :] > ONSET * max(one.noise.y, EXACT_POSITION))
        if not len(seen):
            continue
        first = low + (high - low) // 2 + int(seen[0])
        at = np.arange(max(low, first - samples(LINE, h)), first - 1)
        if len(at) < FEWEST_ON_LINE:
            continue
        X = np.column_stack([np.ones(len(at)), at - at[-1]])
        line, *_ = np.linalg.lstsq(X, way * force[at], rcond=None)
        left = way * force[at] - X @ line
        noise = max(float(np.sqrt(left @ left / (len(at) - 2))), one.noise.F)
        sd = float(np.hypot(noise * np.sqrt(np.linalg.inv(X.T @ X)[0, 0]), line[1]))
        if line[1] > 0.0:
            out.append((way, float(line[0] + 1.5 * line[1]), sd))
    return out
