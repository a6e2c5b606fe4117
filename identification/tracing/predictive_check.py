"""Do effects predict what was measured on logs that no fit has seen? Position, at two horizons.

An error of the equation of motion may vanish because the model makes its own force vanish; a
position was measured, and no parameter of a model can change it or its noise.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.estimation.regression.equation_rows import MotionLog
from identification.estimation.windowed_run.run_errors import CANNOT_BE_FOLLOWED, mean_loss
from identification.estimation.windowed_run.windows import (
    left_in_windows,
    starts,
    window_of,
)
from identification.model.estimates import Drive
from identification.model.plant import Plant
from identification.thresholds import WORSE

HORIZONS = (0.2, 2.0)  # s of free run from the measured state
FEWEST_SAMPLES = 12  # of a horizon


@dataclass(frozen=True)
class Worse:
    """A horizon [s] over which a plant predicts the position worse than another: robust errors of
    both in units of the position's noise."""

    seconds: float
    before: float
    after: float


def predicts_worse(
    before: Plant, after: Plant, seen: Sequence[MotionLog], drive: Drive
) -> Worse | None:
    """The first horizon over which the position of these logs is predicted clearly worse after.

    None where there is none, and where nothing moves. Ours: `README.md`, (7); runs restart as in
    multiple shooting, Bock (1983).
    """
    moving = [one for one in seen if np.any(one.signals["d"] != 0)]
    for seconds in HORIZONS:
        fit = [one for one in moving if seconds / one.log.h >= FEWEST_SAMPLES]
        if not fit:
            continue
        was, now = (_error(plant, fit, drive, seconds) for plant in (before, after))
        if is_worse(was, now):
            return Worse(seconds, was, now)
    return None


def is_worse(before: float, after: float) -> bool:
    """Whether a prediction is clearly worse than another; errors in units of the noise. Ours."""
    return after**2 - 1.0 > WORSE**2 * max(before**2 - 1.0, 1.0)


def _error(plant: Plant, logs: Sequence[MotionLog], drive: Drive, seconds: float) -> float:
    """Robust error of the position over all logs, in units of its noise."""
    squares = []
    for one in logs:
        r = left_in_windows(plant, one, drive, seconds, even=True)
        if r is None or not np.all(np.isfinite(r[0])):
            return CANNOT_BE_FOLLOWED
        moves = one.signals["d"] != 0
        squares.append(mean_loss(r[0], window_of(starts(one, drive, seconds), len(one.log)), moves))
    return float(np.sqrt(np.mean(squares)))
