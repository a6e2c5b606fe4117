"""What models leave, row by row or sample by sample, beside the signals on which it may depend."""

from collections.abc import Mapping, Sequence

import numpy as np

from identification.arrays import Array, IntArray
from identification.estimation.latent_force import latent_forces
from identification.estimation.regression.effect_rows import EffectRows
from identification.estimation.regression.equation_rows import (
    ACTUATOR,
    BREAKAWAY,
    MECHANICAL,
    REST,
    MotionLog,
)
from identification.estimation.structure_fit import FittedStructure
from identification.estimation.windowed_run.windows import position_errors
from identification.model.estimates import Drive
from identification.tracing.regression.stepwise import Choice
from identification.tracing.result import MissingForce, Residual

POSITION = "position"  # the residual of the free run
NOT_SIGNALS = frozenset({"d", "a", "smooth", "r", "F_logged"})


def residuals_of(choice: Choice) -> tuple[Residual, ...]:
    """Rows of the equations, before and after a choice."""
    out = []
    for equation in (MECHANICAL, ACTUATOR):
        a, b = choice.first.get(equation), choice.base.get(equation)
        if a is None or b is None or len(a.rows.b) != len(b.rows.b):
            continue
        keep = b.rows.speed >= b.slowest
        t, number = _in_a_row(choice.start.logs, _places(choice.start, equation))
        signals = {k: v[keep] for k, v in signals_at(choice.start, equation).items()}
        before, after = ((o.fit.residual * o.rows.sd)[keep] for o in (a, b))
        out.append(
            Residual(equation, t[keep], number[keep], before, after, b.rows.sd[keep], signals)
        )
    return tuple(out)


def missing_force(
    before: FittedStructure, after: FittedStructure, logs: Sequence[MotionLog], slowest: float
) -> MissingForce | None:
    """The force that either model lacks on these logs, above a speed [m/s]; None where no body
    slides."""
    now = latent_forces(after.plant, logs, slowest)
    was = now
    if after is not before:  # by the one noise of the logs, which the better plant shows
        was = latent_forces(before.plant, logs, slowest, now.rougher)
    at = [
        np.flatnonzero(old.slides & new.slides) for old, new in zip(was.logs, now.logs, strict=True)
    ]
    if not any(map(len, at)):
        return None
    t, number = _in_a_row(logs, at)
    old_force, new_force, sd = (
        np.concatenate([x[own] for x, own in zip(each, at, strict=True)])
        for each in (
            [-one.force for one in was.logs],
            [-one.force for one in now.logs],
            [one.sd for one in now.logs],
        )
    )
    signals = joined(
        [{k: x[own] for k, x in signals_of(one).items()} for one, own in zip(logs, at, strict=True)]
    )
    sliding = Residual(MECHANICAL, t, number, old_force, new_force, sd, signals)
    return MissingForce(was, now, sliding)


def run_residual(
    before: FittedStructure, after: FittedStructure, logs: Sequence[MotionLog], drive: Drive
) -> Residual | None:
    """Error of the shown position in the free run, sample by sample, for the pictures.

    None where a model's inertia is of no account, or its run cannot be followed.
    """
    if before.prescribed or after.prescribed:
        return None
    found: list[list[Array]] = []
    for model in (before,) if after is before else (before, after):
        errors = [position_errors(model.plant, log, drive) for log in logs]
        found.append([e for e in errors if e is not None])
        if len(found[-1]) < len(logs):
            return None
    t, number = _in_a_row(logs, [np.arange(len(one.log)) for one in logs])
    noise = np.repeat([one.noise.y for one in logs], [len(one.log) for one in logs])
    was, now = (np.concatenate(found[i]) for i in (0, -1))
    return Residual(POSITION, t, number, was, now, noise, {})


def _in_a_row(logs: Sequence[MotionLog], at: Sequence[IntArray]) -> tuple[Array, Array]:
    """Time [s] and number of the log, (r,), at these samples of logs that follow each other."""
    ends = np.cumsum([0.0, *(one.log.duration for one in logs)])
    t = [
        end + one.log["t"][own] - one.log["t"][0]
        for one, own, end in zip(logs, at, ends[:-1], strict=True)
    ]
    return np.concatenate(t), np.repeat(np.arange(float(len(logs))), [len(own) for own in at])


def signals_of(one: MotionLog) -> dict[str, Array]:
    """Signals of a log on which a residual may depend, (n,) each: those logged, velocity, command,
    time since the log's start and since the last reversal [s]."""
    s = one.signals
    own = {k: v for k, v in s.items() if k not in NOT_SIGNALS}
    return {**own, "t": s["t"] - s["t"][0], "reversal": since_reversal(s["d"], one.log.h)}


def signals_at(stage: EffectRows, equation: str) -> dict[str, Array]:
    """Signals that vary, at the middle of an equation's rows over all logs."""
    each = []
    for i, (one, middle) in enumerate(zip(stage.logs, _places(stage, equation), strict=True)):
        own = {k: v[middle] for k, v in signals_of(one).items()}
        rows = {MECHANICAL: one.sliding if one.zoh else None, ACTUATOR: one.whole}.get(equation)
        if rows is not None:
            own["du"] = rows.first @ one.signals["u"]
        if equation == BREAKAWAY:
            own["rest"] = stage.events[i].rested
        each.append(own)
    return joined(each)


def joined(each: Sequence[Mapping[str, Array]]) -> dict[str, Array]:
    """Signals of logs (k) in a row, of those that all of them have, where they vary."""
    names = [name for name in each[0] if all(name in one for one in each)]
    found = {name: np.concatenate([one[name] for one in each]) for name in names}
    return {name: x for name, x in found.items() if len(x) and np.ptp(x) > 0}


def _places(stage: EffectRows, equation: str) -> list[IntArray]:
    """Samples of each log at which the rows of an equation lie."""
    if equation == BREAKAWAY:
        return [events.at for events in stage.events]
    if equation == REST:
        return [rest.start for rest in stage.at_rest]
    rows = [one.sliding if equation == MECHANICAL else one.whole for one in stage.logs]
    return [one.middle for one in rows if one is not None]


def since_reversal(d: Array, h: float) -> Array:
    """Time since the direction last changed or the body stood still [s], (n,)."""
    n = len(d)
    changed = np.concatenate([[True], d[1:] != d[:-1]])
    at = np.maximum.accumulate(np.where(changed, np.arange(n), 0))
    return np.asarray((np.arange(n) - at) * h, dtype=np.float64)
