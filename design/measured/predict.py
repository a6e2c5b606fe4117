"""Model + log -> prediction: force by the inverse model, force and position by simulation; and the
force that a model lacks."""

from collections.abc import Container, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import minimum_filter1d

from design.machine.model import FAST, Model, used
from identification.arrays import Array, IntArray
from identification.effects._base import Acting
from identification.errors import BadLog, BadModel
from identification.estimation.latent_force import LatentForces, latent_forces
from identification.estimation.recorded_logs import RecordedLogs, plain_share, with_share
from identification.estimation.regression.intersample_command import with_period
from identification.estimation.structure_fit import ABOVE_BAND
from identification.log import Log, Rig
from identification.model.estimates import Drive
from identification.model.inverse_model import SURE_SLIDING, Smoothing
from identification.model.karnopp import VISCOUS_NAMES, Karnopp
from identification.model.plant import Motor, Plant
from identification.model.size import NOT_SHOWN, Size
from identification.model.surroundings import Surroundings
from identification.signals.check import no_force
from identification.signals.clean import applied_force
from identification.signals.differentiate import differentiate
from identification.signals.initial_state import measured_start, measured_states
from identification.simulation.free_run import FreeRun, free_run
from identification.simulation.inverse_dynamics import force_needed, of_body, with_motor_force

RUN_NEEDS = ("m", "F_cp", "F_cn", "F_vp", "F_vn")  # without which no run is the machine's
FASTER_THAN_FITTED = 1.1  # times the speed of a model's logs, above which it is extrapolated
FORCE_WINDOW = 2.0  # s between the fresh starts of a fit that does not follow its logs whole


@dataclass(frozen=True)
class Prediction:
    """Columns of prediction.csv, each (n,); force_simulated is NaN without a command, and of a
    motor, whose applied force is that of its command.

    sliding: True outside the stick band, where the inverse model predicts the force; inside it
    repeats the applied one. steady: of these the samples whose smoothed motion holds no start and
    no stop. drive: what drove the position; the errors are root mean squares [N],
    [m], None where empty. refused: why there is no free run, so that position_simulated is NaN;
    None where there is one. remarks: a line each on what the numbers rest on.
    """

    t: Array
    force_applied: Array
    force_predicted: Array
    force_simulated: Array
    position_measured: Array
    position_simulated: Array
    sliding: NDArray[np.bool_]
    steady: NDArray[np.bool_]
    drive: Drive
    refused: str | None = None
    remarks: tuple[str, ...] = ()

    @property
    def position_rms(self) -> float | None:
        """Root mean square of measured less simulated position; None without a run."""
        if self.refused is not None:
            return None
        return float(np.sqrt(np.mean((self.position_measured - self.position_simulated) ** 2)))

    @property
    def force_predicted_rms(self) -> float | None:
        """Root mean square of applied less predicted force on sliding samples; None without any."""
        return _rms_where((self.force_applied - self.force_predicted)[self.sliding])

    @property
    def force_steady_rms(self) -> float | None:
        """The same without starts and stops, in which a smoothed motion is not the body's."""
        return _rms_where((self.force_applied - self.force_predicted)[self.steady])

    @property
    def force_applied_rms(self) -> float | None:
        """Root mean square of the applied force on the same samples: the error of predicting none;
        None without any."""
        return _rms_where(self.force_applied[self.sliding])

    @property
    def force_simulated_rms(self) -> float | None:
        """Root mean square of applied less simulated force, where both are."""
        return _rms_where(self.force_applied - self.force_simulated)


def predict(
    model: Model, log: Log, *, drive: Drive | None = None, window: float | None = None
) -> Prediction:
    """What the model says of a log on an even clock, effects included; nothing is fitted on it.

    drive: by default the command where the model has an identified actuator and the log a command.
    window [s]: the run starts anew from the measured state after each. The force is predicted also
    where the model cannot be run (`why_no_run`). Raises BadModel, BadLog.
    """
    if window is not None and not window >= 20 * log.h:
        raise BadModel(f"window {window:g} s, at least 20 samples ({20 * log.h:g} s) needed")
    chosen = drive or default_drive(model, log)
    if chosen == "command" and "u" not in log:
        raise BadLog(f"{log.name}: drive by command asked for, but no command u is logged")
    plant = model.simulated
    refuse_missing(log, plant.effects)
    log = of_one_instant(with_motor_force(with_applied_force(log, model.rig), plant), model)
    body = of_body(log, plant)
    restarts = None if window is None else _restarts(body, window)
    how = Smoothing(zoh=model.holds_force)
    blank = np.full(len(log), np.nan)
    applied = log.signals.get("F", blank)
    run, refused = _run(model, log, body, chosen, restarts)
    simulated, other = (run if chosen == "command" else None), None
    if isinstance(plant.actuator, Motor):  # of which the applied force is the command's
        simulated = None
    elif chosen == "force" and model.actuator is not None and "u" in body:
        simulated, other = _run(model, body, body, "command", restarts)
    # The velocity as the inverse model takes it, and where it is significant.
    motion = differentiate(body["y"], body.h, how.cutoff, how.method)
    p, sure = seen_moving(model, body).friction, np.abs(motion.v) > SURE_SLIDING * motion.v_noise
    up, down = (motion.v > p.dv_p) & sure, (motion.v < p.dv_n) & sure
    reach = 2 * max(1, round(1.0 / (motion.cutoff * body.h))) + 1
    return Prediction(
        t=log["t"],
        force_applied=applied,
        force_predicted=force_by_model(model, body, how),
        force_simulated=blank if simulated is None else simulated.F,
        position_measured=log["y"],
        position_simulated=blank if run is None else run.shown,
        sliding=up | down,
        steady=_throughout(up, reach) | _throughout(down, reach),
        drive=chosen,
        refused=refused,
        remarks=(
            *_assumed(model, ran=run is not None),
            *_faster(model, float(np.quantile(np.abs(motion.v), FAST))),
            *([f"force, simulated: {other}"] if other else []),
        ),
    )


def pooled(errors: Iterable[tuple[float | None, int]]) -> float | None:
    """Root mean square over all runs, of that of each and how many samples it has; None of none."""
    known = [(value, n) for value, n in errors if value is not None]
    if not known:
        return None
    with np.errstate(over="ignore"):
        return float(np.sqrt(sum(v * v * n for v, n in known) / sum(n for _, n in known)))


def why_no_run(model: Model, drive: Drive) -> str | None:
    """Why a free run by this drive would say nothing of the machine, None where it would.

    It needs the mass, the friction of sliding, and by command the actuator: identified from the
    logs."""
    needed = {name: model.friction[name] for name in RUN_NEEDS}
    if drive == "command":
        needed |= model.actuator or {}
    unidentified = {name: one for name, one in needed.items() if not one.known}
    if not unidentified:
        return None
    name, first = next(iter(unidentified.items()))
    by = "the command" if drive == "command" else "the force"
    fitted = any(entry.position_rms is not None for entry in model.log)
    own = "; the run of identify is of the fit's own values, which hold for its logs alone"
    return (
        f"no free run: {', '.join(unidentified)} not identified, which a run by {by} needs"
        f" ({name}: {first.reason}){own if fitted else ''}"
    )


def _run(
    model: Model, log: Log, body: Log, drive: Drive, restarts: tuple[IntArray, Array, Array] | None
) -> tuple[FreeRun | None, str | None]:
    """The free run of the log from the measured state of its body, or None and why not."""
    refused = why_no_run(model, drive)
    if refused is not None:
        return None, refused
    try:
        driven, start = as_driven(model, log, drive), measured_start(body)
        run = free_run(model.simulated, driven, start, drive, restarts=restarts)
    except BadModel as error:  # the force is predicted all the same
        return None, f"no free run: {error}"
    return run, None


def _throughout(slides: NDArray[np.bool_], reach: int) -> NDArray[np.bool_]:
    """Samples (n,) about which so many all slide one way, as far as the smoothing reaches."""
    return np.asarray(minimum_filter1d(slides.astype(np.int8), reach) > 0)


def _assumed(model: Model, ran: bool) -> tuple[str, ...]:
    """A line where the numbers rest on values that no log identifies."""
    names = [*model.assumed]
    for key, found in model.effects.items():
        names += [f"{key}.{name}" for name, one in found.items() if not one.known]
    what = "force and run" if ran else "force"
    said = f"{what} by assumed values of what is not identifiable: {', '.join(names)}"
    return (said,) if names else ()


def _faster(model: Model, speed: float) -> tuple[str, ...]:
    """A line where the body moves faster [m/s] than in the logs that the model is fitted on."""
    if model.speed is None or speed <= FASTER_THAN_FITTED * model.speed:
        return ()
    here, there = (f"{model.display.length_text(one)}/s" for one in (speed, model.speed))
    return (
        f"faster than the logs of the model ({here}, they {there}): a fit holds for the speeds that"
        " it has seen",
    )


def default_drive(model: Model, log: Log) -> Drive:
    """The command where the actuator is known and the command logged, else the force."""
    known = model.actuator is not None and all(e.known for e in model.actuator.values())
    return "command" if known and "u" in log else "force"


def as_driven(model: Model, log: Log, drive: Drive) -> Log:
    """The log with what drove the machine between its samples, as the model's logs showed it."""
    if drive == "force":
        return log
    return with_period(log, model.fit.command_period, model.rig.kind == "motor")


def in_windows(model: Model) -> bool:
    """Whether the fit compared its runs with the logs in windows from measured states; of a fit by
    the command its remark says so, or that no run has given the force over a whole log."""
    if model.fit.drive == "force":
        return True
    said = any(f"in windows of {FORCE_WINDOW:g} s" in remark for remark in model.fit.remarks)
    without_force = all(entry.force_rms is None for entry in model.log)
    return said or (without_force and model.rig.kind != "motor")


def fitted_run(model: Model, log: Log, index: int, friction: Karnopp) -> FreeRun | None:
    """The run that the fit compared with one of its logs: from its start, coupled as it was.

    friction: the fit's own, whose stick limits may be others than the model's. None where the
    equation of motion was fitted alone.
    """
    if model.by_equation:
        return None
    drive = model.fit.drive
    restarts = _restarts(log, FORCE_WINDOW) if in_windows(model) else None
    return free_run(
        replace(model.simulated, friction=friction),
        as_driven(model, log, drive),
        model.log[index].start,
        drive,
        stiffness=model.fit.stiffness if drive == "force" else 0.0,
        restarts=restarts,
    )


def _restarts(log: Log, window: float) -> tuple[IntArray, Array, Array]:
    """Samples, positions and velocities of the measured state every `window` [s]."""
    step = max(1, round(window / log.h))
    at = np.arange(step, len(log), step, dtype=np.int64)
    return at, *measured_states(log, at)


def _rms_where(values: Array) -> float | None:
    found = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(found**2))) if found.size else None


def seen_moving(model: Model, log: Log) -> Plant:
    """The plant for a motion that was measured: a stick band that no log identifies is no wider
    than the speed from which the body surely moves, since a body seen to slide is not stuck."""
    plant = model.simulated
    if not {"dv_p", "dv_n"} & set(model.assumed):
        return plant
    sure, p = SURE_SLIDING * differentiate(log["y"], log.h).v_noise, plant.friction
    dv_p = min(p.dv_p, sure) if "dv_p" in model.assumed else p.dv_p
    dv_n = max(p.dv_n, -sure) if "dv_n" in model.assumed else p.dv_n
    return replace(plant, friction=replace(p, dv_p=dv_p, dv_n=dv_n))


def force_by_model(model: Model, log: Log, how: Smoothing) -> Array:
    """Force that the model needs for a motion that was measured [N], (n,)."""
    plant, found = seen_moving(model, log), {k: used(one) for k, one in model.falling.items()}
    at_rest = {name: x for name, x in found.items() if name not in VISCOUS_NAMES}
    plant = replace(plant, friction=replace(plant.friction, **at_rest))
    up, down = (found.get(name, 0.0) for name in VISCOUS_NAMES)
    return force_needed(log, plant, how, (up, down))


def with_applied_force(log: Log, rig: Rig) -> Log:
    """The log with F, by the rig where it is not logged; raises BadLog where that gives none."""
    if "F" in log:
        return log
    force = applied_force(log, rig)
    if force is None:
        raise no_force(log)
    return log.with_signals(F=force)


def of_one_instant(log: Log, model: Model) -> Log:
    """The log with its force at the instants of its position, where its columns are apart and no
    effect of the model says so, and constant between them as the model's logs showed it."""
    zoh = model.holds_force and model.rig.kind != "motor"
    if "input_delay" in model.effects or (model.lag is None and not zoh):
        return log
    drive = model.simulated.actuator
    gives = drive.k_a if isinstance(drive, Motor) else None
    lag = NOT_SHOWN if model.lag is None else Size(used(model.lag))
    return Surroundings(lag=lag, gives=gives, zoh=zoh).of_one_instant(log)


def missing_force(model: Model, logs: Sequence[Log]) -> LatentForces | None:
    """The latent force of a model on logs of its machine; None where no body slides, and where two
    masses swing behind each other, of which the one body of a latent force is none. A slope by
    which friction falls with speed is no viscous friction, so it is among what is missing."""
    if model.resonance is not None:
        return None
    given = [of_one_instant(with_applied_force(log, model.rig), model) for log in logs]
    drive: Drive = "command" if model.rig.kind == "motor" else "force"
    read = RecordedLogs((), model.rig, drive, prescribed=model.prescribed_motion).of(given)
    recorded = with_share(read, plain_share(read))
    plants = [seen_moving(model, log) for log in given]
    plant = max(plants, key=lambda one: one.friction.dv_p - one.friction.dv_n)
    p = plant.friction
    found = latent_forces(plant, recorded.logs, ABOVE_BAND * max(p.dv_p, -p.dv_n))
    return found if any(np.any(one.slides) for one in found.logs) else None


def refuse_missing(log: Log, effects: Iterable[Acting]) -> None:
    """Raises BadLog where an effect would act by signals of which the log has none."""
    for key, missing in lacking_signals(effects, log.signals):
        raise BadLog(
            f"{log.name}: effect {key!r} of the model acts by {missing}, which the log has not;"
            " name its column in the card"
        )


def lacking_signals(effects: Iterable[Acting], there: Container[str]) -> Iterator[tuple[str, str]]:
    """Keys of the effects that cannot act by the signals that there are, and what they lack."""
    for one in effects:
        wanted = one.effect.signals
        missing = [key for key in wanted if key not in there]
        if missing and (set(missing) & set(one.effect.needs) or len(missing) == len(wanted)):
            yield one.key, ", ".join(missing)
