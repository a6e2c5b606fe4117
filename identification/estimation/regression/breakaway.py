"""Stick limit at each breakaway: that with which a simulated body starts when the real one did.

The motion after a breakaway gives its instant within a fraction of a sample, and with it the force
at which the body let go: from sliding friction and band, found before, and one number a breakaway.
"""

from dataclasses import replace
from functools import lru_cache

import numpy as np

from identification.arrays import Array
from identification.estimation.regression.equation_rows import MotionLog
from identification.estimation.regression.standstill import (
    LEAST_BREAKAWAY,
    MEAN,
    RATE,
    Breakaways,
    rest_stretches,
)
from identification.log import Log
from identification.model.estimates import Drive
from identification.model.karnopp import Karnopp
from identification.model.plant import Motor, Plant
from identification.signals.sampling import samples
from identification.simulation.free_run import free_run

SAMPLES_BEFORE, SAMPLES_AFTER = 30, 25  # samples of 2 ms of rest and of motion that are compared
EXACT_POSITION = 1e-12  # m or rad: a position without noise
GRID = 25  # limits tried between the smallest and the largest force around the breakaway
NARROWED = 2  # times that the grid is drawn around its best
MOVED = 20.0  # times the position's noise that a body goes on to move, or it was no breakaway
UNDERSTOOD = 9.0  # mean square in noise units up to which an event counts as understood


@lru_cache(maxsize=16)
def breakaway_limits(one: MotionLog, friction: Karnopp, falls: bool = False) -> Breakaways:
    """Breakaways of a log: a rest of at least 48 ms, then motion; `force` is the stick limit.

    friction: sliding and band as the model without effects has them; falls: with the first motion
    the limit falls to that of `friction`, so it is no less. Source: stick limits of the paper's eq.
    (1) (Karnopp 1985); their estimate is ours.
    """
    found = []
    for low, high in rest_stretches(one, 3 * samples(MEAN, one.log.h)):
        event = _event(one, friction, falls, low, high)
        if event is not None:
            found.append(event)
    k = np.array(found).reshape(-1, 5)
    for way in (1.0, -1.0):  # a body that is pushed on at the start of a log has not broken away
        own = k[:, 1] == way
        if np.any(own):
            k = k[~own | (way * k[:, 3] > LEAST_BREAKAWAY * np.median(way * k[own, 3]))]
    return Breakaways(k[:, 0].astype(np.int64), k[:, 1], k[:, 2], k[:, 3], k[:, 4])


def _event(
    one: MotionLog, friction: Karnopp, falls: bool, low: int, high: int
) -> tuple[float, float, float, float, float] | None:
    """Last sample at rest, direction, time at rest, limit and rate of force; None: no breakaway."""
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
    driven = one.log if one.held else one.driving
    part = Log(one.log.name, {key: driven[key][first:last] for key in ("t", "y", "F")})
    part = part.with_signals(u=part["F"])  # of a motor that gives 1 N/V
    pushed = way * driven["F"][first : high + mean // 2]
    lowest, highest = float(np.min(pushed)), float(np.max(pushed))
    if highest <= max(lowest, 0.0):
        return None
    lowest = max(lowest, 0.0)
    best, left, span = 0.0, np.inf, highest - lowest
    tried = np.linspace(lowest, highest, GRID)
    for _ in range(NARROWED + 1):
        costs = [_cost(one, friction, falls, part, level, way, float(limit)) for limit in tried]
        left = float(np.min(costs))
        best = float(np.mean(tried[np.array(costs) <= left * (1.0 + 1e-9)]))  # it may jump
        span = 2.0 * span / (GRID - 1)
        tried = np.linspace(max(best - span, 0.0), best + span, GRID)
    if left > UNDERSTOOD or best >= highest:
        return None
    risen = np.flatnonzero(pushed >= best)
    at = first + max(int(risen[0]) - 1, 0) if len(risen) else high
    rate = way * float(F[at + 1] - F[max(at - of_rate, 0)]) / ((of_rate + 1) * h)
    return float(at), way, (at - low + 1) * h, way * best, rate


def _cost(
    one: MotionLog,
    friction: Karnopp,
    falls: bool,
    part: Log,
    level: float,
    way: float,
    limit: float,
) -> float:
    """Mean square of the position's error in noise units from rest on with this stick limit [N]."""
    side = {"F_sp": limit} if way > 0 else {"F_sn": -limit}
    before, y_m = np.zeros(0), part["y"]
    if falls:
        least = min(limit, friction.F_sp if way > 0 else -friction.F_sn)
        side = {"F_sp": least} if way > 0 else {"F_sn": -least}
        above = np.flatnonzero(way * part["F"] > limit)
        begin = int(above[0]) if len(above) else len(part)
        begin = begin if len(part) - begin > 1 else len(part)  # no motion in one sample
        before = np.full(begin, level)
        part = Log(part.name, {key: x[begin:] for key, x in part.signals.items()})
    nine = replace(friction, **side)
    drive: Drive = "command" if one.held else "force"
    plant = Plant(nine, Motor(1.0) if one.held else None)
    y = before
    if len(part):
        y = np.append(before, free_run(plant, part, (level, 0.0, float(part["F"][0])), drive).y)
    r: Array = (y - y_m) / max(one.noise.y, EXACT_POSITION)
    return float(np.mean(np.minimum(r**2, 1e4)))
