"""Model + log -> prediction: force by the inverse model, force and position by simulation."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.arrays import Array, IntArray
from identification.errors import BadLog, BadModel
from identification.log import Log
from identification.model.estimates import Drive
from identification.model.inverse_model import SURE_SLIDING, Smoothing
from identification.signals.clean import applied_force
from identification.signals.differentiate import differentiate
from identification.signals.initial_state import measured_start
from identification.simulation.free_run import FreeRun, free_run
from workbench.documents.model import Model
from workbench.steps.predicted_force import force_needed, of_body, refuse_missing, with_motor_force

FORCE_WINDOW = 2.0  # s between the fresh starts of a fit driven by force
PREDICTION_COLUMNS = (
    "t",
    "force_applied",
    "force_predicted",
    "force_simulated",
    "position_measured",
    "position_simulated",
)


@dataclass(frozen=True)
class Prediction:
    """Columns of prediction.csv, each (n,); force_simulated is NaN without a command.

    sliding: True outside the stick band, where the inverse model predicts the force; inside it
    repeats the applied one. drive: what drove the position; the errors are root mean squares [N],
    [m], None where empty.
    """

    t: Array
    force_applied: Array
    force_predicted: Array
    force_simulated: Array
    position_measured: Array
    position_simulated: Array
    sliding: NDArray[np.bool_]
    drive: Drive

    @property
    def position_rms(self) -> float:
        """Root mean square of measured less simulated position."""
        return _rms(self.position_measured - self.position_simulated)

    @property
    def force_predicted_rms(self) -> float | None:
        """Root mean square of applied less predicted force on sliding samples; None without any."""
        return _rms_where((self.force_applied - self.force_predicted)[self.sliding])

    @property
    def force_simulated_rms(self) -> float | None:
        """Root mean square of applied less simulated force, where both are."""
        return _rms_where(self.force_applied - self.force_simulated)


def predict(
    model: Model, log: Log, *, drive: Drive | None = None, window: float | None = None
) -> Prediction:
    """What the model says of a log on an even clock, effects included; nothing is fitted on it.

    drive: by default the command where the model has an identified actuator and the log a command.
    window [s]: the run starts anew from the measured state after each. Raises BadModel, BadLog.
    """
    if window is not None and not window >= 20 * log.h:
        raise BadModel(f"window {window:g} s, at least 20 samples ({20 * log.h:g} s) needed")
    chosen = drive or default_drive(model, log)
    if chosen == "command" and "u" not in log:
        raise BadLog(f"{log.name}: drive by command asked for, but no command u is logged")
    plant = model.simulated
    refuse_missing(log, plant.effects)
    log = with_motor_force(_with_force(log, model), plant)
    body = of_body(log, plant)
    restarts = None if window is None else _restarts(body, window)
    how = Smoothing(held=model.rig.kind == "motor")
    blank = np.full(len(log), np.nan)
    applied = log.signals.get("F", blank)
    run = free_run(plant, log, measured_start(body), chosen, restarts=restarts)
    return Prediction(
        t=log["t"],
        force_applied=applied,
        force_predicted=force_needed(body, plant, how),
        force_simulated=run.F if chosen == "command" else _commanded(model, body, restarts, blank),
        position_measured=log["y"],
        position_simulated=run.shown,
        sliding=_sliding(body, model, how),
        drive=chosen,
    )


def _sliding(log: Log, model: Model, how: Smoothing) -> NDArray[np.bool_]:
    """Samples whose velocity, as the inverse model takes it, lies outside the stick band."""
    v, p = differentiate(log["y"], log.h, how.cutoff, how.method).v, model.karnopp
    return np.asarray((v > p.dv_p) | (v < p.dv_n))


def default_drive(model: Model, log: Log) -> Drive:
    """The command where the actuator is known and the command logged, else the force."""
    known = model.actuator is not None and all(e.value is not None for e in model.actuator.values())
    return "command" if known and "u" in log else "force"


def fitted_run(model: Model, log: Log, index: int) -> FreeRun | None:
    """The run that the fit compared with one of its logs: from its start, coupled as it was.

    None where the motion was imposed: then no run was compared.
    """
    if model.imposed:
        return None
    drive = model.fit.drive
    restarts = _restarts(log, FORCE_WINDOW) if drive == "force" else None
    return free_run(
        model.simulated,
        log,
        model.log[index].start,
        drive,
        stiffness=model.fit.stiffness if drive == "force" else 0.0,
        restarts=restarts,
    )


def _with_force(log: Log, model: Model) -> Log:
    """The log with F, from the command where the rig is a motor whose constant the model holds."""
    if "F" in log:
        return log
    force = applied_force(log, model.rig)
    if force is None:
        raise BadLog(
            f"{log.name}: no applied force; give the card F, both pressures, or force_per_command"
        )
    return log.with_signals(F=force)


def _commanded(
    model: Model, log: Log, restarts: tuple[IntArray, Array, Array] | None, blank: Array
) -> Array:
    """Force of the actuator driven by the command, where there are both."""
    if model.actuator is None or "u" not in log:
        return blank
    return free_run(model.simulated, log, measured_start(log), "command", restarts=restarts).F


def _restarts(log: Log, window: float) -> tuple[IntArray, Array, Array]:
    """Samples, positions and velocities of the measured state every `window` [s]."""
    step = max(1, round(window / log.h))
    at = np.arange(step, len(log), step, dtype=np.int64)
    motion = differentiate(log["y"], log.h)
    v = np.where(np.abs(motion.v) > SURE_SLIDING * motion.v_noise, motion.v, 0.0)
    return at, motion.y[at], v[at]


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _rms_where(values: Array) -> float | None:
    found = values[np.isfinite(values)]
    return _rms(found) if found.size else None


def prediction_csv(found: Sequence[Prediction]) -> str:
    """prediction.csv of the runs of one log; a cell is empty where there is no value."""
    import pandas as pd

    frames = [
        pd.DataFrame({name: getattr(one, name) for name in PREDICTION_COLUMNS}) for one in found
    ]
    text: str = pd.concat(frames).to_csv(index=False, float_format="%.10g")
    return text
