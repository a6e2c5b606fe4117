"""Effects judged in the forward run, where the equations do not show them or take one for another.

Play, delay, elastic micro-motion, stiction that grows, friction by load: they change where and when
the body starts and stops more than any mean over a window of sliding. Each is tried in the free
run, beside what was found and in its place; it is taken only if the run then leaves next to
nothing but noise, so a term that merely helps is never taken here.
"""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2

from identification.effects._base import Effect
from identification.errors import UserError
from identification.estimation.regression.effect_columns import by_load, equations_of
from identification.estimation.regression.effect_rows import EffectRows
from identification.estimation.regression.equation_rows import (
    ACTUATOR,
    MECHANICAL,
    MotionLog,
    shortened,
)
from identification.estimation.regression.row_fit import RowFit, mean_square, rough, settled_fits
from identification.estimation.structure_fit import FittedStructure
from identification.estimation.windowed_run.nudged_search import (
    BREAKS_RANGE,
    CLOSE_RANGE,
    FAR_RANGE,
    FINER_RANGE,
    GROWTH_RANGE,
    MIDWAY_RANGE,
    SHORT_SECONDS,
    SIDES_RANGE,
    SLIDING_RANGE,
    closer,
    judge_nudged,
    less_load,
    nearer,
    nudged_search,
)
from identification.estimation.windowed_run.parameters import even, loose, on_bristle
from identification.estimation.windowed_run.refinement import Refit, briefly, onward, refit
from identification.estimation.windowed_run.run_errors import judge, loss, misfit
from identification.estimation.windowed_run.stick_search import start_band
from identification.estimation.windowed_run.windows import (
    RUN_WINDOW,
    freed,
    starts,
    window_residual,
)
from identification.model.estimates import Drive
from identification.model.plant import Plant
from identification.thresholds import (
    ADEQUATE,
    ALONE,
    ASTRAY,
    COMPLETE,
    HALF_OF_EXCESS,
    MUCH,
    NEARLY_FOLLOWED,
)
from identification.tracing.free_run.backward_elimination import (
    Setting,
    earned,
    enough,
    known,
    pruned,
    refined_near,
    seconds,
    with_steps,
)
from identification.tracing.free_run.trial_structures import (
    Trial,
    driven_only,
    seen_in_run,
    structures,
)
from identification.tracing.regression.candidates import EffectCandidate, trial
from identification.tracing.regression.significance import by_luck
from identification.tracing.regression.stepwise import Choice, Step, absorb

MAY_BE_UNEVEN = 20.0  # misfit up to which unequal directions may be what is left
WORTH = 1.25  # times that, up to which an effect's other starts are tried
LARGER = 3  # starts of a play, from the best up
RUN_ALONE = "effects that only the free run shows"  # left out where a trace is halted
Report = Callable[[str, float], None]


@dataclass(frozen=True, eq=False)
class RunContender:
    """A structure in the free run: its steps but the last, the last effect, plant and misfit."""

    steps: tuple[Step, ...]
    effect: Effect
    plant: Plant
    misfit: float


@dataclass(frozen=True, eq=False)
class Begun:
    """A trial after a first search: the plant before and after it, what that leaves (a run nudged
    along the log where nothing else holds it, and one let go), and other plants to begin from."""

    trial: Trial
    start: Plant
    plant: Plant
    loss: float
    misfit: float
    others: tuple[Plant, ...]


def judged_forward(
    choice: Choice, model: FittedStructure, setting: Setting, report: Report
) -> tuple[Choice, FittedStructure]:
    """The choice and its model, with what the free run adds, exchanges or finds needless."""
    free = loose(model.plant, setting.drive)
    # On bristles a run takes ten times as long, and where all of it is searched, too long.
    if model.imposed or (on_bristle(model.plant) and free):
        return choice, model
    called_for = choice.steps
    if model.misfit > enough(setting, choice.steps) and hidden(choice, free):
        found = setting.halt.tried(
            RUN_ALONE, lambda: _contested(choice, model, setting, report), None
        )
        if found is not None:
            choice, model = found
    choice, model = _pruned(choice, model, setting)
    if called_for and not choice.steps:  # the equations were wrong: what the run lacks is open
        return judged_forward(choice, model, setting, report)
    return choice, model


def _contested(
    choice: Choice, model: FittedStructure, setting: Setting, report: Report
) -> tuple[Choice, FittedStructure] | None:
    """The choice and its model with what a contest on short logs adds or exchanges, if anything."""
    short = cut_short(choice, model, setting)
    return contest(choice, model, replace(setting, short=short), report)


def _pruned(
    choice: Choice, model: FittedStructure, setting: Setting
) -> tuple[Choice, FittedStructure]:
    """The choice and its model without what the run does as well without, as far as is tried."""
    if not choice.steps:
        return choice, model
    keys = ", ".join(step.candidate.effect.key for step in choice.steps)
    what = f"whether the run does as well without {keys}"
    return setting.halt.tried(what, lambda: pruned(choice, model, setting), (choice, model))


def at_once(
    choice: Choice, model: FittedStructure, setting: Setting, report: Report
) -> tuple[Choice, FittedStructure] | None:
    """The choice and its model with one effect more, where a first search in the run finds one
    with which nothing is missing."""
    free = loose(model.plant, setting.drive)
    if model.imposed or (on_bristle(model.plant) and free):
        return None
    found = contest(
        choice, model, replace(setting, short=cut_short(choice, model, setting)), report,
        quickly=True,
    )  # fmt: skip
    return found if found is not None and found[1].misfit <= COMPLETE else None


def cut_short(choice: Choice, model: FittedStructure, setting: Setting) -> list[MotionLog]:
    """The logs' beginnings or, where the run alone tells what is missing, what it follows least."""
    logs, drive = setting.logs, setting.drive
    if not choice.steps and loose(model.plant, drive) and known(setting):
        return [most_left(model.plant, one, drive, SHORT_SECONDS) for one in logs]
    return [shortened(one, SHORT_SECONDS) for one in logs]


def hidden(choice: Choice, free: bool) -> bool:
    """Whether what the run lacks may be an effect that the equations hardly show.

    Where they themselves leave much, and no effect explains more of it, none is; nor is one where
    nothing brings the run back (free) and none brings the equations near the sensors' noise.
    """
    told = [e for e in (MECHANICAL, ACTUATOR) if e in choice.base]
    return all(mean_square(choice.base[e]) <= MUCH**2 for e in told) or any(
        mean_square(one.outcomes[e]) < HALF_OF_EXCESS * mean_square(choice.base[e])
        for one in choice.tried
        if not (free and rough(one.outcomes))
        for e in told
        if e in one.outcomes
    )


def contest(
    choice: Choice,
    model: FittedStructure,
    setting: Setting,
    report: Report,
    *,
    quickly: bool = False,
) -> tuple[Choice, FittedStructure] | None:
    """The best structure of one effect more, or of another in an effect's place, if decisive.

    quickly: only where a first search already follows the short logs with one.
    """
    begun = list[Begun]()
    tried = list(structures(choice, model, setting))
    for i, attempt in enumerate(tried):
        begun += _begun(attempt, setting)
        report("judging", 0.5 * (i + 1) / len(tried))
    # What a sensor shows leads the run astray, so its loss tells nothing.
    begun.sort(key=lambda one: (one.misfit > ADEQUATE, one.loss))
    if quickly and not (begun and begun[0].misfit <= ADEQUATE):
        return None
    promising = earning(choice, model, setting)
    screened = screening(begun, setting, promising, report)
    if not screened or screened[0].misfit > promising:
        return None
    winner = screened[0]
    done = _whole(winner, setting)
    rivals = [one for one in screened if one.effect.key != winner.effect.key]
    if done.misfit > decisive(model.misfit, rivals) or scales_alone(
        winner.effect, done.plant, setting.logs
    ):
        return None
    taken = _taken(winner, done, rivals, setting, model.misfit)
    return None if by_luck(taken[0].steps[-1].p_value) else taken


def earning(choice: Choice, model: FittedStructure, setting: Setting) -> float:
    """Misfit on the short logs that one effect more has to get below, beside others.

    What a refinement on the short logs alone does without it is no merit of the effect.
    """
    if not choice.steps:
        return np.inf
    without = _near(model.plant, model.plant, setting).misfit
    return np.inf if without <= COMPLETE else earned(without)


def screening(
    begun: Sequence[Begun], setting: Setting, promising: float, report: Report
) -> list[RunContender]:
    """The contenders refined a little on the short logs, the best first.

    begun: those followed first, then from the least loss up. Once one is followed, those far behind
    it are not tried.
    """
    screened = list[RunContender]()
    lost = np.inf
    for i, one in enumerate(begun):
        if one.misfit > lost:
            continue
        found = _screened(one, setting, promising)
        if found is not None:
            screened.append(found)
            if found.misfit <= ADEQUATE:
                lost = ASTRAY if one.misfit <= ADEQUATE else lost
        report("judging", 0.5 + 0.5 * (i + 1) / len(begun))
    return sorted(screened, key=lambda one: one.misfit)


def scales_alone(effect: Effect, plant: Plant, logs: Sequence[MotionLog]) -> bool:
    """Whether an effect of the plant is friction by load, alike in both directions, where nothing
    brakes: it but scales the other parameters there, and a better run was found by luck."""
    values = next(acting.values for acting in plant.effects if acting.key == effect.key)
    return by_load(effect) and values.get("asymmetry", 0.0) == 0.0 and driven_only(logs)


def decisive(before: float, others: Sequence[RunContender]) -> float:
    """Misfit that a structure may leave to be taken: next to nothing, or far less than any other.

    before: misfit without it; others: what was tried besides.
    """
    rival = min((one.misfit for one in others), default=before)
    least = min(before, rival)
    return max(
        min(ADEQUATE, 1.0 + HALF_OF_EXCESS * (before - 1.0)),
        min(NEARLY_FOLLOWED, 1.0 + ALONE * (least - 1.0)),
    )


def most_left(plant: Plant, one: MotionLog, drive: Drive, seconds: float) -> MotionLog:
    """The stretch of a log, of so many seconds, of which the plant's run leaves most."""
    n, size = len(one.log), round(seconds / one.log.h)
    r = window_residual(plant, one, drive, freed(plant, one, drive, starts(one, drive)))
    if r is None or size >= n:
        return shortened(one, seconds)
    sums = np.concatenate([[0.0], np.cumsum(np.log1p(np.sum(r**2, axis=0)))])
    step = max(1, size // 8)
    begins = np.arange(0, n - size + 1, step)
    return shortened(one, seconds, int(begins[np.argmax(sums[begins + size] - sums[begins])]))


def _begun(trial: Trial, setting: Setting) -> list[Begun]:
    """The effect at the best of its starts, after a first search; empty where it has none."""
    plants = []
    for values in trial.values:
        try:
            acting = trial.effect.acting(values)
            base = less_load(trial.base, acting) if by_load(trial.effect) else trial.base
            plants.append(replace(base, effects=(*base.effects, acting)))
        except UserError:
            continue
    if not plants:
        return []
    free = loose(plants[0], setting.drive)
    if free and not known(setting):
        errors_of = judge_nudged(plants[0], setting.short, setting.drive, 1.0)
    else:
        errors_of = judge(plants[0], setting.short, setting.drive, RUN_WINDOW)
    try:
        with ThreadPoolExecutor(2) as pool:
            costs = list(pool.map(lambda one: loss(errors_of(one)), plants))
        at = int(np.argmin(costs))
        first = _first(plants[at], trial.effect, setting)
        others: tuple[Plant, ...] = ()
        if free and (by_load(trial.effect) or trial.effect.place.in_stops):
            # What hardly shows by itself is small at its best start: another from the middle.
            others = (plants[len(plants) // 2],)
        elif trial.effect.place.shows and len(trial.effect.params) == 1:
            # The plain parameters are bent to do without it: a larger size may be the better start.
            others = tuple(plants[at + 1 : at + LARGER])
        left_by = misfit(first, setting.short, setting.drive)
        return [Begun(trial, plants[at], first, loss(errors_of(first)), left_by, others)]
    except UserError:  # two effects of a kind that a plant takes one of
        return []


def _screened(one: Begun, setting: Setting, enough: float) -> RunContender | None:
    """The contender refined a little on the short logs, from its other starts too.

    enough: misfit from which it may be the best; far above it no other start is tried.
    """
    trial = one.trial
    free = loose(one.plant, setting.drive)
    try:
        found = _near(one.start, one.plant, setting)
        for other in one.others:
            if found.misfit <= COMPLETE or (not free and found.misfit > WORTH * enough):
                break
            again = _near(other, _first(other, trial.effect, setting), setting)
            found = min(found, again, key=lambda x: x.misfit)
    except UserError:
        return None
    return RunContender(trial.steps, trial.effect, found.plant, found.misfit)


def _first(plant: Plant, effect: Effect, setting: Setting) -> Plant:
    """The plant after a first search on the short logs."""
    if loose(plant, setting.drive):
        if not effect.place.in_stops and not on_bristle(plant):
            return briefly(plant, setting.short, setting.drive).plant
        # Growth shows in stops alone, of which brief windows see little.
        # Where the plain run is nearly followed, its band and limits are nearly right.
        around = MIDWAY_RANGE if setting.plain.misfit <= NEARLY_FOLLOWED else SLIDING_RANGE
        around = BREAKS_RANGE if effect.place.in_stops else around
        stage = (0.0, around) if known(setting) else (1.0, FAR_RANGE)
        return nudged_search(plant, setting.short, setting.drive, setting.rng, (stage,))
    if seen_in_run(effect) and not by_load(effect):  # the plain band and limits stood for it
        p = plant.friction
        return start_band(plant, setting.short, setting.drive, max(p.dv_p, -p.dv_n))
    return plant


def _near(start: Plant, plant: Plant, setting: Setting) -> Refit:
    """The plant after a first search, or its start, refined a little on the short logs."""
    if loose(plant, setting.drive) and misfit(plant, setting.short, setting.drive) > COMPLETE:
        plant = nearer((plant, start), setting.short, setting.drive)
        plant = nudged_search(
            plant, setting.short, setting.drive, setting.rng, ((0.0, CLOSE_RANGE),)
        )
    return refit(plant, setting.short, setting.drive, prior=even(plant), effort="quick")


def _whole(one: RunContender, setting: Setting) -> Refit:
    """The contender refined on the whole logs; its asymmetries free where it falls short."""
    growth = one.effect.place.in_stops and loose(one.plant, setting.drive)
    found = _grown(one, setting) if growth else refined_near(one.plant, setting)
    if COMPLETE < found.misfit < MAY_BE_UNEVEN and even(found.plant):
        again = refit(found.plant, setting.logs, setting.drive, prior={}, effort="quick")
        found = again if again.misfit < found.misfit else found
        if found.misfit > COMPLETE and loose(found.plant, setting.drive):
            again = closer(found.plant, setting.logs, setting.drive, setting.rng, 2, SIDES_RANGE)
            found = again if again.misfit < found.misfit else found
    return found


def _grown(one: RunContender, setting: Setting) -> Refit:
    """A contender of growing stiction, searched and refined on the whole logs in turn.

    A breakaway is at one sample or the next, so a small change of its limit changes nothing, and
    where each start hangs on the rest before it, minima are many and narrow.
    """
    logs, drive = setting.logs, setting.drive
    begins = [one.plant]
    # All but the rare late breakaways
    if not one.steps and setting.plain.misfit <= NEARLY_FOLLOWED:
        begins.append(replace(one.plant, friction=setting.plain.plant.friction))
    best: Refit | None = None
    for around in (GROWTH_RANGE, GROWTH_RANGE, FINER_RANGE, FINER_RANGE):
        near = [nudged_search(x, logs, drive, setting.rng, ((0.0, around),)) for x in begins]
        found = onward(nearer((*begins, *near), logs, drive), logs, drive)
        best = found if best is None or found.misfit < best.misfit else best
        if not COMPLETE < best.misfit < MAY_BE_UNEVEN:
            break
        begins = [best.plant]
    assert best is not None
    return best


def _taken(
    winner: RunContender,
    done: Refit,
    rivals: Sequence[RunContender],
    setting: Setting,
    before: float,
) -> tuple[Choice, FittedStructure]:
    """The choice with the winner as its last step, and the model."""
    stage, base = with_steps(winner.steps, setting.start, setting.first)
    values = next(dict(a.values) for a in done.plant.effects if a.key == winner.effect.key)
    count = seconds(setting)
    scaled = [_as_candidate(one, stage, base, count * (before - one.misfit)) for one in rivals]
    mine = _as_candidate(
        replace(winner, plant=done.plant), stage, base, count * (before - done.misfit)
    )
    explained = 1.0 - max(done.misfit - 1.0, 0.0) / max(before - 1.0, 1e-300)
    p_value = luck(mine, len(setting.library))
    step = Step(
        replace(mine, values=values), p_value, tuple(sorted(scaled, key=lambda c: -c.gain)),
        stage, base, explained,
    )  # fmt: skip
    end, last = settled_fits(replace(absorb(stage, step.candidate), scales={}))
    choice = Choice(setting.start, setting.first, (*winner.steps, step), end, last, ())
    return choice, FittedStructure(end, last, done.plant, done.sd, False, done.misfit)


def luck(candidate: EffectCandidate, tried: int) -> float:
    """Chance that any of so many effects gains as much, every second counted as one sample."""
    free = len(candidate.effect.params)
    return float(min(1.0, tried * chi2.sf(max(candidate.gain, 0.0), free)))


def _as_candidate(
    one: RunContender, stage: EffectRows, base: Mapping[str, RowFit], gain: float
) -> EffectCandidate:
    """A contender as the equations see it."""
    values = next(dict(a.values) for a in one.plant.effects if a.key == one.effect.key)
    told = [e for e in equations_of(one.effect, stage.by_command, stage.held) if e in base]
    return EffectCandidate(one.effect, values, trial(stage, one.effect, values, told)[1], gain)
