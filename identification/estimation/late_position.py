"""A late position of a slow drive, whose equation of motion in weak form identifies no lag.

Windows of sixteen samples last a third of a second at 50 Hz, and in a loop the position's noise is
in the command too, so least squares draw the lag anywhere. A run does not: it is followed where the
command acts as late as it does, and nowhere else. So a lag is believed where a run follows with it,
a motor's is refined there, and searched where the log is slow. One that explains most of what the
equation leaves is believed without, where no loop is known, or where it is too short for a run to
notice.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.errors import UserError
from identification.estimation.recorded_logs import recorded_logs
from identification.estimation.regression.equation_rows import LogNoise
from identification.estimation.structure_fit import plain_structure
from identification.estimation.surroundings import (
    apart,
    explains,
    explains_most,
    lag_explains,
    surroundings,
)
from identification.estimation.windowed_run.run_errors import misfit
from identification.log import Log, Rig
from identification.model.plant import Plant
from identification.model.size import NOT_SHOWN, Size
from identification.model.surroundings import Surroundings
from identification.progress import Halt
from identification.signals.check import are_steps
from identification.thresholds import ADEQUATE, ASTRAY, HOPELESS

SLOW_LOG = (
    6e-3  # s between samples, from which the equation's windows are too long to identify a lag
)
DOUBLED = (1.0, 2.0, 4.0, 8.0)  # samples, tried in turn
NEARER = (2.0, 1.0, 0.5)  # samples, to either side of the best so far
LAG_SD = 0.25  # samples, within which the best of halves is known
SEED = 0  # the lags are compared on the same draws


@dataclass(frozen=True)
class _Run:
    """What a plant's run leaves of logs with a lag taken out; share: of the step of the command, by
    which it is earlier again; plant, noise: where without one."""

    misfit: float
    share: float = 0.0
    plant: Plant | None = None
    noise: tuple[LogNoise, ...] = ()


def what_acts_beside(
    logs: Sequence[Log], rig: Rig, halt: Halt | None = None, *,
    each: Callable[[], Halt] = Halt,
) -> Surroundings:  # fmt: skip
    """What acts beside the applied force, as `surroundings` has it, with a lag that lets a run
    follow the logs.

    halt: whether further lags are tried; each: how long one is, where that has an end of its own.
    """
    found, motor = surroundings(logs, rig), rig.kind == "motor"
    if motor and not rig.force_per_command:
        return found
    if are_steps(logs):  # the same however late
        return replace(found, lag=NOT_SHOWN, sampled=False)
    h, halt = logs[0].h, halt or Halt()
    found = replace(found, gives=rig.force_per_command if motor else None)
    tried: dict[float, _Run] = {}

    def left(samples: float) -> float:
        """Misfit of the plain plant on the logs with that lag taken out."""
        if samples not in tried:
            late = replace(found, lag=Size(samples * h))
            shifted = [late.taken_out(log) for log in logs]
            own = halt if each is Halt else each()
            tried[samples] = _run(shifted, rig, own, tried.get(0.0))
        return tried[samples].misfit

    def follows(samples: float) -> bool:
        """Whether a run follows with that lag where it clearly does not without."""
        without, with_it = left(0.0), left(samples)
        if without <= ASTRAY or with_it > HOPELESS:
            return False
        return explains(without - 1.0, with_it - 1.0)

    def believed(samples: float) -> bool:
        """Whether a run bears the equation's lag out, or the lag explains most of what the equation
        leaves, in a loop if a run does well with it."""
        without, with_it = lag_explains(logs, rig, found)
        most = explains_most(without**2, with_it**2)
        if most and (not in_loop or left(samples) <= ADEQUATE):
            return True
        return follows(samples)

    in_loop = not motor or any("r" in log for log in logs)
    if found.lag.value and not found.zoh and not believed(found.lag.value / h):
        found = replace(found, lag=NOT_SHOWN, sampled=False)  # it is the loop's own noise
    if not motor or not (found.lag.value or h >= SLOW_LOG):
        return found
    begun = found.lag.value / h
    best = _best_lag(left, halt, begun)
    if best == begun or not follows(best):
        return found
    # Half a sample of lag and a loop that is far faster than the log are together none.
    if not (begun or apart(best - tried[best].share)):
        return found
    return replace(found, lag=Size(best * h, LAG_SD * h))


def _best_lag(left: Callable[[float], float], halt: Halt, begun: float) -> float:
    """The lag in samples, by halves from one of the equation (0: none is known), that leaves least;
    that one, or one beside it, where the run is followed with it."""
    best = begun
    if left(best) <= ADEQUATE:
        return best

    def better_by(step: float) -> float:
        tried = [best - step, best + step]
        allowed = [samples for samples in tried if samples > 0.0 and not halt.reached()]
        return min([best, *allowed], key=left)

    if begun:
        best = better_by(NEARER[-1])
        if left(best) <= ADEQUATE:
            return best
    for samples in () if begun else DOUBLED:
        if not halt.reached():  # a lag near by, but not the right one, may leave more than none
            best = min(best, samples, key=left)
    for step in NEARER:
        best = better_by(step)
    return best


def _run(logs: Sequence[Log], rig: Rig, halt: Halt | None, none: _Run | None) -> _Run:
    """The run of the plain plant on these logs, its misfit in the units of that without a lag.

    By its own, whichever plant drifts farthest with the noise of its force would follow best, as
    would a log that its lag has smoothed between the samples.
    """
    try:
        recorded = recorded_logs(logs, rig, None, halt)
        model = plain_structure(recorded, np.random.default_rng(SEED))
    except UserError:
        return _Run(np.inf)
    noise = tuple(one.noise for one in recorded.logs)
    if none is None or none.plant is None:
        return _Run(model.misfit, recorded.share, model.plant, noise)
    alike = [  # few runs, not halted, of what is found already
        replace(one, noise=own, halt=Halt())
        for one, own in zip(recorded.logs, none.noise, strict=True)
    ]
    left = misfit(model.plant, alike, recorded.drive, weighed_by=none.plant)
    return _Run(left, recorded.share)
