"""The last step of a fit: from a plant that follows the logs to values, intervals and reasons.

Where a plain plant follows whole runs by the command down to the sensors' noise, nothing is more
informative: their likelihood decides. Everywhere else (more than noise is left, it
is driven by a measured force or a noisy command, or has effects) runs in windows from measured
states decide, and by how much one window differs from the next.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from identification.arrays import Array
from identification.estimation.estimates import (
    NORMAL_SETS,
    Events,
    effect_estimates,
    estimates,
    events_of,
    normal_samples,
)
from identification.estimation.plain_search.likely_sets import (
    Solution,
    weigh_noise,
)
from identification.estimation.plain_search.local_search import Optimum, refine
from identification.estimation.plain_search.problem import (
    Problem,
    plant_of,
    pose,
    simulated,
    start_of,
)
from identification.estimation.plain_search.search import opened, searched_plant
from identification.estimation.recorded_logs import RecordedLogs
from identification.estimation.residual_drift import drift_size, widened
from identification.estimation.windowed_run.parameters import even, names_of, values_of
from identification.estimation.windowed_run.refinement import Refit, refit
from identification.estimation.windowed_run.run_errors import CANNOT_BE_FOLLOWED
from identification.estimation.windowed_run.windows import (
    position_errors,
    starts,
    walks,
    window_run,
)
from identification.log import Log
from identification.model.estimates import Estimate, KarnoppFit, LogFit
from identification.model.karnopp import NAMES
from identification.model.plant import Actuator, Plant, units_of
from identification.progress import Progress
from identification.remarks import MinorRemark
from identification.signals.initial_state import measured_start
from identification.simulation.free_run import FreeRun
from identification.simulation.karnopp_step import K1, K2, kernel_parameters
from identification.thresholds import ADEQUATE, COMPLETE

# Relative deviations that the force between its samples adds where it drives the run (where it
# corrects one, so much less as its gain squared), by name;
# from the errors seen on simulated logs without a command (benchmarks/nine_parameters.py).
BETWEEN = dict(zip(NAMES, (1e-3, 1e-3, 1e-3, 5e-4, 5e-4, 1e-2, 1e-2, 3e-3, 3e-3), strict=True))


@dataclass(frozen=True, eq=False)
class Spread:
    """A plant, names (d,) of what was free, sets (k, d) that do about as well, what is left."""

    plant: Plant
    names: tuple[str, ...]
    samples: Array
    chi_square: float
    adequate: bool
    noise: tuple[float, float]
    evaluations: int
    logs: tuple[LogFit, ...]
    events: Events
    remarks: tuple[str, ...] = ()


def settled(
    plant: Plant, recorded: RecordedLogs, misfit: float, rng: np.random.Generator,
    report: Progress, *, refined: Refit | None = None, quick: bool = False,
) -> KarnoppFit:  # fmt: skip
    """The fit of a plant that a search or refinement has come to, near its minimum.

    misfit: what it leaves in windows; refined: the refinement that it comes from, if it is one;
    quick: by the windows, which take no search. Sources: whole runs, Levenberg (1944), Marquardt
    (1963), Cappé et al. (2004); windows, Bock (1983), Liang, Zeger (1986).
    """
    drifts = any(walks(one, recorded.drive) and not one.held for one in recorded.logs)
    exact = recorded.drive == "command" and not plant.effects and not drifts and not quick
    spread = None
    if exact and misfit <= ADEQUATE:
        spread = _over_whole_runs(plant, recorded, rng, report)
    if spread is None:
        spread = _over_windows(plant, recorded, misfit, rng, refined)
    return _as_fit(spread, recorded)


def _over_whole_runs(
    plant: Plant, recorded: RecordedLogs, rng: np.random.Generator, report: Progress
) -> Spread | None:
    """By the likelihood of whole runs; None where these are not followed to the noise."""
    problem = posed(recorded)
    problem = opened(problem) if problem.hold else problem
    optimum = nearest(problem, plant)
    if optimum.cost > COMPLETE * problem.count and not problem.hold:
        # A stop that turns on less than the noise makes minima beside the right one.
        other = searched_plant(
            recorded.plain, rng, rig=recorded.rig, drive=recorded.drive, report=report,
            halt=recorded.halt,
        )  # fmt: skip
        optimum = min(optimum, nearest(problem, other), key=lambda one: one.cost)
    if optimum.cost > ADEQUATE * problem.count:
        return None
    solution = weigh_noise(problem, optimum, rng, optimum.evaluations, report)
    return _of_solution(problem, solution)


def nearest(problem: Problem, plant: Plant) -> Optimum:
    """The minimum over whole runs that is nearest to a plant."""
    row = kernel_row(problem, plant)
    # Its start first, or the first step diverges.
    begun = refine(problem.long_runs, row, problem.free[:0])
    return refine(begun.runs(problem.long_runs), row, problem.free)


def posed(recorded: RecordedLogs) -> Problem:
    return pose(recorded.plain, recorded.rig, recorded.drive, recorded.halt)


def kernel_row(problem: Problem, plant: Plant) -> Array:
    """Kernel parameters (11,) of a plant."""
    k1, k2 = float(problem.row[K1]), float(problem.row[K2])
    if isinstance(plant.actuator, Actuator):
        k1, k2 = plant.actuator.k1, plant.actuator.k2
    return kernel_parameters(plant.friction.array, k1, k2)


def _of_solution(problem: Problem, solution: Solution) -> Spread:
    optimum = solution.optimum
    runs = [simulated(problem, optimum, i) for i in range(len(problem.logs))]
    samples = solution.samples[:, : len(problem.free)]
    drift = drift_size(_residuals(problem, runs)) if solution.chi_square <= ADEQUATE else 0.0
    return Spread(
        plant=plant_of(problem, optimum),
        names=tuple((*NAMES, "k1", "k2")[int(i)] for i in problem.free),
        samples=widened(samples, np.mean(samples, axis=0), drift) if drift else samples,
        chi_square=solution.chi_square,
        adequate=solution.adequate,
        noise=solution.noise,
        evaluations=solution.evaluations,
        logs=tuple(_whole_log(problem, optimum, run, i) for i, run in enumerate(runs)),
        events=events_of(
            [run.mode for run in runs], [run.v for run in runs], force_of(problem.logs)
        ),
        remarks=(RESIDUAL_DRIFT_SAID.format(drift),) if drift else (),
    )


RESIDUAL_DRIFT_SAID = (
    "the run drifts slowly from the log (by {:.3g} deviations in all), less than the noise at any"
    " sample: a sample of the command may be wrong, or the body was touched; intervals are widened"
    " for it"
)


def _residuals(problem: Problem, runs: Sequence[FreeRun]) -> list[Array]:
    """What the runs leave of position and, where it is measured, force."""
    out = []
    for log, run in zip(problem.logs, runs, strict=True):
        out += [run.y - log["y"], *([] if problem.hold else [run.F - log["F"]])]
    return out


def _whole_log(problem: Problem, optimum: Optimum, run: FreeRun, index: int) -> LogFit:
    log = problem.logs[index]
    position = run.y - log["y"]
    weight = problem.runs[index].measured.weight_y
    force = None if problem.hold else float(np.sqrt(np.mean((run.F - log["F"]) ** 2)))
    return LogFit(
        log=log.name,
        start=start_of(problem, optimum, index),
        position_rms=float(np.sqrt(np.mean(position**2))),
        force_rms=force,
        chi_square=float(np.mean((position * weight) ** 2)),
    )


def _over_windows(
    plant: Plant, recorded: RecordedLogs, misfit: float, rng: np.random.Generator,
    refined: Refit | None,
) -> Spread:  # fmt: skip
    """By runs in windows from measured states, within which what is left is correlated."""
    near = refined or refit(plant, recorded.logs, recorded.drive, prior=even(plant), effort="near")
    if near.misfit <= misfit:
        plant = near.plant
    names = near.names
    values = values_of(plant, names)
    left = min(near.misfit, misfit)
    events = _events(plant, recorded)
    covariance = _covariance(near, recorded, values, events)
    samples = rng.multivariate_normal(values, covariance, NORMAL_SETS, check_valid="ignore")
    said = [] if not is_adequate(left) or recorded.drive == "force" else [_why_windows(recorded)]
    return Spread(
        plant=plant,
        names=names,
        samples=samples,
        chi_square=left,
        adequate=is_adequate(left),
        noise=(
            float(np.median([one.noise_y for one in recorded.logs])),
            float(np.median([one.noise_F for one in recorded.logs])),
        ),
        evaluations=0,
        logs=tuple(_window_log(plant, recorded, i) for i in range(len(recorded.logs))),
        events=events,
        remarks=tuple(said),
    )


def _why_windows(recorded: RecordedLogs) -> str:
    """What to say of a fit that follows its logs in windows."""
    walk = max(one.walk for one in recorded.logs)
    if walk == 0.0:
        return MinorRemark(
            "the model follows the logs in windows of 2 s from measured states, but not the whole:"
            " a stop turns on less than the noise there"
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
    by_force = 1.0 if recorded.drive == "force" else max(one.gain for one in recorded.logs) ** 2
    floor = by_force * np.array([BETWEEN.get(name, 0.0) for name in near.names]) * np.abs(values)
    covariance = covariance + np.diag(floor**2)
    if not np.all(np.isfinite(covariance)):
        covariance = np.diag(np.abs(values) ** 2)
    return np.asarray(covariance)


def _as_large_as_can_be(plant: Plant, names: Sequence[str], values: Array, events: Events) -> Array:
    """Deviations (d,) of parameters of which the logs say nothing: as large as they could be."""
    p = plant.friction
    force = max(p.F_cp, p.F_cn, p.F_sp, -p.F_sn)
    speed = max(*events.fastest, p.dv_p, -p.dv_n)
    largest = {"dv_p": speed, "dv_n": speed, "F_vp": force / speed, "F_vn": force / speed}
    largest |= dict.fromkeys(("F_cp", "F_cn", "F_sp", "F_sn"), force)
    return np.maximum(np.abs(values), [largest.get(name, 0.0) for name in names])


def _window_log(plant: Plant, recorded: RecordedLogs, index: int) -> LogFit:
    one = recorded.logs[index]
    errors = position_errors(plant, one, recorded.drive)
    lost = CANNOT_BE_FOLLOWED * one.noise_y
    rms = lost if errors is None else float(np.sqrt(np.mean(errors**2)))
    return LogFit(
        log=one.log.name,
        start=measured_start(one.log),
        position_rms=rms,
        force_rms=None,
        chi_square=(rms / one.noise_y) ** 2,
    )


def _as_fit(spread: Spread, recorded: RecordedLogs) -> KarnoppFit:
    """The spread as estimates with intervals and reasons."""
    center = values_of(spread.plant, spread.names)
    own = [i for i, name in enumerate(spread.names) if "." not in name]
    sd = dict(zip(spread.names, np.std(spread.samples, axis=0).tolist(), strict=True))
    found = {
        **estimates(
            [spread.names[i] for i in own], center[own], spread.samples[:, own], spread.events,
            recorded.rig, recorded.name,
        ),
        **effect_estimates(spread.plant.effects, sd),
    }  # fmt: skip
    return KarnoppFit(
        friction=spread.plant.friction,
        actuator=spread.plant.actuator,
        effects=spread.plant.effects,
        estimates=found,
        free=spread.names,
        covariance=np.atleast_2d(np.cov(spread.samples.T)),
        samples=spread.samples,
        drive=recorded.drive,
        noise_y=spread.noise[0],
        noise_F=spread.noise[1],
        chi_square=spread.chi_square,
        adequate=spread.adequate,
        logs=spread.logs,
        breakaways=spread.events.breakaways,
        evaluations=spread.evaluations,
        remarks=(*_remarks(spread, recorded), *spread.remarks),
        command_period=recorded.command_period,
    )


def _remarks(spread: Spread, recorded: RecordedLogs) -> Sequence[str]:
    out = []
    if not spread.adequate:
        # The summary of a model says it too.
        out.append(
            MinorRemark(
                f"{_off(spread, recorded)}: an effect is missing, or the structure is wrong; run"
                " 'workbench trace' to find it; intervals are widened for it"
            )
        )
    if recorded.drive == "force":
        out.append(
            MinorRemark("driven by the measured force, in windows of 2 s from measured states")
        )
    return out


def _off(spread: Spread, recorded: RecordedLogs) -> str:
    """By how much the model is off, in the units of the machine."""
    factor, unit = (1.0, "rad") if recorded.rig.motion == "rotary" else (1e3, "mm")
    force = units_of(recorded.rig.motion)["F_cp"]
    y = [one.position_rms for one in spread.logs]
    F = [one.force_rms for one in spread.logs if one.force_rms is not None]
    said = f"the run has an error of {factor * max(y):.3g} {unit} rms in position"
    said += f" (sensor's noise {factor * spread.noise[0]:.2g} {unit})"
    if F:
        said += f" and {max(F):.3g} {force} in force (noise {spread.noise[1]:.2g} {force})"
    return said


def structure_estimates(
    plant: Plant, sd: Mapping[str, float], recorded: RecordedLogs
) -> dict[str, Estimate]:
    """The nine and the actuator's of a plant that has been refined already; sd: by name.

    The same rules as of a fit decide which of them are identifiable.
    """
    names = [name for name in names_of(plant, recorded.drive) if "." not in name]
    values = values_of(plant, names)
    events = _events(plant, recorded)
    own = np.array([sd.get(name, 0.0) for name in names])
    own = np.where(own > 0.0, own, _as_large_as_can_be(plant, names, values, events))
    samples = normal_samples(values, own)
    return dict(estimates(names, values, samples, events, recorded.rig, recorded.name))


def force_of(logs: Sequence[Log]) -> float:
    """Spread of the applied force [N] over all logs."""
    return float(np.std(np.concatenate([np.asarray(log["F"]) for log in logs])))


def _events(plant: Plant, recorded: RecordedLogs) -> Events:
    """What happens in the plant's run in windows."""
    runs = [window_run(plant, one, recorded.drive, starts(one, recorded.drive))
            for one in recorded.logs]  # fmt: skip
    followed = [run for run in runs if run is not None]
    modes, speeds = [run.mode for run in followed], [run.v for run in followed]
    return events_of(modes, speeds, force_of(recorded.plain))
