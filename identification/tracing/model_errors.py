"""Errors of a model on the logs of its fit and on logs that it has not seen."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.arrays import Array
from identification.estimation.regression.effect_rows import EffectRows
from identification.estimation.regression.equation_rows import (
    ACTUATOR,
    MECHANICAL,
    MotionLog,
)
from identification.estimation.regression.row_fit import RowFit, rms
from identification.estimation.regression.weighted_rows import left_unseen, stacked
from identification.estimation.structure_fit import FittedStructure
from identification.estimation.windowed_run.run_errors import misfit
from identification.estimation.windowed_run.windows import position_rms
from identification.model.estimates import Drive
from identification.thresholds import ADEQUATE, AS_GOOD_AS_NONE, ASTRAY, COMPLETE, MATERIAL
from identification.tracing.regression.stepwise import Step, absorb
from identification.tracing.result import Errors


def errors_of(
    model: FittedStructure, slowest: float, steps: Sequence[Step], logs: Sequence[MotionLog],
    seen: Sequence[MotionLog], drive: Drive,
) -> dict[str, Errors]:  # fmt: skip
    """Errors of a model on the training and the test logs; `slowest` [m/s]: rows that count.

    Without test logs those of stretches left out: cross-validation, Stone (1974).
    """
    out = {}
    for name, over in (("train", logs), ("test", seen)):
        stage = seen_by(model.stage, steps, over) if name == "test" and over else model.stage
        left, size = dict[str, Array](), 0.0
        for equation in (MECHANICAL, ACTUATOR):
            if equation not in model.outcomes:
                continue
            rows = stacked(stage.parts[equation])
            if equation == MECHANICAL:
                rows = rows.at(rows.speed >= slowest)
                size = rms(rows.b)
            theta = model.outcomes[equation].fit.theta
            left[equation] = rows.b - rows.X @ theta if over else left_unseen(rows)
        force = rms(left[MECHANICAL]) if len(left[MECHANICAL]) else None  # nothing slides
        out[name] = Errors(
            force_rms=force,
            force_relative=force / size if force is not None and size else None,
            position_rms=None
            if model.prescribed
            else position_rms(model.plant, over or logs, drive),
            actuator_rms=rms(left[ACTUATOR]) if ACTUATOR in left else None,
        )
    return out


@dataclass(frozen=True)
class OnTest:
    """What a model leaves of the test logs: its errors, and the misfit of its free run.

    misfit: None where no run is compared; 1 where noise alone is left.
    """

    errors: Errors
    misfit: float | None


def on_test(
    model: FittedStructure, errors: Errors, logs: Sequence[MotionLog], drive: Drive,
    beside: FittedStructure | None = None,
) -> OnTest:  # fmt: skip
    """What a model of these errors leaves of the logs; beside: another with which it is compared,
    whose weights of the run's errors it has."""
    if model.prescribed:
        return OnTest(errors, None)
    weighed_by = None if beside is None or beside.prescribed else beside.plant
    return OnTest(errors, misfit(model.plant, logs, drive, weighed_by=weighed_by))


def share_left(before: OnTest, after: OnTest, noise: Errors, by_run: bool = False) -> float:
    """Share of what was missing on the test logs that is left, of the actuator's equation or of the
    run.

    Of squares, beyond what noise alone leaves; 0 where nothing stood out of that, but 1 where a run
    is what the effects were found by: one that drifts more hides what was missing. An equation that
    lacks much comes first: one stop that a run loses by chance is more than all the rest of it.
    Then the run, by its misfit, which knows how far the noise of force and command drifts. Ours:
    `README.md`, (6).
    """
    known: list[float | None] = [None, None, None]
    if before.misfit is not None and after.misfit is not None:
        known[1] = _beyond_noise(before.misfit, after.misfit, ADEQUATE)
    own, left, floor = (x.actuator_rms for x in (before.errors, after.errors, noise))
    if own is not None and left is not None and floor:
        was, now = (own / floor) ** 2, (left / floor) ** 2
        known[0], known[2] = (_beyond_noise(was, now, least) for least in (ASTRAY, ADEQUATE))
    return next((share for share in known if share is not None), 1.0 if by_run else 0.0)


def _beyond_noise(before: float, after: float, least: float) -> float | None:
    """Share of a mean square beyond noise (1) that is left; None where no more than `least` was."""
    return max(after - 1.0, 0.0) / (before - 1.0) if before > least else None


def predicted(left: OnTest, noise: Errors) -> bool:
    """Whether a model is complete: what it leaves of the test logs is hardly more than noise."""
    force, floor = left.errors.force_rms, noise.force_rms or 0.0
    if force is not None and force**2 > ADEQUATE * floor**2:
        return False
    return left.misfit is None or left.misfit <= ADEQUATE


def lacks(model: FittedStructure, errors: Errors, noise: Errors) -> bool:
    """Whether a model lacks something of account on the logs of its fit, with these errors there.

    A free run that leaves far more than noise, and more than a negligible part of the motion; or
    force far beyond noise, of a prescribed motion beyond noise, and more than a negligible part of
    the Coulomb level.
    """
    force, floor, p = errors.force_rms, noise.force_rms or 0.0, model.plant.friction
    least = ADEQUATE if model.prescribed else ASTRAY
    beyond = 0.0 if force is None else force**2 - floor**2
    by_force = (
        force is not None
        and force**2 > least * floor**2
        and beyond > (MATERIAL * max(p.F_cp, p.F_cn)) ** 2
    )
    if model.prescribed:
        return by_force
    by_run = model.misfit > ASTRAY and off(model) > AS_GOOD_AS_NONE
    return by_run or (by_force and model.misfit > COMPLETE)


def off(model: FittedStructure) -> float:
    """Position error of a model's free run on the logs of its fit, over the spread of the
    position."""
    drive: Drive = "force" if model.plant.actuator is None else "command"
    logs = model.stage.logs
    error = position_rms(model.plant, logs, drive)
    spread = rms(np.concatenate([one.log["y"] - np.mean(one.log["y"]) for one in logs]))
    return np.inf if error is None else error / max(spread, 1e-300)


def seen_by(stage: EffectRows, steps: Sequence[Step], logs: Sequence[MotionLog]) -> EffectRows:
    """The stage of other logs with the same structure and effects taken out of their signals."""
    own = replace(stage, logs=tuple(logs), chosen=(), taken=(), scales={})
    for step in steps:
        if step.candidate.effect.place.on_signals:
            own = absorb(own, step.candidate)
    return replace(own, chosen=stage.chosen)


def row_noise(base: Mapping[str, RowFit], equation: str) -> float | None:
    """What the sensors alone leave in an equation's rows (one sigma, root mean square)."""
    return float(np.sqrt(np.mean(base[equation].rows.sd ** 2))) if equation in base else None
