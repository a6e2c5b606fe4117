"""What a model of ours leaves of a held-out log, in the measure of the yardstick.

The model says which signal (measured force, or command) the motion needs: inertia in the
yardstick's weak form, all else by the model's own inverse equation, and back through what it has
between command and force. A prediction never sees the force that it is to predict: friction by
load is solved for, a body that the model holds stuck needs no force, and inside a dead zone no
command. So a model whose own force vanishes leaves all of the signal.
"""

from collections.abc import Sequence

import numpy as np

from benchmarks.yardstick import Fit, Record, Sliding, ratio, share_left, shifted, weighed
from design.machine.model import Model, used
from design.measured.predict import force_by_model, predict, refuse_missing
from identification.arrays import Array
from identification.effects._base import Acting
from identification.errors import UserError
from identification.log import Log, Rig
from identification.model.inverse_model import Smoothing
from identification.signals.differentiate import differentiate
from identification.simulation.effect_run import effective_commands
from identification.simulation.effect_table import effect_table, signal_table
from identification.simulation.inverse_dynamics import of_body

MOST = 1e6  # times the signal, beyond which a prediction runs away
STEEPEST = 20.0  # command per command that a dead zone asks for
REACH, POINTS = 3.0, 4001  # of the grid of commands, in largest commands
FEWEST = 20  # samples of a window


def log_of(record: Record, rig: Rig, name: str) -> Log:
    """A record as the packages have logs."""
    key = "u" if rig.kind == "motor" else "F"
    signals = {**record.others, "t": record.t, "y": record.y, key: record.signal}
    if key == "u":
        signals["F"] = record.signal * (rig.force_per_command or 1.0)
    return Log(name, signals)


def model_share(
    model: Model, records: Sequence[Record], fit: Fit, read: Sequence[Sequence[Log]] = ()
) -> float | None:
    """Share of the signal that the model leaves on the records, at the rows of the yardstick.

    read: the runs of each as the workbench reads them, whose motion the model goes by where there
    is one run: without samples in which a slow sensor is held.
    """
    plant = model.simulated
    rig = model.rig
    late = [a.values["tau"] for a in plant.effects if a.effect.place.delays]
    lag = sum(late) if late or model.lag is None else used(model.lag)
    if model.holds_force:
        period = model.fit.command_period  # for which a command is held
        lag += 0.5 * (records[0].h if period is None else period)
    whole = [runs[0] if len(runs) == 1 else None for runs in read] or [None] * len(records)
    needs = [_needs(model, one, log) for one, log in zip(records, whole, strict=True)]
    commands = tuple(
        a for a in plant.effects if a.effect.place.on_command and not a.effect.place.delays
    )
    k = rig.force_per_command or 1.0 if rig.kind == "motor" else 1.0
    if not commands:
        parts = [(force / k, plant.friction.m / k) for force in needs]
        return share_left(records, fit.width, lag, parts)
    measured, predicted = list[Array](), list[Array]()
    for record, force in zip(records, needs, strict=True):
        move = Sliding.of(record, fit.width)
        reached = (weighed(force, move.bump.mean) + plant.friction.m * move.a) / k
        measured.append(weighed(shifted(record, lag), move.bump.mean)[move.keep])
        predicted.append(command_for(reached, record.signal, commands)[move.keep])
    return ratio(np.concatenate(measured), np.concatenate(predicted))


def _needs(model: Model, record: Record, read: Log | None) -> Array:
    """Force that the motion needs but for the inertia [N], (n,), by the model alone."""
    plant = model.simulated
    log = log_of(record, model.rig, "held out") if read is None else read
    refuse_missing(log, plant.effects)
    body = of_body(log, plant)
    how, most = Smoothing(), MOST * float(np.max(np.abs(log["F"])))
    a = differentiate(body["y"], body.h).a
    force = force_by_model(model, body.with_signals(F=np.zeros(len(log))), how)
    force = np.clip(np.nan_to_num(force, nan=most), -most, most)
    t = record.t if read is None else record.t - record.t[0] + log["t"][0]
    return np.interp(t, log["t"], force - plant.friction.m * a)


def command_for(reached: Array, u: Array, acting: tuple[Acting, ...]) -> Array:
    """The logged command for the one that reaches the motor, by the effects between them.

    Where commands do nothing the smallest is taken, within a slope of STEEPEST.
    """
    most = REACH * max(float(np.max(np.abs(u))), float(np.max(np.abs(reached))))
    grid = np.linspace(-most, most, POINTS)
    t = np.arange(POINTS, dtype=np.float64)
    table = effect_table(acting)
    signals = signal_table(acting, Log("grid", {"t": t, "u": grid, "y": 0 * t, "F": 0 * t}))
    z = np.zeros(len(acting))
    made = effective_commands(table.codes, table.addresses, table.p, signals, z, t, grid, 1.0)
    slope = np.maximum(np.gradient(made, grid), 1.0 / STEEPEST)
    rising = np.concatenate([[0.0], np.cumsum(0.5 * (slope[1:] + slope[:-1]) * np.diff(grid))])
    rising -= np.interp(0.0, grid, rising)
    return np.asarray(np.interp(reached, rising, grid))


def model_run(model: Model, records: Sequence[Record], window: float) -> float | None:
    """Position error (rms) of the model's runs begun anew every `window` [s]; None without runs."""
    squares, count = 0.0, 0
    for record in records:
        log = log_of(record, model.rig, "held out")
        try:
            found = predict(model, log, window=max(window, (FEWEST + 0.01) * log.h))
        except UserError:
            return None
        if found.refused is not None:
            return None
        error = found.position_measured - found.position_simulated
        squares, count = squares + float(np.sum(error**2)), count + len(error)
    rms = float(np.sqrt(squares / count)) if count else float("nan")
    return rms if np.isfinite(rms) else None


def window_of(record: Record, seconds: float) -> float:
    """The window [s], of FEWEST samples at least."""
    return max(seconds, (FEWEST + 0.01) * record.h)
