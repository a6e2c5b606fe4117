"""From residual to missing effect: what the plain model leaves, which effect explains it, and the
error before and after on data that neither the fit nor the choice has seen.

The choice is made on the two equations in weak form and on rest and breakaway (`stepwise`);
the plant with the effects found is then refined on its free run (`refinement`).
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from identification.effects._library import Library
from identification.errors import NotIdentifiable, UserError
from identification.estimation.output_error.karnopp_fit import searched_plant
from identification.estimation.regression.equation_rows import (
    ACTUATOR,
    MECHANICAL,
    Fitted,
    MotionLog,
    actuator,
    motion_log,
    solve_rows,
    stacked,
)
from identification.estimation.windowed_run.refinement import COMPLETE, loose, misfit, refit
from identification.log import Log, Rig
from identification.model.estimates import Drive
from identification.model.plant import units_of
from identification.signals.check import check_driven
from identification.tracing.constant_force import beyond_friction, constant_remark
from identification.tracing.free_run.backward_elimination import (
    DECISIVE,
    Setting,
    doubted,
    equations_explained,
    fewest,
    first_alone,
    suffices,
)
from identification.tracing.free_run.fitted_structure import (
    MUCH,
    FittedStructure,
    band,
    fitted_structure,
    inertia_is_lost,
)
from identification.tracing.free_run.forward_selection import at_once, judged_forward
from identification.tracing.free_run.rivals import told_apart
from identification.tracing.free_run.trial_structures import driven_only
from identification.tracing.imposed_motion import inertia_has_no_part
from identification.tracing.model_errors import carries, errors_of, row_noise, share_left
from identification.tracing.parameter_drift import parameter_drift
from identification.tracing.regression.candidates import best_of
from identification.tracing.regression.row_fit import base_fits, mean_square
from identification.tracing.regression.stepwise import Choice, choose, first_stage, rough
from identification.tracing.remaining_structure import (
    ASTRAY,
    DOUBTFUL,
    FEWEST_ROWS,
    IMPOSED_LEFT,
    MOST_PLACES,
    at_breakaway,
    before_pieces,
    in_run,
    places,
    remaining_structure,
    strongest,
    too_much,
    unrepeated,
)
from identification.tracing.result import Dependence, Trace
from identification.tracing.verdict import (
    found_effect,
    next_experiment,
    parameters_of,
    residuals_of,
    rivals_of,
    run_residual,
    verdict_of,
)

Progress = Callable[[str, float], None]
LINEAR_ACTUATOR = 0.97  # share of dF/dt that a linear actuator may leave, to be one at all
HUNDREDTH = 0.01  # of the square that is missing, left by effects that are there without a doubt
SLIDES, MANY_ROWS = 0.03, 100  # of the log in sliding, and stretches of it, of which one is needed
RANGE, VARIED = (0.05, 0.95), 4.0  # quantiles of speed, and what they must be apart (a factor)
OF_SPEED = frozenset({"v", "reversal"})
HELPS = 0.75  # of the run's excess misfit, that effects which leave much may leave at most


def trace(
    train: Sequence[Log], test: Sequence[Log], rig: Rig, library: Library,
    rng: np.random.Generator, *, on_progress: Progress | None = None,
) -> Trace:  # fmt: skip
    """What the logs call for beyond the plain model, and the errors before and after.

    train: logs for choice and fit; test: logs that neither sees (where there are none, stretches
    of the training logs are left out in turn, and a remark says so). Each has y [m], F [N] and,
    where the command is logged, u [V], on an even clock. Raises BadLog where a signal is missing,
    NotIdentifiable where too little of the motion slides.
    """
    for log in (*train, *test):
        check_driven(log)
    report = on_progress or (lambda _stage, _share: None)
    remarks: list[str] = []
    by_command = _by_command(train, rig, library, remarks)
    held = rig.kind == "motor"
    recorded = partial(motion_log, held=held, by_command=by_command, rotary=rig.motion == "rotary")
    drive: Drive = "command" if by_command or held else "force"
    logs, refused = _logs(train, recorded, drive)
    report("tracing", 0.0)
    start, first = first_stage(logs, by_command)
    before = fitted_structure(start, first, (), logs, drive, rig, rng.spawn(1)[0])
    # Imposed, and the inertia not only hidden by what is missing.
    imposed = before.imposed and inertia_has_no_part(logs)
    if refused is not None and not imposed:
        raise refused
    if imposed:
        recorded = partial(recorded, imposed=True)
        logs = [recorded(log) for log in train]
        _enough(logs)
        start, first = first_stage(logs, by_command)
        before = fitted_structure(start, first, (), logs, drive, rig, rng.spawn(1)[0])
        library = _told_by_speed(library, logs, remarks)
    free = not before.imposed and loose(before.plant, drive)
    if not (before.imposed or free or rough(first)) and before.misfit > COMPLETE:
        before = searched(before, train, logs, drive, rig, rng)
    if not before.imposed:
        logs = [replace(one, reference=before.plant.friction) for one in logs]
        # A run that is not followed may have swollen its band in place of what is missing.
        slow = band(before) if before.misfit <= ASTRAY else 0.0
        start = replace(start, band=slow, sliding=before.plant.friction)
        first = base_fits(start)
    if not before.imposed and misfit(before.plant, logs, drive, every=True) <= COMPLETE:
        library = {}  # the plain plant's run leaves nothing but noise
    setting = Setting(logs, logs, drive, rig, library, start, first, before, rng.spawn(1)[0])
    choice = begun = choose(start, first, library, rng, report, most=1)
    alone = first_alone(begun, setting)
    if begun.steps and not suffices(alone, begun, setting):
        choice = choose(start, first, library, rng, report, begun)
    many = not before.imposed and places(choice) >= MOST_PLACES
    choice = before_pieces(choice) if many else choice
    report("refitting", 0.5)
    sliding = choice.base[MECHANICAL]
    hidden = before.imposed and (inertia_is_lost(sliding) or mean_square(sliding) > MUCH**2)
    unsure = start.band == 0.0 and not hidden
    after = before
    # Where the first effect leaves next to nothing of the equations, the run may tell the next.
    more = alone is not None and 0 < len(alone.plant.effects) < len(choice.steps)
    found = at_once(begun, alone, setting, report) if alone is not None and more else None
    if found is not None:
        choice, after = found
    elif choice.steps:
        choice, after = fewest(choice, setting, unsure)
    if unsure:
        choice, after = doubted(choice, after, setting)
        setting = replace(setting, doubted=choice.steps)
    report("judging", 0.0)
    choice, after = judged_forward(choice, after, setting, report)
    if useless(choice, before, after):
        choice, after = Choice(start, first, (), start, first, choice.tried), before
    choice = told_apart(choice, after, setting)
    seen = [recorded(log) for log in test]
    # A refinement may end short of its minimum.
    most = DECISIVE if choice.steps else COMPLETE
    left = Dependence((), 0.0) if after.misfit <= most else remaining_structure(choice, after)
    changed = parameter_drift(after, choice.steps, seen, rig) if seen else ()
    if not (left.depends_on or choice.steps or after.imposed) and after.misfit > DOUBTFUL:
        left = in_run(after, logs, drive)
        left = left if left.depends_on else at_breakaway(choice)
    verdict = verdict_of(choice, left, changed)
    slowest = choice.base[MECHANICAL].slowest
    errors_before = errors_of(before, slowest, (), logs, seen, drive)
    errors_after = errors_of(after, slowest, choice.steps, logs, seen, drive)
    if after.stage.imposed:
        carried = share_left(errors_before, errors_after) <= IMPOSED_LEFT
    else:
        carried = not equations_explained(choice.base) or carries(errors_before, errors_after)
    stands_in = bool(choice.steps) and not changed and not carried
    pieced = places(choice) >= MOST_PLACES
    pieced = pieced or (many and places(choice) > 1 and after.misfit > COMPLETE)
    longer = not after.imposed and unrepeated(after)
    if verdict != "unknown" and (stands_in or pieced or longer or too_much(choice, after)):
        verdict = "unknown"
        another = pieced or longer  # a law of place, which is told from what the plain model leaves
        left = Dependence((), 0.0) if another else strongest(choice, after, logs, drive)
        if choice.steps and not left.depends_on:  # of all that is missing
            plain = Choice(start, first, (), start, first, choice.tried)
            left = remaining_structure(plain, before, any_size=True)
    remarks += _remarks(choice, after, left, logs, seen, rig)
    if pieced:
        remarks.append(
            "several effects of place together follow what is missing: rather pieces of one law of"
            " place that the library does not have"
        )
    if longer:
        remarks.append(
            "a force is said to repeat over more than the travel shows: it stands in for another"
        )
    if stands_in:
        remarks.append(
            "what explains the training logs does not explain the test logs: it stands in for"
            " something else, or the machine differs in them"
        )
    return Trace(
        verdict=verdict,
        before=errors_before,
        after=errors_after,
        noise_y=float(np.mean([one.noise_y for one in logs])),
        noise_F=float(np.mean([one.noise_F for one in logs])),
        noise_force=row_noise(choice.base, MECHANICAL) or 0.0,
        noise_actuator=row_noise(choice.base, ACTUATOR),
        effects=tuple(found_effect(s, after, choice) for s in choice.steps),
        rivals=rivals_of(choice),
        unknown=left,
        drift=changed,
        next_experiment=next_experiment(verdict, choice, left),
        parameters_before=parameters_of(before, rig),
        parameters_after=parameters_of(after, rig),
        plant=after.plant,
        residuals=residuals_of(choice.start, choice.first, choice.end, choice.base),
        run=run_residual(before, after, logs, drive),
        remarks=tuple(remarks),
    )


def _remarks(
    choice: Choice,
    after: FittedStructure,
    left: Dependence,
    logs: Sequence[MotionLog],
    seen: Sequence[MotionLog],
    rig: Rig,
) -> Iterator[str]:
    """What whoever reads the trace has to know of it."""
    if after.imposed and after.stage.imposed:
        yield "the motion is imposed (inertia is of no account): no free run is judged"
    elif after.imposed:
        yield "inertia does not show beside what is left: no free run is judged"
    elif choice.steps and after.misfit > ASTRAY:
        yield (
            f"the free run still leaves {np.sqrt(after.misfit):.0f} times the position's noise:"
            " band and stick limits are not to be trusted, or more is missing"
        )
    always = beyond_friction(choice.end.theta)
    if always is not None:
        yield constant_remark(always, units_of(rig.motion)["F_cp"])
    if left.swing > 0.0:
        yield (
            f"what is left swings at {left.swing:.3g} Hz whatever the motion does: a vibration from"
            " outside, or another loop"
        )
    if not after.imposed and driven_only(logs):
        motor = (
            " nor a dead zone of the command be told from friction" if rig.kind == "motor" else ""
        )
        yield (
            "the force hardly ever opposes the motion, so friction in proportion to it would not"
            f" show{motor} (a run that brakes hard would show it)"
        )
    if seen and not any(len(one.sliding.start) for one in seen):
        yield "the body does not slide in the test logs, so they say nothing of the force error"
    if not seen:
        yield "no test log: the test errors are those of stretches left out in turn"


def useless(choice: Choice, before: FittedStructure, after: FittedStructure) -> bool:
    """Whether effects explain neither the run nor, to the sensors' noise, the equations.

    Where no effect of the library is the right one, the nearest stands in for it: it lowers what
    the equations leave (though not to a hundredth), bends the other parameters, and hides on what
    the rest depends.
    """
    if after.imposed or not choice.steps:
        return False
    told = [e for e in (MECHANICAL, ACTUATOR) if e in choice.base]
    lacked = any(mean_square(choice.first[e]) > MUCH**2 for e in told)
    if lacked and all(
        mean_square(choice.base[e]) <= max(MUCH**2, HUNDREDTH * mean_square(choice.first[e]))
        for e in told
    ):
        return False
    return after.misfit - 1.0 > HELPS * max(before.misfit - 1.0, 0.0)


def searched(
    model: FittedStructure, train: Sequence[Log], logs: Sequence[MotionLog], drive: Drive, rig: Rig,
    rng: np.random.Generator,
) -> FittedStructure:  # fmt: skip
    """The plain model from a global search, where that follows the logs better."""
    try:
        plant = searched_plant(train, rng.spawn(1)[0], rig=rig, drive=drive)
    except UserError:
        return model
    found = refit(plant, logs, drive, prior={}, effort="near")
    if found.misfit >= model.misfit:
        return model
    return replace(model, plant=found.plant, sd=found.sd, misfit=found.misfit)


def _by_command(train: Sequence[Log], rig: Rig, library: Library, remarks: list[str]) -> bool:
    """Whether an actuator with a logged command is to be judged too: a linear one, or one that
    some effect of the library makes linear."""
    if rig.kind == "motor" or not all("u" in log and np.ptp(log["u"]) > 0 for log in train):
        return False
    logs = [motion_log(log, held=False, by_command=True) for log in train]
    rows = stacked([actuator(one, np.array([1.0, 0.0, 0.0])) for one in logs])
    found = solve_rows(rows)

    def left_by(one: Fitted) -> float:
        left = float(np.std(one.residual * rows.sd) / max(float(np.std(rows.b)), 1e-300))
        return left if one.theta[0] > 0 else max(left, 1.0)  # nothing follows the command

    left = left_by(found)
    if left > LINEAR_ACTUATOR:
        stage, first = first_stage(logs, True)
        own = [e for e in library.values() if e.place.in_actuator]
        tried = [best_of(stage, effect, first) for effect in own if ACTUATOR in first]
        fits = [c.outcomes[ACTUATOR].fit for c in tried if c is not None]
        left = min([left, *(left_by(fit) for fit in fits)])
    if left > LINEAR_ACTUATOR:
        remarks.append(
            f"a linear actuator leaves {100 * left:.0f} % of the force's rate: effects between"
            " command and force are not judged"
        )
        return False
    return True


def _logs(
    train: Sequence[Log], recorded: Callable[..., MotionLog], drive: Drive
) -> tuple[list[MotionLog], NotIdentifiable | None]:
    """The logs with their motion; imposed where only a rig's slow motion may hold enough, and then
    the error that they are otherwise."""
    logs = [recorded(log) for log in train]
    try:
        _enough(logs)
    except NotIdentifiable as error:
        if drive != "force":
            raise
        logs = [recorded(log, imposed=True) for log in train]
        try:
            _enough(logs)
        except NotIdentifiable:
            raise error from None
        return logs, error
    return logs, None


def _told_by_speed(library: Library, logs: Sequence[MotionLog], remarks: list[str]) -> Library:
    """The library without effects of speed alone, where a rig kept to much the same speed.

    There they would stand in for whatever makes one stroke differ from another.
    """
    ratios = []
    for way in (True, False):
        speed = np.concatenate([one.speed[one.up == way] for one in logs])
        low, high = np.quantile(speed, RANGE)
        ratios.append(float(high / low))
    of_speed = [
        k for k, e in library.items() if "v" in e.depends_on and set(e.depends_on) <= OF_SPEED
    ]
    if max(ratios) >= VARIED or not of_speed:
        return library
    remarks.append(
        f"the speeds of each direction are too alike (a factor of {max(ratios):.2g} at most,"
        f" {VARIED:g} needed) to tell friction that depends on speed alone:"
        f" {', '.join(of_speed)} not tried; add runs at other speeds"
    )
    return {key: effect for key, effect in library.items() if key not in of_speed}


def _enough(logs: Sequence[MotionLog]) -> None:
    rows = sum(len(one.sliding.start) for one in logs)
    if rows < FEWEST_ROWS:
        raise NotIdentifiable(
            f"{logs[0].log.name}: {rows} stretches of sliding in one direction long enough to"
            f" judge ({FEWEST_ROWS} needed); log longer or faster motion"
        )
    up = np.concatenate([one.up for one in logs])
    if np.all(up) or not np.any(up):
        way = "negative" if up[0] else "positive"
        raise NotIdentifiable(
            f"{logs[0].log.name}: no stretch of sliding in {way} direction is long enough to judge;"
            " log motion in both directions (identify takes one direction alone)"
        )
    share = float(np.mean(np.concatenate([one.signals["d"] != 0 for one in logs])))
    if share < SLIDES and rows < MANY_ROWS:
        raise NotIdentifiable(
            f"{logs[0].log.name}: the body slides for {100 * share:.1f} % of the log, in {rows}"
            f" stretches ({100 * SLIDES:.0f} %, or {MANY_ROWS} stretches, needed to tell its mass"
            " from its friction); drive it harder, or log longer motion"
        )
