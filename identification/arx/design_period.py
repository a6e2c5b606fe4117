"""The period of an ARX plant and of the controller on it, as a multiple of the logs' own."""

from collections.abc import Sequence

import numpy as np

from identification.arrays import Array
from identification.errors import BadLog, BadModel
from identification.log import Log

DESIGN_PERIOD = 10e-3  # s
FEWEST = 20  # design periods in a log
MEETS = 1e-2  # relative difference up to which two periods count as one


def common_period(logs: Sequence[Log], period: float | None) -> tuple[float, tuple[int, ...]]:
    """The design period [s] of all logs and the samples of each in it, set by the slowest log.

    Raises BadLog where a log's own period does not meet it, BadModel as `decimation`.
    """
    slowest = max(logs, key=lambda log: log.h)
    h = decimation(slowest.h, period) * slowest.h
    steps = tuple(max(1, round(h / log.h)) for log in logs)
    for log, step in zip(logs, steps, strict=True):
        if abs(step * log.h - h) > MEETS * h:
            raise BadLog(
                f"{log.name}: sampled every {log.h:g} s, {slowest.name} every {slowest.h:g} s: no"
                f" whole number of its samples makes the design period {h:g} s; give a"
                " --design-period that is a multiple of both"
            )
    return h, steps


def check_period(period: float | None, name: str, duration: float) -> None:
    """Raises BadModel where so few periods [s] go into a log of that duration [s] that they
    identify nothing."""
    if period is not None and FEWEST * period > duration:
        raise BadModel(
            f"design period {period:g} s, {name} lasts {duration:.4g} s: fewer than {FEWEST}"
            f" periods; ask for at most {duration / FEWEST:.3g}"
        )


def decimation(h: float, period: float | None) -> int:
    """Samples of the log in one design period; raises BadModel where an asked one holds none, or
    no whole number of them."""
    wanted = DESIGN_PERIOD if period is None else period
    if not (np.isfinite(wanted) and wanted > 0):
        raise BadModel(f"design period {wanted:g} s, must be finite and > 0")
    if period is not None and period < 0.99 * h:
        raise BadModel(
            f"design period {period:g} s, the log is sampled every {h:g} s; ask for no less"
        )
    step = max(1, round(wanted / h))
    if period is not None and abs(step * h - period) > MEETS * period:
        raise BadModel(
            f"design period {period:g} s is no multiple of the log's {h:g} s; ask for {step * h:g}"
        )
    return step


def decimated(u: Array, y: Array, step: int) -> tuple[Array, Array]:
    """Every `step`-th output, and the mean of the input until the next one; shapes (n//step,)."""
    count = len(y) // step
    mean = u[: count * step].reshape(count, step).mean(axis=1)
    return np.ascontiguousarray(mean), np.ascontiguousarray(y[: count * step : step])
