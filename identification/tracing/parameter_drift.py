"""Drift: the parameters that changed between two logs, the fewest that bring the error down."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.stats import norm

from identification.arrays import Array, BoolArray
from identification.estimation.regressed_plant import deviations
from identification.estimation.regression.effect_rows import EffectRows
from identification.estimation.regression.equation_rows import (
    ACTUATOR,
    FIVE,
    MECHANICAL,
    MotionLog,
    column_noise,
)
from identification.estimation.regression.row_fit import RowFit
from identification.estimation.regression.weighted_rows import OVERLAP, Rows, stacked
from identification.estimation.structure_fit import FittedStructure, band
from identification.log import Rig
from identification.model.estimates import NORMAL_95
from identification.model.plant import units_of
from identification.thresholds import BEYOND_CHANCE, CHANCE_LEVEL, COMPLETE, MATERIAL, OF_ACCOUNT
from identification.tracing.model_errors import seen_by
from identification.tracing.regression.stepwise import Step
from identification.tracing.remaining_structure import FEWEST_ROWS
from identification.tracing.result import Change


class ParameterDrift(NamedTuple):
    """Parameters that differ between training and test logs; misfit: mean square that the rows of
    the equations leave on the test logs with these, over that on the training logs or the noise,
    whichever is more: about 1 where nothing else has changed, 0 where too few rows show it."""

    changes: tuple[Change, ...]
    misfit: float


def parameter_drift(
    after: FittedStructure, steps: Sequence[Step], seen: Sequence[MotionLog], rig: Rig
) -> ParameterDrift:
    """Parameters that differ between training and test logs, fewest that bring the error down.

    One that the refined plant has as the test logs do has not changed: the equations, which the
    position's noise biases, differ there from a run that follows. Sources: noise in a column,
    Fuller, Measurement Error Models (1987); the rest is ours: `README.md`, (8).
    """
    stage = seen_by(after.stage, steps, seen)
    units = units_of(rig.motion, rig.command_unit)
    out: list[Change] = []
    misfit = 0.0
    for equation, names in ((MECHANICAL, FIVE), (ACTUATOR, ("k1", "k2"))):
        if equation in after.outcomes:
            mine = after.outcomes[equation]
            rows = stacked(stage.parts[equation])
            # Other motion may be slow where the training was fast: in the band it does not slide.
            slowest = max(mine.slowest, band(after)) if equation == MECHANICAL else mine.slowest
            keep = rows.speed >= slowest
            if np.count_nonzero(keep) >= FEWEST_ROWS:
                blur = _blur(stage, equation, rows, keep)
                # What a loop commands between the samples of slower logs differs with the motion.
                unseen = any(one.noise.between for one in stage.logs)
                slight = OF_ACCOUNT if unseen else MATERIAL
                found = [
                    Change(name, units[name], *change)
                    for name, *change in changes(mine, rows, keep, names, blur, slight)
                ]
                misfit = max(misfit, _misfit(mine, rows, keep, names, found))
                out += [one for one in found if not is_refined(one, after)]
    return ParameterDrift(tuple(out), misfit)


def _misfit(
    mine: RowFit, rows: Rows, keep: BoolArray, names: Sequence[str], changed: Sequence[Change]
) -> float:
    """Mean square that other rows leave with the changed parameters, over that of the fit's own."""
    theta = mine.fit.theta.copy()
    for one in changed:
        theta[names.index(one.name)] = one.after
    left = ((rows.b - rows.X @ theta) / rows.sd)[keep]
    return float(np.mean(left**2)) / _own_misfit(mine)


def _own_misfit(mine: RowFit) -> float:
    """Mean square that a fit leaves of its rows, at least that of the sensors' noise."""
    return max(float(np.mean(mine.fit.residual[mine.rows.speed >= mine.slowest] ** 2)), 1.0)


def is_refined(one: Change, after: FittedStructure) -> bool:
    """Whether the run, which follows the training logs, has the changed value already."""
    if one.name not in FIVE or after.prescribed or after.misfit > COMPLETE:
        return False
    value, half = float(getattr(after.plant.friction, one.name)), NORMAL_95 * one.sd
    return abs(one.after - value) <= max(half, MATERIAL * abs(value))


def with_changes(model: FittedStructure, changed: Sequence[Change]) -> FittedStructure:
    """A model whose body has changed as another one's did: mass and friction by the same share."""
    friction = model.plant.friction
    own = {
        one.name: getattr(friction, one.name) * one.after / one.before
        for one in changed
        if one.name in FIVE and one.before > 0.0
    }
    return replace(model, plant=replace(model.plant, friction=replace(friction, **own)))


def _blur(stage: EffectRows, equation: str, rows: Rows, keep: BoolArray) -> Array:
    """Square sum (k,) that the position's noise makes of each whitened column.

    The plain columns come first; those of effects are taken as they are.
    """
    noise = np.concatenate([column_noise(one, equation) for one in stage.logs])
    plain = np.sum((noise / rows.sd[:, np.newaxis] ** 2)[keep], axis=0)
    return np.pad(plain, (0, rows.X.shape[1] - len(plain)))


def changes(
    mine: RowFit, rows: Rows, keep: BoolArray, names: Sequence[str], blur: Array,
    slight: float = MATERIAL,
) -> list[tuple[str, float, float, float]]:  # fmt: skip
    """Name, value before and after, and deviation of the parameters that have changed.

    One is freed at a time, the one that lowers the error most, as long as it lowers it by a
    material share and significantly: parameters that a short log cannot separate do not all change.
    One that differs by no more than the largest change would by the error of both logs together has
    not.
    blur (k,): square sum that noise makes of each whitened column; slight: share of a parameter by
    which it has not changed. Source: Fuller (1987), moments less those of the noise.
    """
    theta = mine.fit.theta.copy()
    A, b = (rows.X / rows.sd[:, np.newaxis])[keep], (rows.b / rows.sd)[keep]
    r = b - A @ theta
    # What is left of the test logs with every parameter free is noise to a drift too.
    every = b - A @ np.linalg.lstsq(A, b, rcond=1e-10)[0]
    noise = max(_own_misfit(mine), float(np.mean(every**2)))
    gram = A.T @ A - np.diag(blur)
    slope = A.T @ r + blur * theta
    free: list[int] = []
    best, now = theta, float(r @ r)
    while len(free) < len(names):
        options = []
        for i in range(len(names)):
            if i in free:
                continue
            at = [*free, i]
            step = np.linalg.lstsq(gram[np.ix_(at, at)], slope[at], rcond=1e-8)[0]
            if np.any(theta[at] + step < np.minimum(theta[at], 0.0)):
                continue  # none of them is ever negative: something else has changed
            options.append((float(r @ r - step @ slope[at]), i, step))
        if not options:
            break
        left, i, step = min(options, key=lambda x: x[0])
        gained = (now - left) / (noise * OVERLAP)
        if gained < BEYOND_CHANCE**2 or now - left < OF_ACCOUNT * now:
            break
        free.append(i)
        now, best = left, theta.copy()
        best[free] += step
    if not free:
        return []
    inverse = np.linalg.pinv(gram[np.ix_(free, free)])
    sd = np.sqrt(np.diag(inverse) * noise * OVERLAP)
    surely = float(norm.isf(0.5 * CHANCE_LEVEL / len(names)))  # of the largest of so many changes
    half = surely * np.hypot(sd, deviations(mine)[free])
    return [
        (names[i], float(theta[i]), float(best[i]), float(s))
        for i, s, least in zip(free, sd, half, strict=True)
        if abs(best[i] - theta[i]) > max(slight * abs(theta[i]), least)
    ]
