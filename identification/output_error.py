"""Joint refinement of all parameters on the simulated response (output error).

A global search over windows, Gauss-Newton over the whole run, then a cloud weighted by its
likelihood. Normalised chi-square tells whether the search found the fit: near 1 the model leaves
nothing but noise. Where no search brings it there, the model lacks something: the fit is then the
mean over all parameter sets that explain the log about equally, since the single best of them is
an accident (measured on EMPS: single optima give 3.3 to 9.3 mm on PULSES, the mean 3.1 to 3.4).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.actuator import ActuatorFit, fit_actuator
from identification.arrays import Array, IntArray
from identification.box import Box, search_box
from identification.ensemble import ensemble
from identification.errors import BadLog
from identification.experiment import Run, impulse_of, noise_of, prepare_run, total_cost
from identification.identifiability import Events, estimates, events_of
from identification.karnopp import NAMES, Karnopp
from identification.log import Log, Rig
from identification.objective import START_G, START_V, START_Y
from identification.plant import Actuator, Motor, Plant
from identification.refine import (
    Cloud,
    Optimum,
    keep_near,
    moved,
    pack,
    refine,
    robust_covariance,
    sample,
    unpack,
)
from identification.residual_tests import effective_samples
from identification.result import Drive, KarnoppFit, LogFit
from identification.search import Population, evolve
from identification.simulate import FreeRun, free_run
from identification.stepping import DV_N, DV_P, K1, K2
from identification.three_step import FirstEstimate, first_estimate

Progress = Callable[[str, float], None]
ADEQUATE = 1.5  # normalised chi-square up to which a fit counts as found
POPULATION = 64
GENERATIONS = 150
ATTEMPTS = 3
FOLLOWS = 1e4  # chi-square over windows up to which a fit is worth a closer search
SAME = 0.02  # relative gain of a new search below which the misfit is the model's
LONGEST = 40.0  # s; a run without a stiffness that holds it is compared at most this long
FEWEST, MOST = 12.0, 400.0  # independent samples granted to a residual that is not noise
OUTLIER = 25.0  # bound of a squared residual where stops may be missed
BETWEEN = 5e-4  # relative sd that the force between samples adds where it drives the run
STRETCHES = 40  # parts of the logs whose scatter gives the spread of correlated residuals
ROUGH = 1.15  # what the walls of the likelihood add to its spread: coverage of 40 seeds chose it
WALKERS = 64
STEPS = 200
LONG_WALK = 600


@dataclass(frozen=True)
class Problem:
    """Logs, how they are driven, and where to look."""

    logs: tuple[Log, ...]
    runs: tuple[Run, ...]
    firsts: tuple[FirstEstimate, ...]
    box: Box
    row: Array
    free: IntArray
    drive: Drive
    hold: bool
    actuator: ActuatorFit | None

    @property
    def adequate(self) -> float:
        """Chi-square up to which a fit counts as found; a measured force brings its own noise."""
        return ADEQUATE if self.drive == "command" else 2.0 * ADEQUATE

    @property
    def count(self) -> int:
        """Number of compared values."""
        return sum(run.measured.count for run in self.runs)

    @property
    def long_runs(self) -> tuple[Run, ...]:
        """Runs as long as the model may be asked to follow without a restart."""
        if self.drive == "command":
            return tuple(run.whole() for run in self.runs)
        if not self.hold:
            return self.runs
        out = []
        for run in self.runs:
            at = run.windows.at * run.measured.h
            keep = np.concatenate([[True], np.diff(np.floor(at / LONGEST)) > 0])
            windows = replace(
                run.windows, at=run.windows.at[keep], y=run.windows.y[keep], v=run.windows.v[keep]
            )
            out.append(replace(run, windows=windows))
        return tuple(out)


@dataclass(frozen=True)
class Solution:
    """Optimum, equally likely samples (k, free), and how it was reached."""

    optimum: Optimum
    samples: Array
    chi_square: float
    adequate: bool
    evaluations: int


def fit_karnopp(
    logs: Sequence[Log],
    rng: np.random.Generator,
    *,
    rig: Rig,
    drive: Drive | None = None,
    on_progress: Progress | None = None,
) -> KarnoppFit:
    """The nine parameters, with the actuator's k1 and k2 where the command is logged.

    logs: each with y [m] and F [N] (F_e), and u [V] for a drive by command, on an even clock.
    drive: "command" or "force"; by default the command where a linear actuator explains the
    force. Raises BadLog where a signal is missing, NotIdentifiable where nothing moves.
    """
    report = on_progress or (lambda _stage, _share: None)
    problem = pose(logs, rig, drive)
    solution = solve(problem, rng, report)
    remarks: list[str] = []
    actuator = problem.actuator
    if (
        problem.drive == "command"
        and drive is None
        and not solution.adequate
        and actuator is not None
        and actuator.relative > 0.02
    ):
        remarks.append(
            f"the linear actuator leaves {100 * actuator.relative:.1f} % of the force (chi-square"
            f" {solution.chi_square:.3g}), so the run was driven by the logged force"
        )
        problem = pose(logs, rig, "force")
        solution = solve(problem, rng, report)
    return _result(problem, solution, actuator, rig, remarks)


def pose(logs: Sequence[Log], rig: Rig, drive: Drive | None) -> Problem:
    """The logs as a fitting problem: drive chosen, noise estimated, search box drawn."""
    for log in logs:
        if "F" not in log:
            raise BadLog(
                f"{log.name}: no applied force; give the card F, both pressures, or"
                " force_per_command with u"
            )
    hold = rig.kind == "motor"
    firsts = tuple(first_estimate(log, held=hold) for log in logs)
    with_command = not hold and all("u" in log and np.ptp(log["u"]) > 0 for log in logs)
    actuator = fit_actuator(logs) if with_command else None
    if drive == "command" and not hold and actuator is None:
        raise BadLog(f"{logs[0].name}: drive by command asked for, but no command u is logged")
    chosen: Drive = "force"
    if actuator and drive != "force" and (actuator.plausible or drive == "command"):
        chosen = "command"
    by_command = chosen == "command" and actuator is not None
    k1 = actuator.k1 if actuator and by_command else 0.0
    k2 = actuator.k2 if actuator and by_command else 0.0
    window = 5.0 if hold else (1.0 if by_command else 2.0)
    runs = tuple(
        prepare_run(
            log,
            first,
            chosen,
            constant=float(actuator.constants[i]) if actuator and by_command else 0.0,
            window=window,
            hold=hold,
            noise=_noise(log, first, actuator if by_command else None),
        )
        for i, (log, first) in enumerate(zip(logs, firsts, strict=True))
    )
    stiffness = None if by_command or hold else _stiffness_bounds(logs, firsts)
    box, row = search_box(firsts, k1, k2, stiffness)
    free = box.free
    if by_command:
        free = np.concatenate([box.free, np.array([K1, K2], dtype=np.int64)])
    return Problem(tuple(logs), runs, firsts, box, row, free, chosen, hold, actuator)


def _noise(log: Log, first: FirstEstimate, actuator: ActuatorFit | None) -> tuple[float, float]:
    """Noise of position [m] and force [N]; what the actuator explains of the force is no noise."""
    force = log["F"]
    if actuator is not None:
        force = force - actuator.k1 * impulse_of(log) + actuator.k2 * first.motion.y
    return noise_of(log["y"], log.h), noise_of(force, log.h)


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


def solve(problem: Problem, rng: np.random.Generator, report: Progress) -> Solution:
    """Search, refine and weigh until the fit is found or the misfit is the model's own."""
    best: Optimum | None = None
    population: Population | None = None
    spent = 0
    for attempt in range(ATTEMPTS):
        size = POPULATION * 2**attempt
        found, population = _search(problem, rng, size, attempt, report)
        spent += found.evaluations
        report("refining", attempt / ATTEMPTS)
        if best is None or found.cost < best.cost * (1 - SAME):
            best = found
        elif found.cost > best.cost * (1 - SAME):
            best = found if found.cost < best.cost else best
            if best.cost > problem.adequate * problem.count and attempt > 0:
                break
        if best.cost <= problem.adequate * problem.count:
            break
    assert best is not None and population is not None
    chi_square = best.cost / problem.count
    if chi_square <= ADEQUATE and problem.drive == "command":
        return _weigh_noise(problem, best, rng, spent, report)
    if not problem.hold:
        return _weigh_correlated(problem, best, rng, spent)
    return _weigh_misfit(problem, best, population, rng, spent, report)


def _search(
    problem: Problem, rng: np.random.Generator, size: int, attempt: int, report: Progress
) -> tuple[Optimum, Population]:
    """One global search over windows, and its best member refined over the whole run."""
    cap = _cap(problem, attempt)
    box, runs = problem.box, problem.runs
    # k1 and k2 come from the regression: searched over in the refinement only.
    population = evolve(
        lambda z: total_cost(runs, box.rows(z), cap),
        box.around(problem.row, size, 0.15, rng),
        GENERATIONS,
        rng,
        lambda share: report("searching", share),
    )
    start = box.rows(population.members[:1])[0]
    near = refine(runs, start, problem.free, cap=cap)
    whole = list(problem.long_runs)
    optimum = near
    for bound in (cap, 0.0):
        whole = optimum.runs(whole)
        optimum = refine(whole, optimum.p, problem.free, cap=bound)
    spent = population.evaluations + near.evaluations + optimum.evaluations
    if optimum.cost > problem.adequate * problem.count and near.cost < FOLLOWS * problem.count:
        report("searching near", 0.0)
        rescued = _search_near(problem, near, cap, rng)
        spent += rescued.evaluations
        optimum = rescued if rescued.cost < optimum.cost else optimum
    return replace(optimum, evaluations=spent), population


def _search_near(problem: Problem, near: Optimum, cap: float, rng: np.random.Generator) -> Optimum:
    """Search over whole runs around a fit that follows the windows but lost the whole.

    Windows begin with a measured velocity, whose noise shifts their optimum a little: enough to
    make the whole run stop elsewhere, which no gradient mends.
    """
    row = near.p
    values = np.abs(row[problem.box.free])
    close = np.where(np.isin(problem.box.free, (DV_P, DV_N, K2)), 0.1, 0.01)
    low, high = values * (1 - close), values * (1 + close)
    box = replace(problem.box, low=low, high=high, row=row)
    whole = list(near.runs(problem.long_runs))
    found = evolve(
        lambda z: total_cost(whole, box.rows(z), cap),
        box.around(row, POPULATION, 0.2, rng),
        GENERATIONS // 2,
        rng,
    )
    optimum = refine(whole, box.rows(found.members[:1])[0], problem.free, cap=cap)
    optimum = refine(optimum.runs(whole), optimum.p, problem.free)
    return replace(optimum, evaluations=optimum.evaluations + found.evaluations)


def _cap(problem: Problem, attempt: int) -> float:
    """Bound of a squared residual: wide of the noise, and of a fiftieth of the motion."""
    noise = max(
        (0.02 * float(np.std(run.measured.y)) * run.measured.weight_y) ** 2 for run in problem.runs
    )
    return float(max(1e4, noise) * 25.0**attempt)


def _weigh_noise(
    problem: Problem, optimum: Optimum, rng: np.random.Generator, spent: int, report: Progress
) -> Solution:
    """A fit that leaves noise: its level taken from the residual, then the likelihood's cloud."""
    runs = list(optimum.runs(problem.long_runs))
    for _ in range(4):
        runs = [_reweighed(run, optimum.p) for run in optimum.runs(runs)]
        before = optimum
        optimum = refine(runs, optimum.p, problem.free)
        spent += optimum.evaluations
        if np.allclose(optimum.p, before.p, rtol=1e-6):
            break
    report("weighing", 0.0)
    cloud = sample(runs, optimum, rng)
    spent += cloud.evaluations
    if cloud.settled:
        index = rng.choice(len(cloud.weights), 1024, p=cloud.weights)
        members = cloud.members[index]
    else:
        members = _walk(problem, runs, optimum, _seeds(cloud, rng), STEPS, None, rng, report)
        members = _widened(members, optimum.covariance)
        spent += WALKERS * STEPS
    members = np.mean(members, axis=0) + ROUGH * (members - np.mean(members, axis=0))
    optimum = _centred(runs, optimum, members)
    # Against the noise seen in the signals themselves, not against that of the residual.
    as_logged = optimum.runs(problem.long_runs)
    chi_square = float(total_cost(as_logged, optimum.p[None], 0.0)[0]) / problem.count
    return Solution(optimum, members, chi_square, True, spent)


def _weigh_correlated(
    problem: Problem, optimum: Optimum, rng: np.random.Generator, spent: int
) -> Solution:
    """A fit whose residual is not white: outliers bounded, spread from stretches of the logs."""
    chi_square = optimum.cost / problem.count
    runs = list(optimum.runs(problem.long_runs))
    for _ in range(3):
        bodies = [_bodies(problem, optimum, index) for index in range(len(runs))]
        runs = [
            replace(run, measured=replace(run.measured, weight_y=1 / y, weight_force=w))
            for run, (y, w) in zip(optimum.runs(runs), bodies, strict=True)
        ]
        optimum = refine(runs, optimum.p, problem.free, cap=OUTLIER)
        spent += optimum.evaluations
    covariance = robust_covariance(runs, optimum, OUTLIER, STRETCHES)
    if problem.drive == "force":
        # What the force does between samples is not known: it is taken as linear.
        floor = BETWEEN * np.abs(pack(runs, optimum.p, optimum.starts, optimum.free))
        covariance = 2.0 * covariance + np.diag(floor**2)
    center = pack(runs, optimum.p, optimum.starts, optimum.free)
    members = rng.multivariate_normal(center, covariance, 1024, check_valid="ignore")
    keep_near(members, optimum.free, optimum.p)
    optimum = replace(optimum, covariance=covariance)
    return Solution(optimum, members, chi_square, chi_square <= problem.adequate, spent)


def _weigh_misfit(
    problem: Problem,
    optimum: Optimum,
    population: Population,
    rng: np.random.Generator,
    spent: int,
    report: Progress,
) -> Solution:
    """A fit that leaves more than noise: the mean over all sets that explain the log as well.

    The residual counts for as many independent samples as its correlation leaves of it, at least
    FEWEST; a set is then as likely as (mean square)^(-n/2).
    """
    runs = optimum.runs(problem.long_runs)
    chi_square = optimum.cost / problem.count
    residuals = [simulated(problem, optimum, i).y - log["y"] for i, log in enumerate(problem.logs)]
    granted = float(np.clip(effective_samples(residuals), FEWEST, MOST))
    rows = problem.box.rows(population.members[: WALKERS // 2])
    rows[:, [K1, K2]] = np.where(problem.free[-1] == K2, rows[:, [K1, K2]], optimum.p[[K1, K2]])
    seeds = np.array([pack(runs, row, optimum.starts, problem.free) for row in rows])
    around = _jitter(runs, optimum, WALKERS - len(seeds), rng)
    seeds = np.concatenate([around, _jittered_starts(seeds, problem, runs, rng)])
    members = _walk(problem, runs, optimum, seeds, LONG_WALK, granted, rng, report)
    spent += WALKERS * LONG_WALK
    covariance = np.cov(members.T)
    optimum = moved(runs, optimum, np.mean(members, axis=0), covariance)
    adequate = chi_square <= problem.adequate
    return Solution(optimum, members, chi_square, adequate, spent)


def _walk(
    problem: Problem,
    runs: Sequence[Run],
    optimum: Optimum,
    seeds: Array,
    steps: int,
    granted: float | None,
    rng: np.random.Generator,
    report: Progress,
) -> Array:
    """Samples (k, d) of walkers from `seeds`; granted: independent samples of a misfit."""

    def cost(members: Array) -> Array:
        sets, begun = unpack(runs, optimum.p, optimum.starts, optimum.free, members)
        inside = problem.box.holds(sets)
        values = np.full(len(members), np.inf)
        if inside.any():
            begun = np.ascontiguousarray(begun[:, inside])
            values[inside] = total_cost(runs, sets[inside], 0.0, begun)
        if granted is not None:
            return granted * np.log(values / problem.count)
        return values

    walk = ensemble(cost, seeds, steps, rng, lambda share: report("weighing", share))
    keep = rng.choice(len(walk.samples), min(1024, len(walk.samples)), replace=False)
    return walk.samples[keep]


def _seeds(cloud: Cloud, rng: np.random.Generator) -> Array:
    """Walkers (WALKERS, d) from the best members of a cloud that did not settle."""
    order = np.argsort(cloud.costs)[: WALKERS // 2]
    members = cloud.members[order]
    pairs = rng.integers(0, len(members), (WALKERS - len(members), 2))
    between = 0.5 * (members[pairs[:, 0]] + members[pairs[:, 1]])
    return np.concatenate([members, between])


def _widened(members: Array, covariance: Array) -> Array:
    """Samples (k, d) spread, about their mean, at least as widely as `covariance` (d, d).

    Walls in the likelihood can hold walkers in one of its chambers, narrower than the whole.
    """
    mean = np.mean(members, axis=0)
    spread = np.maximum(np.std(members, axis=0), 1e-300)
    factor = np.maximum(1.0, np.sqrt(np.diag(covariance)) / spread)
    return np.asarray(mean + factor * (members - mean))


def _jitter(runs: Sequence[Run], optimum: Optimum, count: int, rng: np.random.Generator) -> Array:
    """Walkers (count, d) a percent around the optimum."""
    theta = pack(runs, optimum.p, optimum.starts, optimum.free)
    return theta + 0.01 * optimum.scale * rng.standard_normal((count, len(theta)))


def _jittered_starts(
    seeds: Array, problem: Problem, runs: Sequence[Run], rng: np.random.Generator
) -> Array:
    """Seeds (k, d) with the runs' starts spread by their noise, so that no two agree."""
    low = len(problem.free)
    out = seeds.copy()
    for run in runs:
        sigma = 1.0 / run.measured.weight_y
        for entry in run.open:
            spread = {START_Y: sigma, START_V: 0.1 * sigma / run.measured.h, START_G: 1e-3}[entry]
            out[:, low] += spread * rng.standard_normal(len(seeds))
            low += 1
    return out


def _reweighed(run: Run, p: Array) -> Run:
    """The run with its noise levels set to what the fit leaves."""
    y = _channel(run, p, True)
    force = _channel(run, p, False) if run.measured.weight_force > 0 else 0.0
    measured = replace(
        run.measured,
        weight_y=1.0 / y,
        weight_force=1.0 / force if force > 0 else 0.0,
    )
    return replace(run, measured=measured)


def _bodies(problem: Problem, optimum: Optimum, index: int) -> tuple[float, float]:
    """Robust spread of the position's residual [m] and weight of the force's (0: not compared)."""
    run, log = simulated(problem, optimum, index), problem.logs[index]
    floor = 1.0 / problem.runs[index].measured.weight_y
    y = max(1.4826 * float(np.median(np.abs(run.y - log["y"]))), 0.5 * floor)
    if problem.drive != "command":
        return y, 0.0
    return y, 1.0 / max(1.4826 * float(np.median(np.abs(run.F - log["F"]))), 1e-300)


def _channel(run: Run, p: Array, position: bool) -> float:
    """Root mean square residual of the position [m] or the force [N]."""
    measured = replace(
        run.measured,
        weight_y=1.0 if position else 0.0,
        weight_force=0.0 if position else 1.0,
    )
    one = replace(run, measured=measured)
    return float(np.sqrt(total_cost([one], p[None], 0.0)[0] / len(measured.y)))


def _centred(runs: Sequence[Run], optimum: Optimum, members: Array) -> Optimum:
    """The optimum at the members' mean, or at the best point where the mean falls off a ridge."""
    mean = np.mean(members, axis=0)
    covariance = np.atleast_2d(np.cov(members.T))
    center = moved(runs, optimum, mean, covariance)
    if center.cost <= optimum.cost + 2.0 * len(mean) + 20.0:
        return center
    sets, begun = unpack(runs, optimum.p, optimum.starts, optimum.free, members)
    costs = total_cost(runs, sets, 0.0, begun)
    best = int(np.argmin(costs))
    if costs[best] < optimum.cost:
        return moved(runs, optimum, members[best], covariance)
    return replace(optimum, covariance=covariance)


def simulated(problem: Problem, optimum: Optimum, index: int) -> FreeRun:
    """Free run of the fitted model along one log, from its fitted start."""
    plant = _plant(problem, optimum)
    stiffness = 0.0 if problem.drive == "command" or problem.hold else float(optimum.p[K2])
    drive: Drive = "command" if problem.drive == "command" or problem.hold else "force"
    run = problem.long_runs[index]
    restarts = (run.windows.at, run.windows.y, run.windows.v)
    start = _start(problem, optimum, index)
    log = problem.logs[index]
    return free_run(plant, log, start, drive, stiffness=stiffness, restarts=restarts)


def _plant(problem: Problem, optimum: Optimum) -> Plant:
    friction = Karnopp.from_array(optimum.p[:9])
    if problem.drive == "command":
        return Plant(friction, Actuator(float(optimum.p[K1]), float(optimum.p[K2])))
    if problem.hold:
        log = problem.logs[0]
        moved_most = int(np.argmax(np.abs(log["u"])))
        return Plant(friction, Motor(float(log["F"][moved_most] / log["u"][moved_most])))
    return Plant(friction)


def _start(problem: Problem, optimum: Optimum, index: int) -> tuple[float, float, float]:
    y, v, constant = (float(x) for x in optimum.starts[index])
    force = float(problem.logs[index]["F"][0])
    if problem.drive == "command":
        force = constant - float(optimum.p[K2]) * y
    return y, v, force


def _result(
    problem: Problem,
    solution: Solution,
    actuator: ActuatorFit | None,
    rig: Rig,
    remarks: Sequence[str],
) -> KarnoppFit:
    """The solution as estimates with intervals, reasons, and errors a log."""
    optimum = solution.optimum
    runs = [simulated(problem, optimum, i) for i in range(len(problem.logs))]
    events = events_of([run.mode for run in runs], [run.v for run in runs])
    names = (*NAMES, "k1", "k2")
    used = [names[int(i)] for i in problem.free]
    center = optimum.p[problem.free]
    samples = solution.samples[:, : len(problem.free)]
    name = problem.logs[0].name if len(problem.logs) == 1 else f"{len(problem.logs)} logs"
    keep = [i for i, key in enumerate(used) if problem.drive == "command" or key in NAMES]
    found = estimates(
        [used[i] for i in keep], center[keep], samples[:, keep], events,
        rig.motion == "rotary", name,
    )  # fmt: skip
    plant = _plant(problem, optimum)
    fitted = plant.actuator
    if fitted is None and actuator is not None and actuator.plausible:
        fitted = Actuator(actuator.k1, actuator.k2)
    return KarnoppFit(
        friction=plant.friction,
        actuator=fitted,
        estimates=found,
        free=tuple(used[i] for i in keep),
        covariance=np.atleast_2d(np.cov(samples[:, keep].T)),
        samples=samples[:, keep],
        drive="command" if problem.hold else problem.drive,
        stiffness=0.0 if problem.drive == "command" or problem.hold else float(optimum.p[K2]),
        noise_y=1.0 / problem.runs[0].measured.weight_y,
        noise_F=_noise_force(problem, runs),
        chi_square=solution.chi_square,
        adequate=solution.adequate,
        logs=tuple(_log_fit(problem, optimum, runs[i], i) for i in range(len(runs))),
        breakaways=events.breakaways,
        evaluations=solution.evaluations,
        remarks=(*remarks, *_remarks(problem, solution, events)),
    )


def _noise_force(problem: Problem, runs: Sequence[FreeRun]) -> float:
    if problem.drive != "command":
        return 0.0
    return 1.0 / problem.runs[0].measured.weight_force


def _log_fit(problem: Problem, optimum: Optimum, run: FreeRun, index: int) -> LogFit:
    log = problem.logs[index]
    position = run.y - log["y"]
    weight = problem.runs[index].measured.weight_y
    force = None
    if problem.drive == "command":
        force = float(np.sqrt(np.mean((run.F - log["F"]) ** 2)))
    return LogFit(
        log=log.name,
        start=_start(problem, optimum, index),
        position_rms=float(np.sqrt(np.mean(position**2))),
        force_rms=force,
        chi_square=float(np.mean((position * weight) ** 2)),
    )


def _remarks(problem: Problem, solution: Solution, events: Events) -> list[str]:
    out = []
    if not solution.adequate:
        out.append(
            f"the model leaves {np.sqrt(solution.chi_square):.3g} times the sensors' noise:"
            " an effect is missing, or the structure is wrong; intervals are widened for it"
        )
    if problem.drive == "force" and not problem.hold:
        out.append(
            "driven by the measured force, held to the measured position by"
            f" {solution.optimum.p[K2]:.4g} N/m: no command explains the force"
        )
    return out
