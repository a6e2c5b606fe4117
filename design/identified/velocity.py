"""Logs of a rig whose velocity follows the command -> model, trace and prediction; and where logs
look like those of the other kind of rig."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from design.machine.model import Model
from design.machine.plausible import refuse_other_machine
from design.machine.readable import Display
from design.machine.source import MachineLogs, Source, refuse_twins
from design.machine.velocity import PredictionErrors, VelocityLog, VelocityModel
from design.machine.versions import versions
from design.measured.predict import predict
from identification.arrays import Array
from identification.arx.design_period import decimated
from identification.errors import BadModel, UserError
from identification.log import Log, Rig
from identification.model.estimates import Estimate
from identification.progress import KeepGoing, without_end
from identification.velocity.fit import fit
from identification.velocity.model import Valve
from identification.velocity.other_kind import body_squares
from identification.velocity.record import AHEAD, Record, recorded
from identification.velocity.rivals import (
    STRUCTURES,
    HeldOut,
    Left,
    clearly_better,
    held_out,
    left_by_valve,
)
from identification.velocity.valve_estimates import estimates_beside, units, valve_estimates

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
    return Display.of(rig).length_text(float(np.sqrt(np.mean(squares))))


@dataclass(frozen=True)
class VelocityTraced:
    """What the plain model leaves, the model after it, and the runs of both kinds."""

    left: Left
    model: VelocityModel
    train: tuple[Source, ...]
    test: tuple[Source, ...]
    noise: float


def identify_velocity(logs: MachineLogs, *, keep_going: KeepGoing = without_end) -> VelocityModel:
    """The model of the rig from its runs; raises NotIdentifiable where no gain is identifiable."""
    record = recorded(logs.logs)
    found = fit(record, keep_going=keep_going)
    numbers = valve_estimates(record, found, _units(logs))
    test_errors = held_out(record, found.valve, found.free, None)
    other = looks_like_friction(record, found.valve, test_errors, logs.rig) if keep_going() else ()
    return _model(logs, numbers, test_errors, record.noise, other)


def trace_velocity(
    train: MachineLogs, test: MachineLogs | None, *, keep_going: KeepGoing = without_end
) -> VelocityTraced:
    """Whether structure is left, by test runs or else by stretches left out in turn.

    Raises BadLog where a test log is a training log, NotIdentifiable as `identify_velocity`.
    """
    refuse_twins(train.runs, test.runs if test else ())
    record = recorded(train.logs)
    unseen = recorded(test.logs) if test else None
    if unseen is not None:
        unseen = replace(unseen, u_max=record.u_max)
    left = left_by_valve(record, unseen, keep_going=keep_going)
    numbers = valve_estimates(record, left.fitted, _units(train))
    named = next((one for one in left.rivals if one.key == left.named), None)
    noise = (unseen or record).noise
    model = _model(train, numbers, named.left if named else left.unextended, noise, ())
    if left.named is not None:
        beside = estimates_beside(left.fitted, STRUCTURES[left.named].adds, _units(train))
        model = replace(model, effects={left.named: beside})
    return VelocityTraced(left, model, train.runs, test.runs if test else (), noise)


def _units(logs: MachineLogs) -> Mapping[str, str]:
    return units(logs.rig.motion, logs.rig.command_unit)


def _model(
    logs: MachineLogs, numbers: Mapping[str, Estimate], test_errors: HeldOut, noise: float,
    remarks: Sequence[str],
) -> VelocityModel:  # fmt: skip
    long, short = test_errors.rms
    return VelocityModel(
        card=logs.card,
        rig=logs.rig,
        valve=numbers,
        fit=PredictionErrors(long, short, len(test_errors.long), noise),
        log=tuple(_entry(source) for source in logs.runs),
        remarks=(*remarks, *logs.remarks),
        versions=versions(),
    )


def _entry(source: Source) -> VelocityLog:
    log = source.log
    return VelocityLog(
        file=source.file,
        sha256=source.sha256,
        rows=source.rows,
        duration=log.duration,
        h=log.h,
        travel=(float(np.min(log["y"])), float(np.max(log["y"]))),
        command_peak=float(np.max(np.abs(log["u"]))),
    )


@dataclass(frozen=True)
class VelocityPrediction:
    """Measured and simulated position [m] of a run at its times t [s], each (n,).

    simulated: NaN while commands act that were given before the log.
    """

    t: Array
    measured: Array
    simulated: Array


@dataclass(frozen=True, eq=False)
class VelocityPredicted:
    """The predictions of a log; window [s]: after which each begins anew."""

    runs: tuple[VelocityPrediction, ...]
    window: float | None
    display: Display


def predict_velocity(
    model: VelocityModel, logs: MachineLogs, where: str, window: float | None = None
) -> VelocityPredicted:
    """The position of each run by its command, from where it is measured to be, anew after each
    `window` [s].

    where: what the card is called by. As in the fit it begins where commands act no more that were
    given before the log. Raises BadModel where model and card are of unlike machines.
    """
    refuse_other_machine(model.rig, logs.rig, where, "motion", "command_unit")
    valve, out = model.simulated, []
    record = replace(recorded(logs.logs), u_max=model.command_peak)
    if valve.place:
        record = record.placed(replace(valve, place=0.0), model.travel)
    for run, log, e in zip(record.runs, logs.logs, record.errors(valve), strict=True):
        if window is not None and window < 2.0 * log.h:
            raise BadModel(f"window {window:g} s, at least 2 samples ({2 * log.h:g} s) needed")
        size = len(e) if window is None else round(window / log.h)
        after = np.arange(len(e)) - run.begin
        starts = run.begin + size * (np.maximum(after, 0) // size)
        anchors = e[np.minimum(starts, len(e) - 1)]
        simulated = np.where(after < 0, np.nan, log["y"] - e + anchors)
        out.append(VelocityPrediction(log["t"], log["y"], simulated))
    return VelocityPredicted(tuple(out), window, model.display)
