"""What is reported of a choice: verdict, effects and sizes, rivals, the more informative run."""

from collections.abc import Sequence

import numpy as np

from identification.estimation.converged_fit import structure_estimates
from identification.estimation.estimates import beside_in, of_effect
from identification.estimation.prescribed_motion import prescribed_estimates
from identification.estimation.recorded_logs import RecordedLogs
from identification.estimation.regression.effect_rows import EffectRows, with_effect
from identification.estimation.regression.equation_rows import MECHANICAL, MotionLog
from identification.estimation.regression.row_fit import rms
from identification.estimation.regression.weighted_rows import left_unseen, stacked
from identification.estimation.run_or_equation import by_equation_if_surer
from identification.estimation.structure_fit import FittedStructure
from identification.model.estimates import Estimate
from identification.thresholds import HALF
from identification.tracing.model_errors import seen_by
from identification.tracing.probability import Evidence, probability
from identification.tracing.regression.candidates import EffectCandidate
from identification.tracing.regression.stepwise import Choice, Step, equal_rivals, explained_part
from identification.tracing.result import (
    Change,
    Dependence,
    EffectRival,
    FoundEffect,
    TraceVerdict,
)

RUNS = {
    "v": "strokes at several constant speeds",
    "y": "the same short stroke at several places",
    "t": "the same motion cold and, after running warm, once more",
    "F": "the same motion with and without an added load, and hard braking",
    "u": "a slow triangle of the command through zero",
    "du": "sharp steps of the command, logged at a high rate",
    "p_p": "the same motion at several chamber pressures",
    "p_n": "the same motion at several chamber pressures",
    "rest": "breakaways after rests of 0.1 s to 30 s",
    "reversal": "small slow reversals below and just above breakaway",
}
# Signals that are in no log by that name.
SAID = {
    "du": "the command's rate (du)",
    "reversal": "the time since it last reversed or stopped (reversal)",
    "rest": "the time at rest (rest)",
}
RIVALS_SHOWN = 6  # rivals of each effect


def verdict_of(choice: Choice, drift: Sequence[Change]) -> TraceVerdict:
    """The verdict of what is explained, in one word: rivals come first, then effects and drift."""
    if any(equal_rivals(step) for step in choice.steps):
        return "inseparable"
    if choice.steps:
        return "effect"
    return "drift" if drift else "none"


def explains_most(share: float) -> bool:
    """Whether effects that leave this share of what was missing explain most of it."""
    return share <= HALF


def found_effect(step: Step, after: FittedStructure, terms: Evidence) -> FoundEffect:
    """An effect taken, with its sizes in the refined plant, the share it explains and how probable
    it is by the evidence, which it shares with rivals that explain as much."""
    effect = step.candidate.effect
    acting = next(a for a in after.plant.effects if a.key == effect.key)
    params = {
        p.name: of_effect(
            p, acting.values[p.name], after.sd.get(f"{effect.key}.{p.name}"), beside_in(acting, p)
        )
        for p in effect.params
    }
    explained = step.explained
    if explained is None:
        explained = explained_part(step.candidate, step.base)
    sure = probability(terms, alike=len(equal_rivals(step)))
    return FoundEffect(effect, params, explained, step.p_value, sure)


def rivals_of(choice: Choice, seen: Sequence[MotionLog]) -> tuple[EffectRival, ...]:
    """Rivals of each effect in the order of what they gain, with their errors on the test logs."""
    out = []
    for i, step in enumerate(choice.steps):
        stage = seen_by(step.stage, choice.steps[:i], seen) if seen else None
        equal = {c.effect.key for c in equal_rivals(step)}
        for c in step.rivals[:RIVALS_SHOWN]:
            key = c.effect.key
            share = c.gain / step.candidate.gain if step.candidate.gain > 0 else 0.0
            why = (
                f"explains as much as {step.candidate.effect.key} on these logs"
                if key in equal
                else f"gains {100 * max(share, 0.0):.3g} % of what {step.candidate.effect.key} does"
            )
            out.append(EffectRival(key, _test_rms(step, c, stage), why))
    return tuple(out)


def _test_rms(step: Step, rival: EffectCandidate, seen: EffectRows | None) -> float | None:
    """Force error [N] of a rival in an effect's place, over the rows that count for the effect.

    seen: the test logs as the step found the others; None: of the stretches left out in turn.
    """
    if MECHANICAL not in rival.outcomes:
        return None
    o = rival.outcomes[MECHANICAL]
    slowest = step.candidate.outcomes.get(MECHANICAL, o).slowest
    if seen is None:
        return rms(left_unseen(o.rows.at(o.rows.speed >= slowest)))
    parts = [
        with_effect(seen, MECHANICAL, rival.effect, rival.values, i, rows)
        for i, rows in enumerate(seen.parts[MECHANICAL])
    ]
    rows = stacked(parts)
    keep = rows.speed >= slowest
    return rms((rows.b - rows.X @ o.fit.theta)[keep]) if np.any(keep) else None


def next_experiment(verdict: TraceVerdict, choice: Choice, left: Dependence) -> str:
    """The run that would distinguish rivals, or on what the rest depends."""
    if verdict == "inseparable":
        step = next(s for s in choice.steps if equal_rivals(s))
        mine = step.candidate.effect
        other = equal_rivals(step)[0].effect
        apart = [s for s in (*mine.depends_on, *other.depends_on)
                 if (s in mine.depends_on) != (s in other.depends_on)]  # fmt: skip
        how = RUNS.get(apart[0] if apart else mine.depends_on[0], "a run with richer motion")
        return f"to discriminate {mine.key} from {other.key}: {how}"
    if verdict == "unknown" and not left.depends_on:
        return "to find what is missing: runs that vary speed, place, load and time one by one"
    if verdict == "unknown" and left.swing > 0.0:
        return "to find what swings: a log at standstill, without and with the machines around"
    if verdict == "unknown":
        how = RUNS.get(left.depends_on[0], f"runs in which {left.depends_on[0]} varies by itself")
        return f"to find what depends on {listed(left.depends_on)}: {how}"
    return ""


def listed(signals: Sequence[str]) -> str:
    """Signals in words, those that no log has with what they are."""
    return ", ".join(SAID.get(name, name) for name in signals)


def parameters_before(plain: FittedStructure, recorded: RecordedLogs) -> dict[str, Estimate]:
    """`parameters_of` the plain model beside effects: where its run leaves clearly more of the
    equation of motion than this does by itself, those of the equation, as a fit would give them."""
    reported, fit = parameters_of(plain, recorded), None
    if plain.fit is None and not plain.prescribed:
        fit = by_equation_if_surer(plain.plant.friction, recorded)
    surer = {} if fit is None else {k: e for k, e in fit.estimates.items() if e.value is not None}
    return {**reported, **surer}


def parameters_of(model: FittedStructure, recorded: RecordedLogs) -> dict[str, Estimate]:
    """The nine and the actuator of a model, those that the logs identify with their intervals."""
    if model.fit is not None:
        return {k: e for k, e in model.fit.estimates.items() if "." not in k}
    if model.prescribed:
        return prescribed_estimates(model.plant, model.stage.theta, model.sd, recorded)
    return structure_estimates(model.plant, model.sd, recorded)
