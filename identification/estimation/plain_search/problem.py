"""Logs posed as a search: how they are driven, their noise, and where to look."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.arrays import Array
from identification.estimation.plain_search.actuator_fit import ActuatorFit, fit_actuator
from identification.estimation.plain_search.fitted_runs import (
    FittedRun,
    impulse_of,
    prepare_run,
    signal_noise,
)
from identification.estimation.plain_search.search_bounds import Box, search_box
from identification.estimation.regression.three_step import FirstEstimate, first_estimate
from identification.log import Log
from identification.model.estimates import Drive
from identification.model.karnopp import NAMES, NEGATIVE, Karnopp
from identification.model.plant import Actuator, Plant
from identification.progress import Halt


@dataclass(frozen=True)
class Problem:
    """Logs as runs of the kernels, the box to search, and the row (11,) in its middle; drives: what
    drives the plants, with its first estimate."""

    runs: tuple[FittedRun, ...]
    box: Box
    row: Array
    drives: Actuator | None

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


def pose(logs: Sequence[Log], drive: Drive, halt: Halt | None = None) -> Problem:
    """The logs as a search: noise estimated, search box drawn.

    drive: what drives their runs (`recorded_logs.chosen_drive`), no motor's command; halt: asked
    before each of them. Raises NotIdentifiable where nothing moves.
    """
    firsts = tuple(first_estimate(log) for log in logs)
    by_command = drive == "command"
    actuator = fit_actuator(logs) if by_command else None
    k1, k2 = (actuator.k1, actuator.k2) if actuator else (0.0, 0.0)
    window = 1.0 if by_command else 2.0
    runs = tuple(
        prepare_run(
            log,
            drive,
            constant=float(actuator.constants[i]) if actuator else 0.0,
            window=window,
            noise=_noise(log, first, actuator),
        )
        for i, (log, first) in enumerate(zip(logs, firsts, strict=True))
    )
    if halt is not None:
        runs = tuple(replace(run, halt=halt) for run in runs)
    stiffness = None if by_command else _stiffness_bounds(logs, firsts)
    box, row = search_box(firsts, k1, k2, stiffness)
    return Problem(runs, box, row, Actuator(k1, k2) if by_command else None)


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


def plant_of(problem: Problem, row: Array) -> Plant:
    """The plant of kernel parameters (11,); a friction of 0, which may be a little below, is 0."""
    negative = np.array([name in NEGATIVE for name in NAMES])
    nine = row[:9]
    friction = Karnopp.from_array(np.where(negative, np.minimum(nine, 0.0), np.maximum(nine, 0.0)))
    return Plant(friction, problem.drives)
