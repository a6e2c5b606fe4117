"""Changed friction: do two Coulomb levels, fitted anew on the begin of the test logs, let the
same law follow the rest of them?

Equations show what changed where sliding is all that is missing. A real machine lacks a little
everywhere, and there the question is one of prediction: levels that are fitted to a part of a log
and follow what comes after it are its own, whatever else the law may lack.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.optimize import minimize

from identification.arrays import Array
from identification.estimation.regression.equation_rows import MotionLog
from identification.log import Log, Rig
from identification.model.estimates import NORMAL_95, Drive
from identification.model.karnopp import Karnopp
from identification.model.plant import Plant, units_of
from identification.signals.differentiate import is_long_enough
from identification.signals.initial_state import measured_start
from identification.simulation.free_run import free_run
from identification.thresholds import EARNS, TWICE
from identification.tracing.result import Change

BEGIN = 0.25  # of a test log, on which the levels are fitted
FIRST_STEP = 0.2  # of a level, with which a search for the nearest minimum begins
SHIFTS = np.linspace(-0.2, 0.4, 7)  # of a level, from where it begins
SEARCH_ROUNDS = 80  # of a search
LENGTH = {"linear": "m", "rotary": "rad"}
NO_CHANGE: tuple[tuple[Change, ...], str] = ((), "")


def levels_refitted(
    plant: Plant, reported: Karnopp, train: Sequence[MotionLog], seen: Sequence[MotionLog],
    drive: Drive, rig: Rig,
) -> tuple[tuple[Change, ...], str]:  # fmt: skip
    """F_cp and F_cn as they are in the test logs, where these levels alone are another there, and
    what to say of it; reported: the parameters beside which they are reported.

    None where the plant follows the test logs as it does the training logs, the rest of a test log
    is not followed as well once the levels are fitted on its begin, or they are within their error
    of the old ones. Source: Nelder, Mead (1965)
    for the search; the rule is ours: `README.md`, (9).
    """
    usual = _rms(plant, [one.log for one in train if is_long_enough(one.log["y"])], drive)
    tests = [one.log for one in seen if is_long_enough(_begin(one.log)["y"])]
    if not tests:
        return NO_CHANGE
    begins = [_begin(log) for log in tests]
    if not follows_worse(_rms(plant, tests, drive, BEGIN), usual):
        return NO_CHANGE
    moved = _fitted(plant, begins, drive)
    was, now = (_rms(_with(plant, x), tests, drive, BEGIN) for x in (np.zeros(2), moved))
    if not explains_the_change(was, now, usual):
        return NO_CHANGE
    sd = np.abs(_fitted(plant, tests, drive) - moved)  # by what the rest of the logs changes
    half = NORMAL_95 * sd
    if np.all((moved - half) * (moved + half) <= 0.0):
        return NO_CHANGE
    unit = units_of(rig.motion, rig.command_unit)["F_cp"]
    levels = zip(("F_cp", "F_cn"), (reported.F_cp, reported.F_cn), moved, sd, strict=True)
    said = (
        f"with these two levels fitted on the first {BEGIN:.0%} of the test logs, the run follows"
        f" their rest within {now:.3g} {LENGTH[rig.motion]} rms in place of {was:.3g}"
    )
    return tuple(Change(n, unit, x, x + float(d), float(s)) for n, x, d, s in levels), said


def _begin(log: Log) -> Log:
    """The part of a test log on which the levels are fitted."""
    return log.part(0, round(BEGIN * len(log)))


def follows_worse(error: float, usual: float) -> bool:
    """Whether a run is off by more than it usually is."""
    return error > TWICE * usual


def explains_the_change(was: float, now: float, usual: float) -> bool:
    """Whether other levels take most of an error away, down to what is usual. Ours."""
    return now <= EARNS * was and not follows_worse(now, usual)


def _with(plant: Plant, d: Array) -> Plant:
    """The plant with other Coulomb levels, and stick limits as much higher [N]."""
    p = plant.friction
    up, down = (float(x) for x in d)
    friction = replace(
        p, F_cp=max(p.F_cp + up, 0.0), F_cn=max(p.F_cn + down, 0.0),
        F_sp=max(p.F_sp + up, 0.0), F_sn=min(p.F_sn - down, 0.0),
    )  # fmt: skip
    return replace(plant, friction=friction)


def _fitted(plant: Plant, logs: Sequence[Log], drive: Drive) -> Array:
    """Change of the two levels [N] with which whole runs are off least."""
    level = np.array([plant.friction.F_cp, plant.friction.F_cn])
    scale = np.maximum(level, 1e-3 * max(float(np.max(level)), 1e-12))

    def cost(x: Array) -> float:
        return _rms(_with(plant, x * scale), logs, drive)

    start = min(((a, b) for a in SHIFTS for b in SHIFTS), key=lambda x: cost(np.array(x)))
    simplex = np.array(start) + FIRST_STEP * np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    options: Any = {
        "initial_simplex": simplex,
        "maxiter": SEARCH_ROUNDS,
        "xatol": 1e-4,
        "fatol": 0.0,
    }
    return np.asarray(
        minimize(cost, np.array(start), method="Nelder-Mead", options=options).x * scale
    )


def _rms(plant: Plant, logs: Sequence[Log], drive: Drive, after: float = 0.0) -> float:
    """By how much whole runs are off [m], root mean square, after that share of each."""
    off = []
    for log in logs:
        run = free_run(plant, log, measured_start(log), drive)
        error = np.asarray(run.shown) - np.asarray(log["y"])
        off.append(float(np.mean(error[round(after * len(log)) :] ** 2)))
    found = float(np.sqrt(np.mean(off)))
    return found if np.isfinite(found) else np.inf
