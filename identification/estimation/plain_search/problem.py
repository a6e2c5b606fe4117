"""Logs posed as a fitting problem: how they are driven, their noise, and where to look."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.arrays import Array, IntArray
from identification.estimation.plain_search.actuator_fit import ActuatorFit, fit_actuator
from identification.estimation.plain_search.fitted_runs import (
    FittedRun,
    impulse_of,
    prepare_run,
    signal_noise,
)
from identification.estimation.plain_search.local_search import Optimum
from identification.estimation.plain_search.search_bounds import Box, search_box
from identification.estimation.regression.three_step import FirstEstimate, first_estimate
from identification.log import Log, Rig
from identification.model.estimates import Drive
from identification.model.karnopp import NAMES, NEGATIVE, Karnopp
from identification.model.plant import Actuator, Motor, Plant
from identification.progress import Halt
from identification.simulation.free_run import FreeRun, free_run
from identification.simulation.karnopp_step import K1, K2
from identification.thresholds import ADEQUATE

LONGEST_RUN = 40.0  # s; a run without a stiffness that holds it is compared at most this long


@dataclass(frozen=True)
class Problem:
    """Logs, how they are driven, and where to look; noise of position [m] and force [N]; the
    motor's k_a [N/V], 0 for other rigs."""

    logs: tuple[Log, ...]
    runs: tuple[FittedRun, ...]
    firsts: tuple[FirstEstimate, ...]
    box: Box
    row: Array
    free: IntArray
    drive: Drive
    hold: bool
    noise: tuple[float, float]
    k_a: float

    @property
    def adequate(self) -> float:
        """Chi-square up to which a fit counts as found; a measured force brings its own noise."""
        return ADEQUATE if self.drive == "command" else 2.0 * ADEQUATE

    @property
    def count(self) -> int:
        """Number of compared values."""
        return sum(run.measured.count for run in self.runs)

    @property
    def cap(self) -> float:
        """Bound of a squared residual in a search: wide of the noise, and of a fiftieth of the
        motion."""
        noise = max(
            (0.02 * float(np.std(run.measured.y)) * run.measured.weight_y) ** 2 for run in self.runs
        )
        return float(max(1e4, noise))

    @property
    def long_runs(self) -> tuple[FittedRun, ...]:
        """Runs as long as the model may be asked to follow without a restart."""
        if self.drive == "command":
            return tuple(run.whole() for run in self.runs)
        if not self.hold:
            return self.runs
        out = []
        for run in self.runs:
            at = run.windows.at * run.measured.h
            keep = np.concatenate([[True], np.diff(np.floor(at / LONGEST_RUN)) > 0])
            windows = replace(
                run.windows, at=run.windows.at[keep], y=run.windows.y[keep], v=run.windows.v[keep]
            )
            out.append(replace(run, windows=windows))
        return tuple(out)


def pose(logs: Sequence[Log], rig: Rig, drive: Drive, halt: Halt | None = None) -> Problem:
    """The logs as a fitting problem: noise estimated, search box drawn.

    drive: what drives their runs (`recorded_logs.chosen_drive`), the command of a motor; halt:
    asked before each of them. Raises NotIdentifiable where nothing moves.
    """
    hold = rig.kind == "motor"
    firsts = tuple(first_estimate(log, held=hold) for log in logs)
    by_command = drive == "command" and not hold
    actuator = fit_actuator(logs) if by_command else None
    k1, k2 = (actuator.k1, actuator.k2) if actuator else (0.0, 0.0)
    # A motor's run is driven by its force, that of its command.
    chosen: Drive = "command" if by_command else "force"
    window = 1.0 if by_command or hold else 2.0
    runs = tuple(
        prepare_run(
            log,
            chosen,
            constant=float(actuator.constants[i]) if actuator else 0.0,
            window=window,
            hold=hold,
            noise=_noise(log, first, actuator),
        )
        for i, (log, first) in enumerate(zip(logs, firsts, strict=True))
    )
    if halt is not None:
        runs = tuple(replace(run, halt=halt) for run in runs)
    stiffness = None if by_command or hold else _stiffness_bounds(logs, firsts)
    box, row = search_box(firsts, k1, k2, stiffness)
    # A coupling is chosen by the search alone: the refinement would stiffen it without end.
    free: IntArray = np.arange(9, dtype=np.int64)
    if by_command:
        free = np.concatenate([free, np.array([K1, K2], dtype=np.int64)])
    noise = _noise(logs[0], firsts[0], actuator)
    if hold:
        noise = (noise[0], 0.0)
    k_a = rig.force_per_command or 0.0
    return Problem(tuple(logs), runs, firsts, box, row, free, chosen, hold, noise, k_a)


def _noise(log: Log, first: FirstEstimate, actuator: ActuatorFit | None) -> tuple[float, float]:
    """Noise of position [m] and force [N]; what the actuator explains of the force is no noise."""
    force = log["F"]
    if actuator is not None:
        force = force - actuator.k1 * impulse_of(log) + actuator.k2 * first.motion.y
    return signal_noise(log["y"], log.h), signal_noise(force, log.h)


def _stiffness_bounds(logs: Sequence[Log], firsts: Sequence[FirstEstimate]) -> tuple[float, float]:
    """Range of the coupling [N/m] that holds a force-driven run near the measured position.

    From the stiffness at which a tenth of the stroke outweighs the friction, up to where the
    position's noise would shake the force by a fiftieth of the friction, or the coupled body
    would turn half a radian of its oscillation within a sample.
    """
    low, high = 0.0, np.inf
    for log, first in zip(logs, firsts, strict=True):
        friction = float(np.mean(first.nine[1:3]))
        low = max(low, friction / (0.1 * float(np.ptp(log["y"]))))
        noise = max(first.motion.noise, 1e-7 * float(np.ptp(log["y"])))
        high = min(high, 0.02 * friction / noise, first.nine[0] * (0.5 / log.h) ** 2)
    return low, max(high, 3.0 * low)


def simulated(problem: Problem, optimum: Optimum, index: int) -> FreeRun:
    """Free run of the fitted model along one log, from its fitted start."""
    plant = plant_of(problem, optimum)
    stiffness = 0.0 if problem.drive == "command" or problem.hold else float(optimum.p[K2])
    drive: Drive = "command" if problem.drive == "command" or problem.hold else "force"
    run = problem.long_runs[index]
    restarts = (run.windows.at, run.windows.y, run.windows.v)
    start = start_of(problem, optimum, index)
    log = problem.logs[index]
    return free_run(plant, log, start, drive, stiffness=stiffness, restarts=restarts)


def plant_of(problem: Problem, optimum: Optimum) -> Plant:
    """The plant of an optimum; a friction of 0, which a step may leave a little below, is 0."""
    negative = np.array([name in NEGATIVE for name in NAMES])
    nine = optimum.p[:9]
    friction = Karnopp.from_array(np.where(negative, np.minimum(nine, 0.0), np.maximum(nine, 0.0)))
    if problem.drive == "command":
        return Plant(friction, Actuator(float(optimum.p[K1]), float(optimum.p[K2])))
    if problem.hold:
        return Plant(friction, Motor(problem.k_a))
    return Plant(friction)


def start_of(problem: Problem, optimum: Optimum, index: int) -> tuple[float, float, float]:
    y, v, constant = (float(x) for x in optimum.starts[index])
    force = float(problem.logs[index]["F"][0])
    if problem.drive == "command":
        force = constant - float(optimum.p[K2]) * y
    return y, v, force
