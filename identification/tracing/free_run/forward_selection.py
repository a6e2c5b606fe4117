"""Effects judged in the forward run, where the equations do not show them or take one for another.

Play, delay, elastic micro-motion, stiction that grows, friction by load: they change where and when
the body starts and stops more than any mean over a window of sliding. Each is tried in the free
run, beside what was found and in its place; it is taken only if the run then leaves next to
nothing but noise, so a term that merely helps is never taken here.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.stats import chi2

from identification.effects._base import Effect
from identification.estimation.regression.effect_columns import by_load, equations_of
from identification.estimation.regression.effect_rows import EffectRows
from identification.estimation.regression.equation_rows import ACTUATOR, MECHANICAL, MotionLog
from identification.estimation.regression.motion_log import shortened
from identification.estimation.regression.row_fit import RowFit, mean_square, settled_fits
from identification.estimation.structure_fit import FittedStructure
from identification.estimation.windowed_run.parameters import loose, on_bristle
from identification.estimation.windowed_run.refinement import Refit
from identification.estimation.windowed_run.windows import freed, starts, window_residual
from identification.model.estimates import Drive
from identification.model.plant import Plant
from identification.thresholds import ADEQUATE, ASTRAY, COMPLETE, HALF, HOPELESS, OF_ACCOUNT
from identification.tracing.free_run.backward_elimination import (
    Setting,
    earned,
    enough,
    equations_explained,
    seconds,
    with_steps,
)
from identification.tracing.free_run.contenders import (
    Begun,
    RunContender,
    begun_with,
    near_start,
    on_short_logs,
    on_whole_logs,
)
from identification.tracing.free_run.trial_structures import driven_only, structures
from identification.tracing.regression.candidates import EffectCandidate, trial
from identification.tracing.regression.significance import by_luck
from identification.tracing.regression.stepwise import Choice, Step, absorb

SHORT_SECONDS = 15.0  # s of each log on which contenders are tried first
RUN_ALONE = "effects that only the free run shows"  # left out where a trace is halted
Report = Callable[[str, float], None]


def judged_forward(
    choice: Choice, model: FittedStructure, setting: Setting, report: Report
) -> tuple[Choice, FittedStructure]:
    """The choice and its model, with what the free run adds or exchanges."""
    # On bristles a run takes ten times as long, and where all of it is searched, too long.
    if model.imposed or (on_bristle(model.plant) and loose(model.plant, setting.drive)):
        return choice, model
    if model.misfit > enough(setting, choice.steps) and hidden(choice):
        found = setting.halt.tried(
            RUN_ALONE, lambda: _contested(choice, model, setting, report), None
        )
        if found is not None:
            return found
    return choice, model


def _contested(
    choice: Choice, model: FittedStructure, setting: Setting, report: Report
) -> tuple[Choice, FittedStructure] | None:
    """The choice and its model with what a contest on short logs adds or exchanges, if anything."""
    logs, drive = setting.logs, setting.drive
    short = [most_left(model.plant, one, drive, SHORT_SECONDS) for one in logs]
    return contest(choice, model, replace(setting, short=short), report)


def hidden(choice: Choice) -> bool:
    """Whether what the run lacks may be an effect that the equations hardly show.

    Where they themselves leave much, and no effect explains most of it, none is.
    """
    told = [e for e in (MECHANICAL, ACTUATOR) if e in choice.base]
    return equations_explained(choice.base) or any(
        mean_square(one.outcomes[e]) < HALF * mean_square(choice.base[e])
        for one in choice.tried
        for e in told
        if e in one.outcomes
    )


def contest(
    choice: Choice, model: FittedStructure, setting: Setting, report: Report
) -> tuple[Choice, FittedStructure] | None:
    """The best structure of one effect more, or of another in an effect's place, if decisive."""
    begun = list[Begun]()
    tried = list(structures(choice, model, setting))
    for i, attempt in enumerate(tried):
        begun += begun_with(attempt, setting)
        report("judging", 0.5 * (i + 1) / len(tried))
    # What a sensor shows leads the run astray, so its loss tells nothing.
    begun.sort(key=lambda one: (one.misfit > ADEQUATE, one.loss))
    promising = earning(choice, model, setting)
    screened = screening(begun, setting, promising, report)
    if not screened or screened[0].misfit > promising:
        return None
    winner = screened[0]
    done = on_whole_logs(winner, setting)
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
    without = near_start(model.plant, setting).misfit
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
        found = on_short_logs(one, setting, promising)
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
        min(ADEQUATE, 1.0 + HALF * (before - 1.0)),
        min(HOPELESS, 1.0 + OF_ACCOUNT * (least - 1.0)),
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
