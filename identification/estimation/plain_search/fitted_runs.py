"""Logs prepared for the fit: measured arrays, restart windows, and cost over all of them."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np

from identification.arrays import Array, IntArray
from identification.estimation.plain_search.cost import (
    COMMAND,
    LOGGED_FORCE,
    Measured,
    RestartWindows,
    cost_of_lanes,
)
from identification.log import Log
from identification.model.estimates import Drive
from identification.progress import Halt
from identification.signals.differentiate import spectrum
from identification.signals.initial_state import measured_start
from identification.simulation.free_run import force_slope
from identification.simulation.karnopp_lanes import WIDTH

REST_SECONDS = 0.04  # that a body must stand still to be restarted from there
SMALLEST = 1e-7  # of a signal's range: the least noise that is believed


@dataclass(frozen=True)
class FittedRun:
    """One log ready for the kernels, with its restart windows; halt: asked before its runs."""

    name: str
    measured: Measured
    windows: RestartWindows
    halt: Halt = field(default_factory=Halt, compare=False)


def signal_noise(x: Array, h: float) -> float:
    """White noise of a signal (one sigma), never below what its range could resolve."""
    spread = float(np.ptp(x))
    return max(spectrum(x, h).noise, SMALLEST * spread, 1e-300)


def impulse_of(log: Log) -> Array:
    """h * (sum of the commands before each sample) [V s], the integral of a zero-order hold."""
    return log.h * np.concatenate([[0.0], np.cumsum(log["u"])[:-1]])


def prepare_run(
    log: Log,
    drive: Drive,
    *,
    constant: float,
    window: float,
    noise: tuple[float, float],
) -> FittedRun:
    """A log for the kernels.

    constant: F + k2 y - k1 * impulse [N] (command only); window: seconds between restarts; noise:
    sigma of y [m] and F [N].
    """
    h, y, force = log.h, log["y"], log["F"]
    sigma_y, sigma_f = noise
    by_command = drive == "command"
    measured = Measured(
        h=h,
        drive=COMMAND if by_command else LOGGED_FORCE,
        y=y,
        force=force,
        u=log["u"] if by_command else np.zeros(len(y)),
        impulse=impulse_of(log) if by_command else np.zeros(len(y)),
        constant=constant,
        slope_y=np.append(np.diff(y) / h, 0.0),
        slope_force=force_slope(force, h, hold=False),
        weight_y=1.0 / sigma_y,
        weight_force=1.0 / sigma_f if by_command else 0.0,
    )
    windows = rest_windows(y, sigma_y, h, window)
    windows.y[0], windows.v[0], _ = measured_start(log)
    return FittedRun(log.name, measured, windows)


def rest_windows(y: Array, sigma: float, h: float, seconds: float) -> RestartWindows:
    """Restarts at significant rests only, at least `seconds` apart; the first one starts the log.

    y: measured position [m] with noise `sigma` [m]. A restart in motion would carry the error of
    a smoothed velocity into all that follows; a rest has v = 0 and its mean position.
    """
    width = max(8, round(REST_SECONDS / h))
    at, level = [0], [float(y[0])]
    if len(y) > 4 * width:
        sums, squares = np.cumsum(y - y[0]), np.cumsum((y - y[0]) ** 2)
        mean = (sums[width:] - sums[:-width]) / width
        variance = (squares[width:] - squares[:-width]) / width - mean**2
        # Still: no more spread than noise, and both halves at the same level.
        half = width // 2
        early = (sums[half:] - sums[:-half]) / half
        drift = np.abs(early[half : half + len(mean)] - early[: len(mean)])
        count = min(len(drift), len(mean))
        still = (variance[:count] < (1.3 * sigma) ** 2) & (
            drift[:count] < 3.0 * sigma / np.sqrt(half / 2)
        )
        step = round(seconds / h)
        for k in np.flatnonzero(still):
            middle = int(k) + 1 + half
            if middle - at[-1] >= step:
                at.append(middle)
                level.append(float(mean[k] + y[0]))
    index: IntArray = np.array(at, dtype=np.int64)
    return RestartWindows(index, np.array(level), np.zeros(len(at)))


def total_cost(runs: Sequence[FittedRun], p: Array, cap: float) -> Array:
    """Cost of parameter sets `p` (k, 11) over all runs, (k,).

    cap: bound of one sample's squared residual, 0 for none. Works on all cores. Raises Halted where
    the runs' `halt` says so. Source of the bound: Geman, McClure (1987); `README.md`, (2), (3).
    """
    runs[0].halt.ask()
    k = len(p)
    short = -k % WIDTH
    padded = np.concatenate([p, np.repeat(p[:1], short, axis=0)])

    def block(task: tuple[int, int]) -> tuple[int, Array]:
        index, low = task
        run = runs[index]
        rows = np.ascontiguousarray(padded[low : low + WIDTH])
        return low, cost_of_lanes(rows, run.measured, run.windows, cap)

    costs = np.zeros(len(padded))
    tasks = [(index, low) for low in range(0, len(padded), WIDTH) for index in range(len(runs))]
    if len(tasks) == 1:
        return block(tasks[0])[1][:k]
    with ThreadPoolExecutor() as pool:
        for low, part in pool.map(block, tasks):
            costs[low : low + WIDTH] += part
    return costs[:k]
