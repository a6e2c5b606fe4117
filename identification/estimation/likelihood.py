"""The likelihood by which a fit has converged, with its noise and bounds, for sampling around it.

The same three ways as of the fit: white noise over whole runs, its level taken from what is left;
windows from measured states, whose uncertainty is integrated out, and with it the drift by a
measured force's noise; the rows of the force equation under prescribed motion. Priors are flat.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.arrays import Array
from identification.estimation.contradicted import CORRECTION_ROUNDS, corrected
from identification.estimation.imposed_motion import force_fit
from identification.estimation.likely_windows import LikelyWindows
from identification.estimation.plain_search.likely_sets import (
    log_cost,
    reweighed,
)
from identification.estimation.plain_search.local_search import Optimum, pack, refine
from identification.estimation.plain_search.search import opened
from identification.estimation.plain_search.search_bounds import Box
from identification.estimation.recorded_logs import RecordedLogs, recorded_logs
from identification.estimation.settling import BETWEEN, nearest, posed
from identification.estimation.windowed_run.parameters import values_of
from identification.estimation.windowed_run.run_errors import misfit
from identification.estimation.windowed_run.windows import walks
from identification.log import Log, Rig
from identification.model.estimates import KarnoppFit
from identification.model.karnopp import NAMES
from identification.model.plant import Plant
from identification.thresholds import ADEQUATE

ROOM = 4.0  # times the search's box, in which parameters of a whole run may lie
WHOLE_RUNS = "the run over the whole of each log"
IN_WINDOWS = "the run in windows from measured states"
BY_FORCE = "the force equation"


@dataclass(frozen=True, eq=False)
class Likelihood:
    """Minus twice a log likelihood, of the parameters `names` (d,) and then the runs' own starts.

    center (u,), covariance (u, u): where it is largest, and how wide about there. cost: members
    (k, u) to (k,), infinite outside the bounds. further (d,): deviations of what the likelihood
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

    Raises BadLog where the logs lack a signal, NotIdentifiable where nothing moves. Sources: normal
    noise of the level that is left, over whole runs; windows as `LikelyWindows`, Ribatet, Cooley,
    Davison (2012).
    """
    recorded = recorded_logs(logs, rig, fit.drive)
    if fit.imposed:
        return _by_force(recorded)
    plant = Plant(fit.friction, fit.actuator, fit.effects)
    left = misfit(plant, recorded.logs, recorded.drive)
    for _ in range(CORRECTION_ROUNDS if fit.bad else 0):
        recorded = corrected(plant, recorded, left).recorded
        left = misfit(plant, recorded.logs, recorded.drive)
    walking = any(walks(one, recorded.drive) and not one.held for one in recorded.logs)
    if recorded.drive == "command" and not plant.effects and not walking and left <= ADEQUATE:
        found = _over_whole_runs(plant, recorded)
        if found is not None:
            return found
    return _over_windows(fit, plant, recorded)


def _over_whole_runs(plant: Plant, recorded: RecordedLogs) -> Likelihood | None:
    """White noise of the level that the runs leave; None where they are not followed."""
    problem = posed(recorded)
    problem = opened(problem) if problem.hold else problem
    optimum = nearest(problem, plant)
    if optimum.cost > ADEQUATE * problem.count:
        return None
    runs = [reweighed(run, optimum.p) for run in optimum.runs(problem.long_runs)]
    optimum = refine(runs, optimum.p, problem.free)
    box = _around(problem.box.wider(ROOM), optimum)
    names = tuple((*NAMES, "k1", "k2")[int(i)] for i in problem.free)
    return Likelihood(
        names, pack(runs, optimum.p, optimum.starts, optimum.free), optimum.covariance,
        log_cost(runs, optimum, box), np.zeros(len(names)), WHOLE_RUNS,
    )  # fmt: skip


def _around(box: Box, optimum: Optimum) -> Box:
    """The box with the optimum in it, which a refinement may have left."""
    size = np.abs(optimum.p[box.free])
    return replace(box, low=np.minimum(box.low, 0.5 * size), high=np.maximum(box.high, 2.0 * size))


def _over_windows(fit: KarnoppFit, plant: Plant, recorded: RecordedLogs) -> Likelihood:
    """Windows of any plant; the fit's own parameters, of which some may be fixed."""
    covariance = np.atleast_2d(fit.covariance)
    windows = LikelyWindows.of(plant, recorded.logs, recorded.drive, fit.free, covariance)
    by_force = 1.0 if recorded.drive == "force" else max(one.gain for one in recorded.logs) ** 2
    center = values_of(plant, fit.free)
    # What the windows are stretched to has that in it already.
    by_force = by_force if windows.stretch is None else 0.0
    further = by_force * np.array([BETWEEN.get(name, 0.0) for name in fit.free]) * np.abs(center)
    return Likelihood(fit.free, center, covariance, windows.cost, further, IN_WINDOWS)


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
