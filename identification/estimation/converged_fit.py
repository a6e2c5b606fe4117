"""The last step of a fit: from a plant that follows the logs to values, intervals and reasons.

Where whole runs by the command are followed down to the sensors' noise, nothing is more
informative: the windows are then as long as the log. Everywhere else (more than noise is left, it
is driven by a measured force or a noisy command) windows from measured states decide, and by how
much one window differs from the next.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from identification.arrays import Array
from identification.estimation.estimates import (
    Events,
    effect_estimates,
    estimates,
    events_of,
    reported_estimate,
)
from identification.estimation.recorded_logs import RecordedLogs
from identification.estimation.regression.breakaway import risen_to, usual_limits
from identification.estimation.regression.equation_rows import MotionLog
from identification.estimation.windowed_run.parameters import even, names_of, values_of
from identification.estimation.windowed_run.refinement import (
    Effort,
    Refit,
    counts,
    refit,
)
from identification.estimation.windowed_run.run_errors import CANNOT_BE_FOLLOWED
from identification.estimation.windowed_run.stick_search import stick_ranges
from identification.estimation.windowed_run.windows import (
    RUN_WINDOW,
    left_in_windows,
    longest_window,
    starts,
    window_run,
)
from identification.log import Log
from identification.model.estimates import NORMAL_95, Drive, Estimate, KarnoppFit, LogFit
from identification.model.karnopp import NAMES
from identification.model.plant import Plant
from identification.model.size import Size
from identification.progress import Progress
from identification.remarks import MinorRemark
from identification.signals.initial_state import measured_start
from identification.thresholds import ADEQUATE

# Relative deviations that the force between its samples adds where it drives the run (where it
# corrects one, so much less as its gain squared), by name;
# from the errors seen on simulated logs without a command (benchmarks/nine_parameters.py).
BETWEEN = dict(zip(NAMES, (1e-3, 1e-3, 1e-3, 5e-4, 5e-4, 1e-2, 1e-2, 3e-3, 3e-3), strict=True))
# Of these, what a motor has, whose stops come and go with the steps of its command: from clean ones
# behind encoders (benchmarks/encoders.py).
OF_STEPS = 0.1

# What stops that come and go, in steps of the likelihood, add to deviations over whole runs; for
# the coverage on seeds 5000 to 5004 of benchmarks/nine_parameters.py.
WALLS = 1.2
# Deviations of a stick limit under a zero-order-hold force: between two of its steps, of a step,
# uniform; and of a measured one's noise, which begins a motion too early (seeds 1 to 6, 34 to 36 of
# benchmarks/encoders.py, 8000 and 65536 counts).
OF_A_STEP, OF_NOISE = 12.0**-0.5, 2.0

NO_REST_WHY = (
    "{}: no rest that ends is seen in it, and the force may change between its samples; log starts"
    " from rest, at the rate of the drive's loop"
)
STOP_TURNS_ON_LESS = "a stop turns on less than the noise there"


def converged_fit(
    plant: Plant, recorded: RecordedLogs, misfit: float, report: Progress, *,
    refined: Refit | None = None, quick: bool = False,
) -> KarnoppFit:  # fmt: skip
    """The fit of a plant that a search or refinement has come to, near its minimum.

    misfit: what it leaves in windows; refined: the refinement that it comes from, if it is one;
    quick: not over whole runs. Sources: windows, Bock (1983); minimum, Levenberg (1944), Marquardt
    (1963); covariance, Liang, Zeger (1986).
    """
    report("weighing", 0.0)
    near = refined
    if near is None:
        effort: Effort = "near" if quick else "long"
        near = refit(plant, recorded.logs, recorded.drive, prior=even(plant), effort=effort)
    if near.whole or near.misfit <= misfit:
        plant = near.plant
    seconds = longest_window(plant, recorded.logs, recorded.drive) if near.whole else RUN_WINDOW
    values, left = values_of(plant, near.names), min(near.misfit, misfit)
    adequate, events = is_adequate(left), _events(plant, recorded, seconds)
    covariance = _covariance(near, recorded, values, events)
    logs = tuple(_log_fit(plant, one, recorded.drive, seconds, near.whole) for one in recorded.logs)
    remarks = _remarks(adequate, near, logs, recorded)
    if near.whole:
        covariance = covariance * WALLS**2
    sd = dict(zip(near.names, np.sqrt(np.diag(covariance)).tolist(), strict=True))
    own = {n: x for n, x in zip(near.names, values.tolist(), strict=True) if "." not in n}
    found = estimates(own, sd, events, recorded.rig, recorded.name)
    found |= _of_both(found, plant, recorded, followed=adequate)
    return KarnoppFit(
        friction=plant.friction,
        actuator=plant.actuator,
        effects=plant.effects,
        estimates={**found, **effect_estimates(plant.effects, sd)},
        free=near.names,
        covariance=covariance,
        drive=recorded.drive,
        noise_y=recorded.noise[0],
        noise_F=recorded.noise[1],
        chi_square=left,
        adequate=adequate,
        logs=logs,
        breakaways=events.breakaways,
        remarks=tuple(remarks),
        command_period=recorded.command_period,
        whole=near.whole,
    )


def _remarks(
    adequate: bool, near: Refit, logs: Sequence[LogFit], recorded: RecordedLogs
) -> list[str]:
    if not adequate:  # the summary of a model says it too
        factor, unit = (1.0, "rad") if recorded.rig.motion == "rotary" else (1e3, "mm")
        off = factor * max(one.position_rms for one in logs)
        out: list[str] = [
            MinorRemark(
                f"the run has an error of {off:.3g} {unit} rms in position (sensor's noise"
                f" {factor * recorded.noise[0]:.2g} {unit}): an effect is missing, or the"
                " structure is wrong; run 'workbench trace' to find it; intervals are widened for"
                " it"
            )
        ]
    else:
        windowed = recorded.drive == "command" and not near.whole
        out = [_why_windows(recorded)] if windowed else []
    if recorded.drive == "force":
        out.append(
            MinorRemark("driven by the measured force, in windows of 2 s from measured states")
        )
    return out


def _why_windows(recorded: RecordedLogs) -> str:
    """What to say of a fit that follows its logs in windows."""
    walk = max(one.noise.random_walk for one in recorded.logs)
    if walk == 0.0:
        return MinorRemark(
            "the model follows the logs in windows of 2 s from measured states, but not the whole:"
            f" {STOP_TURNS_ON_LESS}"
        )
    return MinorRemark(
        "the logged command has noise of its own: integrated, it takes the force"
        f" {walk / np.sqrt(recorded.logs[0].log.h):.2g} N away in 1 s (one sigma); the model's"
        " force is corrected by the measured one for it, in windows of 2 s"
    )


def is_adequate(left: float) -> bool:
    """Whether a fit of which this mean square is left, in units of the noise, will do."""
    return left <= ADEQUATE


def _covariance(near: Refit, recorded: RecordedLogs, values: Array, events: Events) -> Array:
    """Covariance (d, d) of the free parameters."""
    covariance = near.covariance.copy()
    # What changes nothing in the run is not known, rather than known exactly.
    unknown = ~(np.diag(covariance) > 0.0)
    covariance[unknown, unknown] = (
        _as_large_as_can_be(near.plant, near.names, values, events)[unknown] ** 2
    )
    if recorded.zoh and is_adequate(near.misfit):
        covariance = _with_stick_ranges(covariance, near, recorded)
    covariance = covariance + np.diag(between_samples_sd(near.names, values, recorded) ** 2)
    if not np.all(np.isfinite(covariance)):
        covariance = np.diag(np.abs(values) ** 2)
    return np.asarray(covariance)


def _with_stick_ranges(covariance: Array, near: Refit, recorded: RecordedLogs) -> Array:
    """The covariance with the deviations of stick limits that a zero-order-hold force allows (d,
    d): where a band is identified the run within it is informative of its limit beside the
    steps."""
    independent = len(set(counts(recorded.logs, recorded.drive).tolist()))
    ranges = stick_ranges(near.plant, recorded.logs, recorded.drive, RUN_WINDOW, independent)
    step = OF_A_STEP * usual_limits(recorded.logs, near.plant)[1]
    noisy = not recorded.by_motor or recorded.may_change_between
    noise = OF_NOISE * recorded.noise[1] if noisy else 0.0
    own, values = np.sqrt(np.diag(covariance)), values_of(near.plant, near.names)
    known = {
        name
        for name, value, sd in zip(near.names, values.tolist(), own.tolist(), strict=True)
        if reported_estimate(value, "", sd).value is not None
    }
    factor = np.ones(len(near.names))
    for i, name in enumerate(near.names):
        if name in ranges:
            low, high = ranges[name]
            by_range = 0.5 * (high - low) / NORMAL_95
            by_step = 0.0 if name.replace("F_s", "dv_") in known else step
            factor[i] = float(np.linalg.norm([by_range, by_step, noise])) / own[i]
    return covariance * np.outer(factor, factor)


def between_samples_sd(
    names: Sequence[str], values: Array, recorded: RecordedLogs, *, of: float | None = None
) -> Array:
    """Deviations (d,) of values that the force between its samples adds, as far as it drives: of
    that part, by default as a run is driven."""
    gain = max(one.noise.corrected for one in recorded.logs)
    least = OF_STEPS if recorded.zoh else gain**2
    drives = recorded.drive == "force" and not recorded.zoh
    part = of if of is not None else 1.0 if drives else least
    return np.asarray(part * np.array([BETWEEN.get(name, 0.0) for name in names]) * np.abs(values))


def _as_large_as_can_be(plant: Plant, names: Sequence[str], values: Array, events: Events) -> Array:
    """Deviations (d,) of parameters of which the logs say nothing: as large as they could be."""
    p = plant.friction
    force = max(p.F_cp, p.F_cn, p.F_sp, -p.F_sn)
    speed = max(*events.fastest, p.dv_p, -p.dv_n)
    largest = {"dv_p": speed, "dv_n": speed, "F_vp": force / speed, "F_vn": force / speed}
    largest |= dict.fromkeys(("F_cp", "F_cn", "F_sp", "F_sn"), force)
    return np.maximum(np.abs(values), [largest.get(name, 0.0) for name in names])


def _log_fit(plant: Plant, one: MotionLog, drive: Drive, seconds: float, whole: bool) -> LogFit:
    """What runs leave of a log: of its force too where it is followed whole."""
    r = left_in_windows(plant, one, drive, seconds, even=True)
    y, *F = [CANNOT_BE_FOLLOWED] if r is None else np.sqrt(np.mean(r**2, axis=1)).tolist()
    return LogFit(
        log=one.log.name,
        start=measured_start(one.log),
        position_rms=y * one.noise.y,
        force_rms=F[0] * one.noise.F if F and whole else None,
        chi_square=y**2,
    )


def structure_estimates(
    plant: Plant, sd: Mapping[str, float], recorded: RecordedLogs
) -> dict[str, Estimate]:
    """The nine and the actuator's of a plant that has been refined already; sd: by name.

    The same rules as of a fit decide which of them are identifiable.
    """
    names = [name for name in names_of(plant, recorded.drive) if "." not in name]
    values, events = values_of(plant, names), _events(plant, recorded, RUN_WINDOW)
    most = _as_large_as_can_be(plant, names, values, events)
    known = dict(zip(names, values.tolist(), strict=True))
    own = {n: sd.get(n, 0.0) or x for n, x in zip(names, most.tolist(), strict=True)}
    found = estimates(known, own, events, recorded.rig, recorded.name)
    return found | _of_both(found, plant, recorded)


def _of_both(
    found: Mapping[str, Estimate], plant: Plant, recorded: RecordedLogs, *, followed: bool = False
) -> dict[str, Estimate]:
    """The stick limits of a motor whose force changes between its samples, each midway between the
    run's and the force at its breakaways: the one errs to below and the other to above, and the
    interval holds both; those under a zero-order-hold force likewise, where most breakaways by
    themselves say another. followed: the logs are to the noise, so that where the run shows no
    limit the Coulomb level replaces it. Ours."""
    if not recorded.zoh:
        return {}
    changes, out = recorded.may_change_between, dict[str, Estimate]()
    if changes:
        risen = risen_to(recorded.logs, plant)
    else:
        usual = usual_limits(recorded.logs, plant)[0]
        risen = {name: size for name, size in usual.items() if _differ(found[name], size)}
    for name, level, way in (("F_sp", "F_cp", 1.0), ("F_sn", "F_cn", -1.0)):
        one, coulomb = found.get(name), found.get(level)
        if one is None:
            continue
        if name not in risen:
            if one.value is not None and changes:
                out[name] = one.withheld(NO_REST_WHY.format(recorded.name), one.value)
            continue
        run = one if one.low is not None or not followed else coulomb
        if run is None or run.low is None or run.high is None:
            continue
        least = 0.0 if coulomb is None or coulomb.low is None else coulomb.low
        other, spread = way * risen[name].value, NORMAL_95 * risen[name].sd
        if run is coulomb and other + spread <= run.high:
            continue  # no more is shown than that it is no less than sliding friction
        sizes = (abs(run.low), abs(run.high), other - spread, other + spread)
        low, high = max(min(sizes), least), max(*sizes, least)
        middle, sd = 0.5 * (low + high), 0.5 * (high - low) / NORMAL_95
        ends = (low, high) if way > 0.0 else (-high, -low)
        out[name] = reported_estimate(way * middle, one.unit, sd, interval=ends)
    return out


def _differ(one: Estimate, other: Size) -> bool:
    """Whether the 95 % intervals of an estimate and of a size are apart."""
    spread = NORMAL_95 * other.sd
    low, high = other.value - spread, other.value + spread
    return one.low is not None and one.high is not None and (one.high < low or high < one.low)


def force_of(logs: Sequence[Log]) -> float:
    """Spread of the applied force [N] over all logs."""
    return float(np.std(np.concatenate([np.asarray(log["F"]) for log in logs])))


def _events(plant: Plant, recorded: RecordedLogs, seconds: float) -> Events:
    """What happens in the plant's run in windows of so many seconds."""
    runs = [window_run(plant, one, recorded.drive, starts(one, recorded.drive, seconds))
            for one in recorded.logs]  # fmt: skip
    followed = [run for run in runs if run is not None]
    modes, speeds = [run.mode for run in followed], [run.v for run in followed]
    return replace(events_of(modes, speeds, force_of(recorded.plain)), moved=recorded.moved)
