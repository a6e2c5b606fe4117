"""What one new log says of a known machine: a local refit from the model in force.

The model in force is close as long as the machine has not changed, so Gauss-Newton on the
simulated response arrives from there in a few steps. Where it does not, it begins again from the
log's own first estimate, then from a global search; where no start brings chi-square down, the
structure does not fit the log.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from identification.arrays import Array
from identification.arx.residual_tests import effective_samples
from identification.drift.reference_model import InForce
from identification.estimation.global_search import evolve
from identification.estimation.output_error.cost import START_V, START_Y
from identification.estimation.output_error.fitted_runs import total_cost
from identification.estimation.output_error.growing_windows import CLIMB_ATTEMPTS as CLIMBS
from identification.estimation.output_error.growing_windows import climb
from identification.estimation.output_error.identifiability import estimates, events_of
from identification.estimation.output_error.imposed_motion import fit_imposed
from identification.estimation.output_error.karnopp_fit import searched_plant
from identification.estimation.output_error.local_search import Optimum, refine, robust_covariance
from identification.estimation.output_error.problem import ADEQUATE, Problem, pose, simulated
from identification.estimation.output_error.search_bounds import Box
from identification.estimation.output_error.short_windows import stretches
from identification.estimation.output_error.uncertainty import (
    BETWEEN,
    OUTLIER_BOUND,
    ROUGH,
    SCATTER_PARTS,
)
from identification.log import Log
from identification.model.karnopp import NAMES
from identification.model.plant import Actuator, Plant
from identification.simulation.karnopp_step import K2, kernel_parameters

# S; stretches in which a log is followed that is not followed as a whole
STRETCH_SECONDS = (4.0, 1.5)
LOST_STRETCHES = 0.1  # of the stretches, at least one, that may be spoiled by a lost stop
CLOSE_SHARE = 0.1  # relative range of a search close by
REFIT_POPULATION, REFIT_GENERATIONS = 64, 60
# Chi-square from which a log is not followed; a stop lost here or there leaves less
NOT_FOLLOWED = 2.0
LIKE = 4.0  # times the chi-square of the model in force, where that leaves more than noise
STIFF = 10.0  # of a body's rate times the sampling period
DRAWN = 512


@dataclass(frozen=True, eq=False)
class LogEstimate:
    """Parameters of one log: values (d,) and covariance (d, d) by `names`.

    untold: parameters that the log does not tell, with the reason; they are among `names` all the
    same. chi_square: what the best fit leaves per value; allowed: up to which the structure fits;
    searched: whether the local fits failed and a global search was made.
    """

    names: tuple[str, ...]
    values: Array
    covariance: Array
    untold: Mapping[str, str]
    chi_square: float
    allowed: float
    searched: bool

    @property
    def follows(self) -> bool:
        """Whether the structure of the model in force follows the log."""
        return self.chi_square <= self.allowed


@dataclass(frozen=True, eq=False)
class _Fit:
    """A problem, an optimum of it, and what it leaves per value."""

    problem: Problem
    optimum: Optimum
    chi_square: float


def _plain(problem: Problem, optimum: Optimum) -> _Fit:
    """A fit judged by the whole of its runs."""
    return _Fit(problem, optimum, optimum.cost / problem.count)


def estimate_log(model: InForce, log: Log, rng: np.random.Generator) -> LogEstimate:
    """The parameters of a model in force without effects, as this log alone tells them.

    Raises NotIdentifiable where nothing moves, BadLog where a signal is missing.
    """
    drive = None if model.rig.kind == "motor" else model.drive
    problem = pose([log], model.rig, drive)
    if model.imposed or _stiff(model, log.h):
        return _imposed(model, problem, rng)
    allowed = NOT_FOLLOWED if model.chi_square <= problem.adequate else LIKE * model.chi_square
    enough = allowed * ADEQUATE / NOT_FOLLOWED
    best: _Fit | None = None
    searched = False
    for found, by_search in _fits(model, problem, rng):
        if best is None or found.chi_square < best.chi_square:
            best, searched = found, by_search
        if best.chi_square <= enough:
            break
    assert best is not None
    return _told(best, allowed, searched, rng)


def _fits(
    model: InForce, problem: Problem, rng: np.random.Generator
) -> Iterator[tuple[_Fit, bool]]:
    """Fits of ever greater effort, and whether each is of a global search."""
    if problem.hold:
        problem = _opened(problem)
    starts = [_row(model, problem, model.plant), problem.row.copy()]
    if problem.drive == "force":
        starts[1][K2] = starts[0][K2]
    rows: list[Array] = []
    for row in starts:
        straight = _straight(problem, row)
        yield straight, False
        near, whole = _local(problem, row)
        yield whole, False
        best = min((straight, near, whole), key=lambda one: one.chi_square)
        rows += [row, best.optimum.p]
        for seconds in STRETCH_SECONDS:
            yield _in_pieces(problem, row, seconds), False
            yield _in_pieces(problem, best.optimum.p, seconds), False
    for row in (rows[0], rows[3]):
        yield _near_by(problem, row, rng), True
    row = _searched(model, problem, rng)
    near, whole = _local(problem, row)
    yield whole, True
    yield _in_pieces(problem, near.optimum.p, STRETCH_SECONDS[-1]), True


def _row(model: InForce, problem: Problem, plant: Plant) -> Array:
    """Kernel parameters (11,) of a plant, driven as the model in force."""
    k1, k2 = 0.0, 0.0
    if problem.drive == "command" and isinstance(plant.actuator, Actuator):
        k1, k2 = plant.actuator.k1, plant.actuator.k2
    elif not problem.hold:
        k2 = model.stiffness or float(problem.row[K2])
    return kernel_parameters(plant.friction.array, k1, k2)


def _straight(problem: Problem, row: Array) -> _Fit:
    """The nearest minimum over the whole log; its start first, or the first step goes astray."""
    nothing = problem.free[:0]
    begun = refine(problem.long_runs, row, nothing)
    return _plain(problem, refine(begun.runs(problem.long_runs), row, problem.free))


def _local(problem: Problem, row: Array) -> tuple[_Fit, _Fit]:
    """The nearest minimum over windows that begin at rests, and from there over the whole log."""
    cap = problem.cap
    near = refine(problem.runs, row, problem.free, cap=cap)
    whole = refine(near.runs(problem.long_runs), near.p, problem.free, cap=cap)
    whole = refine(whole.runs(problem.long_runs), whole.p, problem.free)
    return _plain(problem, near), _plain(problem, whole)


def _in_pieces(problem: Problem, row: Array, seconds: float) -> _Fit:
    """The fit over stretches whose states are unknown, and how well it follows most of them.

    A stop can turn on less than the noise, and where it is lost a stretch is spoiled: what is far
    off has a bounded say, and the worst stretches are left out of the verdict.
    """
    cut = stretches(problem.runs, seconds)
    for free, cap in ((problem.free[:0], problem.cap), (problem.free, problem.cap)):
        near = refine(cut.all, row, free, cap=cap)
        cut, row = cut.begun(near.starts), near.p
    optimum = refine(cut.all, row, problem.free, cap=OUTLIER_BOUND)
    cut = cut.begun(optimum.starts)
    runs = tuple(cut.restarted())
    costs = [float(total_cost([part], optimum.p[None], 0.0)[0]) for part in cut.all]
    counts = np.array([part.measured.count for part in cut.all])
    order = np.argsort(np.array(costs) / counts)
    kept = order[: max(1, len(order) - max(1, int(LOST_STRETCHES * len(order))))]
    chi_square = float(np.sum(np.array(costs)[kept]) / np.sum(counts[kept]))
    shared = len(optimum.free)
    optimum = replace(
        optimum,
        starts=np.array([run.start for run in runs]),
        covariance=optimum.covariance[:shared, :shared],
    )
    return _Fit(replace(problem, runs=runs, stretched=True), optimum, chi_square)


def _near_by(problem: Problem, row: Array, rng: np.random.Generator) -> _Fit:
    """The best of a search close to a row over short stretches, from which a gradient goes on."""
    runs = stretches(problem.runs, STRETCH_SECONDS[-1]).restarted()
    free = problem.box.free[:9]
    size = np.abs(row[free])
    box = Box(free, size * (1.0 - CLOSE_SHARE), size * (1.0 + CLOSE_SHARE), row)
    first = box.around(row, REFIT_POPULATION, 0.2, rng)
    found = evolve(
        lambda z: total_cost(runs, box.rows(z), OUTLIER_BOUND), first, REFIT_GENERATIONS, rng
    )
    best = box.rows(found.members[:1])[0]
    whole = _straight(problem, best)
    pieces = _in_pieces(problem, best, STRETCH_SECONDS[-1])
    return min((whole, pieces), key=lambda one: one.chi_square)


def _searched(model: InForce, problem: Problem, rng: np.random.Generator) -> Array:
    """Kernel parameters (11,) of a global search."""
    if not problem.hold:
        plant = searched_plant(problem.logs, rng, rig=model.rig, drive=model.drive)
        return _row(model, problem, plant)

    def quiet(_stage: str, _share: float) -> None:
        pass

    return climb(problem, rng, quiet, CLIMBS[:1]).optimum.p


def _opened(problem: Problem) -> Problem:
    """The problem of a motor with each run's first position and velocity unknown."""
    runs = tuple(
        replace(run, open=(START_Y, START_V) if run.start[START_V] != 0.0 else (START_Y,))
        for run in problem.runs
    )
    return replace(problem, runs=runs)


def _told(found: _Fit, allowed: float, searched: bool, rng: np.random.Generator) -> LogEstimate:
    """The fit's parameters, how sure they are, and which of them the log tells."""
    problem, optimum = found.problem, found.optimum
    names = tuple((*NAMES, "k1", "k2")[int(i)] for i in optimum.free)
    center = optimum.p[optimum.free]
    covariance = _covariance(found)
    runs = [simulated(problem, optimum, i) for i in range(len(problem.logs))]
    events = events_of([run.mode for run in runs], [run.v for run in runs])
    samples = rng.multivariate_normal(center, covariance, DRAWN, check_valid="ignore")
    log = problem.logs[0].name
    told = estimates(names, center, samples, events, False, log)
    untold = {name: one.reason or "" for name, one in told.items() if one.value is None}
    return LogEstimate(names, center, covariance, untold, found.chi_square, allowed, searched)


def _covariance(found: _Fit) -> Array:
    """Covariance (d, d) of the shared parameters, widened where the residual is no white noise."""
    problem, optimum = found.problem, found.optimum
    shared = len(optimum.free)
    plain = optimum.covariance[:shared, :shared] * ROUGH[1] ** 2 * max(found.chi_square, 1.0)
    if problem.drive == "command" and found.chi_square <= problem.adequate:
        return np.asarray(plain)
    if not problem.stretched:
        runs = optimum.runs(problem.long_runs)
        scattered = robust_covariance(runs, optimum, OUTLIER_BOUND, SCATTER_PARTS)[:shared, :shared]
        if np.all(np.isfinite(scattered)):
            plain = _bounded(found, scattered, plain)
    if problem.drive == "force" and not problem.hold:
        plain = 2.0 * plain + np.diag((BETWEEN[optimum.free] * optimum.p[optimum.free]) ** 2)
    return np.asarray(plain)


def _bounded(found: _Fit, scattered: Array, plain: Array) -> Array:
    """The scatter of stretches, at most what as few independent samples would make of `plain`.

    One stretch with a missed stop would rule the scatter of a fit that follows the rest.
    """
    if found.chi_square > found.problem.adequate:
        return scattered
    residuals = [
        simulated(found.problem, found.optimum, i).y - log["y"]
        for i, log in enumerate(found.problem.logs)
    ]
    shrunk = max(sum(map(len, residuals)) / effective_samples(residuals), 1.0)
    most = np.maximum(np.diag(plain), 0.0) * shrunk
    ratio = np.sqrt(np.minimum(1.0, most / np.maximum(np.diag(scattered), 1e-300)))
    return np.asarray(scattered * np.outer(ratio, ratio))


def _stiff(model: InForce, h: float) -> bool:
    """Whether the model's body settles within a sample, so that it follows the force anyway.

    Its free run would take many steps a sample, and tell no more than the force equation.
    """
    p = model.plant.friction
    rate = max(p.F_vp, p.F_vn) / p.m + float(np.sqrt(model.stiffness / p.m))
    return rate * h > STIFF


def _imposed(model: InForce, problem: Problem, rng: np.random.Generator) -> LogEstimate:
    """Sliding friction under imposed motion, from the force equation."""
    fit = fit_imposed(problem, rng, model.rig, "as the model in force")
    every = fit.friction
    values = np.array([float(getattr(every, name)) for name in fit.free])
    untold = {n: e.reason or "" for n, e in fit.estimates.items() if e.value is None}
    # What a free run left is no measure of what the force equation leaves.
    allowed = LIKE * max(model.chi_square, 1.0) if model.imposed else np.inf
    return LogEstimate(fit.free, values, fit.covariance, untold, fit.chi_square, allowed, False)
