"""Which kind of rig a log looks like, where it is taken for another one."""

from collections.abc import Sequence

import numpy as np

from identification.arrays import Array
from identification.errors import UserError
from identification.log import Log, Rig
from identification.velocity.fit import fit
from identification.velocity.model import Valve
from identification.velocity.other_kind import body_squares
from identification.velocity.record import AHEAD, Record, recorded
from identification.velocity.rivals import HeldOut, clearly_better, held_out
from identification.velocity.valve_estimates import units, valve_estimates
from workbench.cards.readable import length
from workbench.documents.model import Model
from workbench.steps.identify import decimated
from workbench.steps.predict import predict

COMPARED_EVERY = 0.01  # s, which is enough to decide a kind by and takes a second or two
MOST_COMPARED = 60_000  # samples, beyond which another kind of rig is not tried


def looks_like_friction(
    record: Record, valve: Valve, test_errors: HeldOut, rig: Rig
) -> tuple[str, ...]:
    """A line where a body that the command accelerates against friction predicts held-out windows
    clearly better than the valve."""
    if sum(len(run.y) for run in record.runs) > MOST_COMPARED:
        return ()
    body = body_squares(record, valve)
    if not clearly_better(body, test_errors.long)[0]:
        return ()
    return (
        'the log looks like kind = "motor": a body that the command accelerates against friction'
        f" predicts 2 s of held-out position within {_rms(body, rig)}, the valve within"
        f" {_rms(test_errors.long, rig)} rms",
    )


def looks_like_velocity(
    logs: Sequence[Log], rig: Rig, model: Model | None = None
) -> tuple[str, ...]:
    """A line where the velocity follows what is taken for the force: a valve's few numbers predict
    2 s of held-out position clearly better than friction does.

    model: with friction, of the same logs; the valve has to be better than it, and than a body of
    seven numbers. Only where the force is the command itself, or nothing else is logged.
    """
    commanded = _commanded(logs, rig)
    if not commanded:
        return ()
    try:
        record = recorded([_slower(log) for log in commanded])
        found = fit(record)
        valve_estimates(record, found, units(rig.motion, "1"))
    except UserError:
        return ()
    test_errors = held_out(record, found.valve, found.free, None)
    friction = [] if model is None else _left_by_friction(model, logs, record)
    if friction and not clearly_better(test_errors.long, friction[0])[0]:
        return ()
    friction.append(body_squares(record, found.valve))  # last, as it takes longest
    if not clearly_better(test_errors.long, friction[-1])[0]:
        return ()
    best = min(friction, key=np.mean)
    return (
        'the log looks like kind = "velocity": the velocity follows the command (dead zone, gain,'
        " delay, lag), which predicts 2 s of held-out position within"
        f" {_rms(test_errors.long, rig)}, friction within {_rms(best, rig)} rms; set it under [rig]"
        " of the card",
    )


def _commanded(logs: Sequence[Log], rig: Rig) -> list[Log]:
    """The logs with the command in `u`; none where the force is another signal than the command."""
    if rig.kind == "motor":
        return list(logs)
    if rig.kind != "force" or any("u" in log or "F" not in log for log in logs):
        return []
    return [log.with_signals(u=log["F"]) for log in logs]


def _every(log: Log) -> int:
    """Every so manieth sample is compared."""
    return max(1, round(COMPARED_EVERY / log.h))


def _slower(log: Log) -> Log:
    """The log at the samples compared, its command the mean until the next one."""
    k = _every(log)
    u, y = decimated(log["u"], log["y"], k)
    return Log(log.name, {"t": log["t"][: len(y) * k : k], "y": y, "u": u})


def _left_by_friction(model: Model, logs: Sequence[Log], record: Record) -> list[Array]:
    """Mean square errors [m²] of the model with friction in the windows of the record, which start
    anew each; none where it cannot be run."""
    try:
        runs = [predict(model, log, window=AHEAD) for log in logs]
    except UserError:
        return []
    errors = tuple(
        (one.position_measured - one.position_simulated)[:: _every(log)]
        for one, log in zip(runs, logs, strict=True)
    )
    rows = [one for part in record.split(errors, AHEAD) for one in part]
    squares = np.array([np.mean((one - one[0]) ** 2) for one in rows])
    return [squares] if np.all(np.isfinite(squares)) else []


def _rms(squares: Array, rig: Rig) -> str:
    return length(float(np.sqrt(np.mean(squares))), rig.motion == "rotary")
