"""Joint refinement of all parameters on the simulated response (output error).

A global search over windows, Gauss-Newton over the whole run, then a cloud weighted by its
likelihood. Normalised chi-square tells whether the search found the fit: near 1 the model leaves
nothing but noise. Where no search brings it there, the model lacks something: the fit is then the
mean over all parameter sets that explain the log about equally, since the single best of them is
an accident (measured on EMPS: single optima give 3.3 to 9.3 mm on PULSES, the mean 3.1 to 3.4).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.arrays import Array
from identification.estimation.global_search import evolve
from identification.estimation.output_error.actuator_fit import ActuatorFit
from identification.estimation.output_error.cost import START_V, START_Y
from identification.estimation.output_error.fitted_runs import total_cost
from identification.estimation.output_error.growing_windows import CLIMB_ATTEMPTS as CLIMBS
from identification.estimation.output_error.growing_windows import Climb, climb
from identification.estimation.output_error.identifiability import estimates, events_of
from identification.estimation.output_error.imposed_motion import fit_imposed, is_imposed
from identification.estimation.output_error.local_search import Optimum, refine
from identification.estimation.output_error.problem import (
    ADEQUATE,
    Problem,
    plant_of,
    pose,
    simulated,
    start_of,
)
from identification.estimation.output_error.uncertainty import (
    Progress,
    Solution,
    weigh_correlated,
    weigh_misfit,
    weigh_noise,
    weigh_stretches,
)
from identification.log import Log, Rig
from identification.model.estimates import Drive, KarnoppFit, LogFit
from identification.model.karnopp import NAMES
from identification.model.plant import Actuator, Plant
from identification.simulation.free_run import FreeRun
from identification.simulation.karnopp_step import DV_N, DV_P, F_SN, F_SP, K1, K2

SEARCH_POPULATION = 64
SEARCH_GENERATIONS = 150
SEARCH_ATTEMPTS = 3
FIRST_CLIMBS = 3  # searches over stretches before one over long windows has its turn
WORTH_A_SEARCH = 300.0  # chi-square over windows up to which a fit is worth a closer search
ACTUATOR_MISFIT = 3.0  # times the sensors' noise from which the actuator is not linear
RIVAL = 3.0  # cost relative to the best up to which another optimum counts against it
IMPOSED_WHY = "the motion is imposed: inertia is of no account in the force"
NOT_ITS_OWN_MOTION = 50.0  # chi-square from which a force-driven run is not the body's own motion
NO_BETTER_SEARCH = 0.02  # relative gain of a new search below which the misfit is the model's


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
    if is_imposed(logs, rig):
        return fit_imposed(problem, rng, rig, IMPOSED_WHY)
    problem, solution = best_solution(problem, rng, report)
    remarks: list[str] = []
    actuator = problem.actuator
    if (
        problem.drive == "command"
        and drive is None
        and not solution.adequate
        and actuator is not None
        and actuator.relative > 0.02
        and actuator.rms > ACTUATOR_MISFIT * _sensor_noise(problem, actuator)
    ):
        remarks.append(
            f"the linear actuator leaves {100 * actuator.relative:.1f} % of the force (chi-square"
            f" {solution.chi_square:.3g}), so the run was driven by the logged force"
        )
        problem = pose(logs, rig, "force")
        problem, solution = best_solution(problem, rng, report)
    if problem.drive == "force" and not problem.hold and solution.chi_square > NOT_ITS_OWN_MOTION:
        why = f"no free run follows this log (chi-square {solution.chi_square:.3g})"
        return fit_imposed(problem, rng, rig, why, remarks)
    return _result(problem, solution, actuator, rig, remarks)


def searched_plant(
    logs: Sequence[Log], rng: np.random.Generator, *, rig: Rig, drive: Drive
) -> Plant:
    """The plant of one search for the nine parameters, without intervals; raises as `fit_karnopp`.

    drive: "command" (of a motor too) or "force".
    """

    def quiet(_stage: str, _share: float) -> None:
        pass

    problem = pose(logs, rig, None if rig.kind == "motor" else drive)
    if problem.hold:
        found = climb(_opened(problem), rng, quiet, CLIMBS[:FIRST_CLIMBS]).optimum
    else:
        found, _ = _search(problem, rng, SEARCH_POPULATION, 0, quiet)
    return plant_of(problem, found)


def _sensor_noise(problem: Problem, actuator: ActuatorFit) -> float:
    """What the sensors alone leave of the actuator equation [N], root mean square."""
    squares = []
    for run in problem.runs:
        y, force = 1.0 / run.measured.weight_y, 1.0 / run.measured.weight_force
        squares.append(force**2 + (actuator.k2 * y) ** 2)
    return float(np.sqrt(np.mean(squares)))


def best_solution(
    problem: Problem, rng: np.random.Generator, report: Progress
) -> tuple[Problem, Solution]:
    """Search, refine and weigh until the fit is found or the misfit is the model's own.

    The problem comes back with restarts where only stretches of the logs are followed.
    """
    enough = problem.adequate * problem.count
    # A stream of its own: the climb does not change what the searches after it draw.
    aside = rng.spawn(1)[0]
    climbs: list[Climb] = []
    if problem.hold:
        climbs = [climb(_opened(problem), aside, report, CLIMBS[:FIRST_CLIMBS])]
        if climbs[0].found and climbs[0].sure:
            return _weighed(climbs[0], rng, report)
    optima, members = _attempts(problem, rng, report)
    if problem.drive == "command" and min(one.cost for one in optima) > enough:
        climbs = [climb(problem, aside, report)]
        one = climbs[0].optimum if climbs[0].found else _through_force(problem, rng, report)
        optima.append(one)
    best = min(optima, key=lambda one: one.cost)
    spent = sum(one.evaluations for one in optima)
    if best.cost <= ADEQUATE * problem.count and problem.drive == "command":
        return problem, weigh_noise(problem, best, rng, spent, report)
    if problem.hold:
        opened = _opened(problem)
        closer = min((_closer(opened, one, rng) for one in optima), key=lambda one: one.cost)
        if closer.cost > ADEQUATE * problem.count and not climbs[0].hopeless:
            climbs.append(climb(opened, aside, report, CLIMBS[FIRST_CLIMBS:]))
        whole = min((one.optimum.cost for one in climbs if one.found), default=np.inf)
        if closer.cost <= min(ADEQUATE * problem.count, whole):
            return problem, weigh_noise(opened, closer, rng, spent, report)
    for climbed in sorted(climbs, key=lambda one: (not one.found, one.optimum.cost)):
        if climbed.followed:
            return _weighed(climbed, rng, report)
    if not problem.hold:
        rivals = [one.p for one in optima if one.cost < RIVAL * best.cost]
        return problem, weigh_correlated(problem, best, np.array(rivals), rng, spent)
    of_best = members[[one.cost for one in optima].index(best.cost)]
    return problem, weigh_misfit(problem, best, of_best, rng, spent, report)


def _attempts(
    problem: Problem, rng: np.random.Generator, report: Progress
) -> tuple[list[Optimum], list[Array]]:
    """Optima and last members of searches over long windows until one is adequate."""
    optima: list[Optimum] = []
    members: list[Array] = []
    enough = problem.adequate * problem.count
    attempts = SEARCH_ATTEMPTS if problem.drive == "command" else SEARCH_ATTEMPTS - 1
    for attempt in range(attempts):
        size = SEARCH_POPULATION * (2 if attempt == SEARCH_ATTEMPTS - 1 else 1)
        found, searched = _search(problem, rng, size, attempt, report)
        members.append(searched)
        before = min((one.cost for one in optima), default=np.inf)
        optima.append(found)
        report("refining", attempt / attempts)
        if min(before, found.cost) <= enough:
            break
        if attempt > 0 and found.cost > before * (1 - NO_BETTER_SEARCH):
            break
    return optima, members


def _weighed(
    climbed: Climb, rng: np.random.Generator, report: Progress
) -> tuple[Problem, Solution]:
    """What a climb found, weighed over whole runs, or over the stretches that it follows."""
    problem, optimum = climbed.problem, climbed.optimum
    if climbed.found:
        return problem, weigh_noise(problem, optimum, rng, optimum.evaluations, report)
    runs = tuple(climbed.cut.restarted())
    problem = replace(problem, runs=runs, stretched=True)
    return problem, weigh_stretches(problem, optimum, rng, optimum.evaluations)


def _closer(opened: Problem, found: Optimum, rng: np.random.Generator) -> Optimum:
    """The optimum with its starts fitted too: over windows, near by, then over the whole."""
    cap = opened.cap
    near = refine(opened.runs, found.p, opened.free, cap=cap)
    whole = refine(near.runs(opened.long_runs), near.p, opened.free, cap=cap)
    whole = refine(whole.runs(opened.long_runs), whole.p, opened.free)
    if whole.cost > ADEQUATE * opened.count and near.cost < WORTH_A_SEARCH * opened.count:
        rescued = _search_near(opened, near, cap, rng)
        whole = rescued if rescued.cost < whole.cost else whole
    return whole


def _opened(problem: Problem) -> Problem:
    """The problem with each run's first position and velocity unknown."""
    runs = tuple(
        replace(run, open=(START_Y, START_V) if run.start[START_V] != 0.0 else (START_Y,))
        for run in problem.runs
    )
    return replace(problem, runs=runs)


def _through_force(problem: Problem, rng: np.random.Generator, report: Progress) -> Optimum:
    """A fit by command that starts from one by the measured force, whose landscape is smoother."""
    other = pose(problem.logs, Rig("force"), "force")
    found, _ = _search(other, rng, SEARCH_POPULATION, 0, report)
    row = np.concatenate([found.p[:9], problem.row[[K1, K2]]])
    cap = problem.cap
    near = refine(problem.runs, row, problem.free, cap=cap)
    optimum = _search_near(problem, near, cap, rng)
    spent = found.evaluations + near.evaluations + optimum.evaluations
    return replace(optimum, evaluations=spent)


def _search(
    problem: Problem, rng: np.random.Generator, size: int, attempt: int, report: Progress
) -> tuple[Optimum, Array]:
    """One global search over windows, its best member refined over the whole run, and all members
    as kernel parameters (k, 11), best first."""
    cap = problem.cap * 25.0**attempt
    # A search that failed may have looked around a bad first estimate.
    box, runs = problem.box.wider(3.0**attempt), problem.runs
    # k1 and k2 come from the regression: searched over in the refinement only.
    population = evolve(
        lambda z: total_cost(runs, box.rows(z), cap),
        box.around(problem.row, size, 0.15, rng),
        SEARCH_GENERATIONS,
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
    lost = optimum.cost > problem.adequate * problem.count
    if lost and problem.drive == "command" and near.cost < WORTH_A_SEARCH * problem.count:
        report("searching near", 0.0)
        rescued = _search_near(problem, near, cap, rng)
        spent += rescued.evaluations
        optimum = rescued if rescued.cost < optimum.cost else optimum
    return replace(optimum, evaluations=spent), box.rows(population.members)


def _search_near(problem: Problem, near: Optimum, cap: float, rng: np.random.Generator) -> Optimum:
    """Search over whole runs around a fit that follows the windows but lost the whole.

    Windows begin with a measured velocity, whose noise shifts their optimum a little: enough to
    make the whole run stop elsewhere, which no gradient mends.
    """
    row = near.p
    values = np.abs(row[problem.box.free])
    close = np.where(np.isin(problem.box.free, (F_SP, F_SN)), 0.2, 0.02)
    close = np.where(np.isin(problem.box.free, (DV_P, DV_N)), 0.5, close)
    low, high = values * (1 - close), values * (1 + close)
    box = replace(problem.box, low=low, high=high, row=row)
    whole = list(near.runs(problem.long_runs))
    found = evolve(
        lambda z: total_cost(whole, box.rows(z), cap),
        box.around(row, SEARCH_POPULATION, 0.2, rng),
        SEARCH_GENERATIONS,
        rng,
    )
    optimum = refine(whole, box.rows(found.members[:1])[0], problem.free, cap=cap)
    optimum = refine(optimum.runs(whole), optimum.p, problem.free)
    return replace(optimum, evaluations=optimum.evaluations + found.evaluations)


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
    plant = plant_of(problem, optimum)
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
        noise_y=solution.noise[0],
        noise_F=solution.noise[1],
        chi_square=solution.chi_square,
        adequate=solution.adequate,
        logs=tuple(_log_fit(problem, optimum, runs[i], i) for i in range(len(runs))),
        breakaways=events.breakaways,
        evaluations=solution.evaluations,
        remarks=(*remarks, *_remarks(problem, solution)),
    )


def _log_fit(problem: Problem, optimum: Optimum, run: FreeRun, index: int) -> LogFit:
    log = problem.logs[index]
    position = run.y - log["y"]
    weight = problem.runs[index].measured.weight_y
    force = None
    if problem.drive == "command":
        force = float(np.sqrt(np.mean((run.F - log["F"]) ** 2)))
    return LogFit(
        log=log.name,
        start=start_of(problem, optimum, index),
        position_rms=float(np.sqrt(np.mean(position**2))),
        force_rms=force,
        chi_square=float(np.mean((position * weight) ** 2)),
    )


def _remarks(problem: Problem, solution: Solution) -> list[str]:
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
    if problem.stretched:
        count = sum(len(run.windows.at) for run in problem.runs)
        out.append(
            f"the model follows {count} stretches of the logs, each begun anew, but not the whole:"
            " a stop there turns on less than the noise"
        )
    return out
