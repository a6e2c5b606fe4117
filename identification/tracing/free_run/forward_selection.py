"""Effects judged in the forward run, where the equations do not show them or take one for another.

Play, delay, elastic micro-motion, stiction that grows, load-dependent friction: they change where
and when the body starts and stops more than any mean over a window of sliding. Each is tried in the
free run, beside what was found and in its place; it is taken only if the run then leaves next to
nothing but noise, so a term that merely helps is never taken here.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.stats import chi2

from identification.estimation.regression.effect_columns import equations_of
from identification.estimation.regression.equation_rows import MotionLog
from identification.estimation.regression.motion_log import shortened
from identification.estimation.structure_fit import FittedStructure
from identification.estimation.windowed_run.parameters import is_unanchored, on_bristle
from identification.estimation.windowed_run.refinement import Refit
from identification.estimation.windowed_run.windows import freed, starts, window_residual
from identification.model.estimates import Drive
from identification.model.plant import Plant
from identification.thresholds import ADEQUATE, COMPLETE, HALF, HOPELESS, OF_ACCOUNT
from identification.tracing.free_run.backward_elimination import (
    Setting,
    earned,
    enough,
    equations_explained,
    only,
    with_steps,
)
from identification.tracing.free_run.contenders import (
    Entrant,
    RunContender,
    contender,
    entrant,
    on_whole_logs,
)
from identification.tracing.free_run.trial_structures import structures
from identification.tracing.regression.candidates import EffectCandidate, trial
from identification.tracing.regression.stepwise import Choice, Step, with_candidate

SHORT_SECONDS = 15.0  # s of each log on which contenders are tried first
SEARCHED = 3  # of the contenders, those that follow best after a few steps
RUN_ALONE = "effects that only the free run shows"  # left out where a trace is halted
Report = Callable[[str, float], None]


def judged_forward(
    choice: Choice, model: FittedStructure, setting: Setting, report: Report
) -> tuple[Choice, FittedStructure]:
    """The choice and its model, with what the free run adds or exchanges."""
    # On bristles a run takes ten times as long, and where all of it is searched, too long.
    if model.prescribed or (on_bristle(model.plant) and is_unanchored(model.plant, setting.drive)):
        return choice, model
    if model.misfit <= enough(setting, choice.steps):
        return choice, model
    # Where the equations themselves leave much, what is missing is none that they hardly show.
    if not equations_explained(choice.base):
        return choice, model

    def contested() -> tuple[Choice, FittedStructure] | None:
        cut = [most_left(model.plant, x, setting.drive, SHORT_SECONDS) for x in setting.logs]
        return contest(choice, model, replace(setting, short=cut), report)

    return setting.halt.tried(RUN_ALONE, contested, None) or (choice, model)


def contest(
    choice: Choice, model: FittedStructure, setting: Setting, report: Report
) -> tuple[Choice, FittedStructure] | None:
    """The best structure of one effect more, or of another in an effect's place, if decisive."""
    tried, entered = list(structures(choice, model, setting)), list[Entrant]()
    for i, attempt in enumerate(tried):
        one = entrant(attempt, setting)
        entered += [] if one is None else [one]
        report("judging", 0.5 * (i + 1) / len(tried))
    if not entered:
        return None
    entered.sort(key=lambda one: one.begun.misfit)
    found = [one.begun for one in entered[SEARCHED:]]
    for i, leading in enumerate(entered[:SEARCHED]):
        found.append(contender(leading, setting))
        report("judging", 0.5 + 0.5 * (i + 1) / SEARCHED)
    winner = min(found, key=lambda one: one.misfit)
    rivals = [one for one in found if one.effect.key != winner.effect.key]
    done = on_whole_logs(winner, setting)
    if done.misfit > decisive(model.misfit, rivals):
        return None
    bare = on_whole_logs(without_effect(winner), setting)
    if bare.misfit <= COMPLETE or done.misfit >= earned(bare.misfit):
        return _bare(winner.steps, bare, choice, model)
    return _taken(winner, done, rivals, setting, min(bare.misfit, model.misfit))


def without_effect(one: RunContender) -> RunContender:
    """The structure without its last effect, from the plant that it has led to: a better start is
    no effect."""
    stay = tuple(acting for acting in one.plant.effects if acting.key != one.effect.key)
    return replace(one, plant=replace(one.plant, effects=stay))


def _bare(
    steps: tuple[Step, ...], done: Refit, choice: Choice, model: FittedStructure
) -> tuple[Choice, FittedStructure]:
    """The choice with these of its steps, and its model as refined."""
    choice = only(choice, steps)
    return choice, replace(model, stage=choice.end, outcomes=choice.base).refined(done)


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
    winner: RunContender, done: Refit, rivals: Sequence[RunContender],
    setting: Setting, before: float,
) -> tuple[Choice, FittedStructure]:  # fmt: skip
    """The choice with the winner as its last step, and the model; before: misfit without it."""
    plain = setting.plain
    stage, base = with_steps(winner.steps, plain.start, plain.first)
    seconds = sum(one.log.duration for one in setting.logs)

    def candidate(one: RunContender) -> EffectCandidate:
        """A contender as the equations see it; what a run leaves counts as one sample a second."""
        values = next(dict(a.values) for a in one.plant.effects if a.key == one.effect.key)
        equations = [
            e for e in equations_of(one.effect, stage.by_command, stage.by_motor) if e in base
        ]
        gain = seconds * (before - one.misfit)
        return EffectCandidate(
            one.effect, values, trial(stage, one.effect, values, equations)[1], gain
        )

    mine = candidate(replace(winner, plant=done.plant, misfit=done.misfit))
    others = sorted(map(candidate, rivals), key=lambda c: -c.gain)
    explained = 1.0 - max(done.misfit - 1.0, 0.0) / max(before - 1.0, 1e-300)
    p_value = corrected_p_value(mine, len(plain.library))
    step = Step(mine, p_value, tuple(others), stage, base, explained)
    end, last = with_candidate(stage, mine)
    choice = Choice(plain.start, plain.first, (*winner.steps, step), end, last)
    return choice, FittedStructure(end, last, done.plant, done.sd, False, done.misfit)


def corrected_p_value(candidate: EffectCandidate, tried: int) -> float:
    """Chance that any of so many effects gains as much."""
    free = len(candidate.effect.params)
    return float(min(1.0, tried * chi2.sf(max(candidate.gain, 0.0), free)))
