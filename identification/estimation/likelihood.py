"""The likelihood by which a fit has converged, with its noise and bounds, for sampling around it.

The same ways as of the fit: windows from measured states, whose uncertainty is integrated out, and
with it the drift by a measured force's noise, the longest of them whole runs; the rows of the force
equation under prescribed motion. Priors are flat.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from identification.arrays import Array
from identification.estimation.contradicted import CORRECTION_ROUNDS, corrected
from identification.estimation.imposed_motion import force_fit
from identification.estimation.likely_windows import LikelyWindows
from identification.estimation.recorded_logs import RecordedLogs, recorded_logs
from identification.estimation.settling import between_samples_sd
from identification.estimation.windowed_run.parameters import values_of
from identification.estimation.windowed_run.run_errors import misfit
from identification.estimation.windowed_run.windows import RUN_WINDOW, longest_window
from identification.log import Log, Rig
from identification.model.estimates import KarnoppFit
from identification.model.karnopp import NAMES
from identification.model.plant import Plant

WHOLE_RUNS = "the run over the whole of each log"
IN_WINDOWS = "the run in windows from measured states"
BY_FORCE = "the force equation"


@dataclass(frozen=True, eq=False)
class Likelihood:
    """Minus twice a log likelihood, of the parameters `names` (d,).

    center (d,), covariance (d, d): where it is largest, and how wide about there. cost: members
    (k, d) to (k,), infinite outside the bounds. further (d,): deviations of what the likelihood
    cannot hold, the force between its samples. way: on what it is, in words.
    """

    names: tuple[str, ...]
    center: Array
    covariance: Array
    cost: Callable[[Array], Array]
    further: Array
    way: str


def likelihood_of(fit: KarnoppFit, logs: Sequence[Log], rig: Rig) -> Likelihood:
    """The likelihood of a fit's parameters on the logs that it was made from.

    Raises BadLog where the logs lack a signal, NotIdentifiable where nothing moves. Source:
    `LikelyWindows`, Ribatet, Cooley, Davison (2012).
    """
    recorded = recorded_logs(logs, rig, fit.drive)
    if fit.imposed:
        return _by_force(recorded)
    plant = Plant(fit.friction, fit.actuator, fit.effects)
    left = misfit(plant, recorded.logs, recorded.drive)
    for _ in range(CORRECTION_ROUNDS if fit.bad else 0):
        recorded = corrected(plant, recorded, left).recorded
        left = misfit(plant, recorded.logs, recorded.drive)
    return _over_windows(fit, plant, recorded)


def _over_windows(fit: KarnoppFit, plant: Plant, recorded: RecordedLogs) -> Likelihood:
    """Windows of any plant; the fit's own parameters, of which some may be fixed."""
    covariance = np.atleast_2d(fit.covariance)
    logs, drive = recorded.logs, recorded.drive
    seconds = longest_window(plant, logs, drive) if fit.whole else RUN_WINDOW
    windows = LikelyWindows.of(plant, logs, drive, fit.free, covariance, seconds)
    center = values_of(plant, fit.free)
    further = between_samples_sd(fit.free, center, recorded)
    if windows.stretch is not None:  # which has that in it already
        further = np.zeros(len(center))
    way = WHOLE_RUNS if fit.whole else IN_WINDOWS
    return Likelihood(fit.free, center, covariance, windows.cost, further, way)


def _by_force(recorded: RecordedLogs) -> Likelihood:
    """The rows of the force equation: linear in its parameters, so it is normal but for signs."""
    found, _ = force_fit(recorded)
    information = np.linalg.pinv(found.covariance, hermitian=True)

    def cost(members: Array) -> Array:
        off = members - found.theta
        square = np.einsum("ki,ij,kj->k", off, information, off)
        return np.where(np.all(members >= 0.0, axis=1), square, np.inf)

    names = tuple(NAMES[i] for i in found.used)
    center = np.maximum(found.theta, 0.0)
    return Likelihood(names, center, found.covariance, cost, np.zeros(len(names)), BY_FORCE)
