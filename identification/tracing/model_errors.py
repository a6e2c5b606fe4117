"""Errors of a model on the logs of its fit and on logs that it has not seen."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.arrays import Array
from identification.estimation.regression.effect_rows import EffectRows
from identification.estimation.regression.equation_rows import ACTUATOR, MECHANICAL, MotionLog
from identification.estimation.regression.row_fit import RowFit, rms
from identification.estimation.regression.weighted_rows import stacked
from identification.estimation.structure_fit import FittedStructure
from identification.estimation.windowed_run.run_errors import misfit
from identification.estimation.windowed_run.windows import position_rms
from identification.model.estimates import Drive
from identification.thresholds import ADEQUATE, ASTRAY, CARRIED, ROUGH_LEFT
from identification.tracing.regression.cross_validation import left_out_residual, row_residual
from identification.tracing.regression.stepwise import Step, absorb
from identification.tracing.result import Errors


def errors_of(
    model: FittedStructure, slowest: float, steps: Sequence[Step], logs: Sequence[MotionLog],
    seen: Sequence[MotionLog], drive: Drive,
) -> dict[str, Errors]:  # fmt: skip
    """Errors of a model on the training and the test logs; `slowest` [m/s]: rows that count.

    Without test logs those of stretches left out: cross-validation, Stone (1974).
    """
    own, found = model.stage, model.outcomes
    out = {}
    other = seen_by(own, steps, seen) if seen else own
    for name, stage, over in (("train", own, logs), ("test", other, seen or logs)):
        errors: dict[str, tuple[Array, Array]] = {}
        for equation in (MECHANICAL, ACTUATOR):
            if equation not in found:
                continue
            low = slowest if equation == MECHANICAL else 0.0
            if name == "test" and not seen:
                errors[equation] = left_out_residual(stacked(stage.parts[equation]), low)
            else:
                errors[equation] = row_residual(stage, equation, found[equation].fit.theta, low)
        force = errors[MECHANICAL]
        whole = rms(force[1])
        size = rms(force[0]) if len(force[0]) else None  # nothing slides
        out[name] = Errors(
            force_rms=size,
            force_relative=size / whole if size is not None and whole else None,
            position_rms=None if model.imposed else position_rms(model.plant, over, drive),
            actuator_rms=rms(errors[ACTUATOR][0]) if ACTUATOR in errors else None,
        )
    return out


def carries(before: Mapping[str, Errors], after: Mapping[str, Errors]) -> bool:
    """Whether the test logs are left no more than the training logs, or little of what was missing.

    Several effects together may be confounded with one that the library lacks, on the training
    logs. Ours.
    """
    own, other, missing = (x.force_rms for x in (after["train"], after["test"], before["test"]))
    if own is None or other is None or missing is None:
        return True
    little = ROUGH_LEFT * (missing**2 - own**2)
    return other <= CARRIED * own or other**2 - own**2 <= little


@dataclass(frozen=True)
class NoiseFloor:
    """What the sensors alone leave: of the equation of motion [N] and of the actuator's [N/s], None
    where there is none."""

    force_rms: float
    actuator_rms: float | None


def noise_floor(base: Mapping[str, RowFit]) -> NoiseFloor:
    """What the sensors of these rows' logs alone leave."""
    return NoiseFloor(row_noise(base, MECHANICAL) or 0.0, row_noise(base, ACTUATOR))


@dataclass(frozen=True)
class OnTest:
    """What a model leaves of the test logs: its errors, and the misfit of its free run.

    misfit: None where no run is compared; 1 where noise alone is left.
    """

    errors: Errors
    misfit: float | None


def on_test(
    model: FittedStructure, errors: Errors, logs: Sequence[MotionLog], drive: Drive
) -> OnTest:
    """What a model of these errors leaves of the logs."""
    return OnTest(errors, None if model.imposed else misfit(model.plant, logs, drive))


def share_left(before: OnTest, after: OnTest, noise: NoiseFloor) -> float:
    """Share of what was missing on the test logs that is left, of the first error that stood out.

    Of squares, beyond what noise alone leaves; 0 where nothing stood out of that. An equation that
    lacks much comes first: one stop that a run loses by chance is more than all the rest of it.
    Then the run, by its misfit, which knows how far the noise of force and command drifts. Ours:
    `README.md`, (6).
    """
    by_equations = [_equation_share(before, after, noise, least) for least in (ASTRAY, ADEQUATE)]
    by_run = None
    if before.misfit is not None and after.misfit is not None and before.misfit > ADEQUATE:
        by_run = max(after.misfit - 1.0, 0.0) / (before.misfit - 1.0)
    known = (share for share in (by_equations[0], by_run, by_equations[1]) if share is not None)
    return next(known, 0.0)


def _equation_share(before: OnTest, after: OnTest, noise: NoiseFloor, least: float) -> float | None:
    """As `share_left`, of the first equation of which more than `least` times the noise's square
    was missing; None without one."""
    for name in ("force_rms", "actuator_rms"):
        own, left, floor = (getattr(x, name) for x in (before.errors, after.errors, noise))
        if own is not None and left is not None and floor and (own / floor) ** 2 > least:
            return float(max(left**2 - floor**2, 0.0) / (own**2 - floor**2))
    return None


def predicted(left: OnTest, noise: NoiseFloor) -> bool:
    """Whether a model is complete: what it leaves of the test logs is hardly more than noise."""
    force = left.errors.force_rms
    if force is not None and force**2 > ADEQUATE * noise.force_rms**2:
        return False
    return left.misfit is None or left.misfit <= ADEQUATE


def hardly_predicted(left: OnTest, noise: NoiseFloor) -> bool:
    """Whether a model leaves far more force on the test logs than the sensors do."""
    force = left.errors.force_rms
    return force is not None and force**2 > ASTRAY * noise.force_rms**2


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
