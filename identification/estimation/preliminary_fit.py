"""What a fit will identify, found in seconds: its first part, by the same rules.

The equation of motion is solved, the free run refined from it for so many samples; no search, no
whole runs. Then the rules of the fit say who answers, the run or the equation, and
what is identifiable. What only the search could change is reported as open.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.estimation.fit import fit_beside
from identification.estimation.late_position import what_acts_beside
from identification.log import Log, Rig
from identification.model.estimates import Drive, KarnoppFit
from identification.progress import Halt
from identification.signals.check import check_driven
from identification.thresholds import HOPELESS

SAMPLES_RUN = 1.5e7  # of simulated runs, for which a free run is refined: some two seconds
RUNS_OF_LAG = 1500  # of each log, with which a lag is tried, of several: a second
FIRST_FIT_SEED = 0  # the answer is the same each time


@dataclass(frozen=True, eq=False)
class PreliminaryFit:
    """A fit as far as it is seen in seconds; open: whether the whole fit may follow the log's run,
    which this one was near to when it ended."""

    fit: KarnoppFit
    open: bool = False


def preliminary_fit(logs: Sequence[Log], rig: Rig, drive: Drive | None = None) -> PreliminaryFit:
    """The first part of `fit_plant` of the same logs, by its sources (weak form, Messenger, Bortz
    2021).

    Raises as it does: BadLog where a signal is missing, NotIdentifiable where nothing moves.
    """
    check_driven(logs)
    rows = float(np.mean([len(log) for log in logs]))
    runs = SAMPLES_RUN / rows
    beside = what_acts_beside(logs, rig, each=lambda: _ending(RUNS_OF_LAG * len(logs)))
    rng, halt = np.random.default_rng(FIRST_FIT_SEED), _ending(runs)
    fit = fit_beside(logs, beside, rng, rig, drive, None, halt, quick=True)
    near = not (fit.prescribed or fit.adequate) and fit.chi_square <= HOPELESS
    return PreliminaryFit(fit, halt.reached() and near)


def _ending(runs: float) -> Halt:
    """A halt after so many runs."""
    count = itertools.count(1)
    return Halt(lambda: next(count) <= runs)
