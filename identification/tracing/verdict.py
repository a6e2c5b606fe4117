"""What is told of a choice: verdict, effects and sizes, rivals, the run that would tell more."""

from collections.abc import Mapping, Sequence

import numpy as np

from identification.arrays import Array
from identification.estimation.estimates import beside_in, of_effect
from identification.estimation.imposed_motion import imposed_estimates
from identification.estimation.latent_force import latent_forces
from identification.estimation.recorded_logs import RecordedLogs
from identification.estimation.regression.effect_rows import EffectRows, with_effect
from identification.estimation.regression.equation_rows import ACTUATOR, MECHANICAL, MotionLog
from identification.estimation.regression.row_fit import RowFit, rms
from identification.estimation.regression.weighted_rows import stacked
from identification.estimation.settling import structure_estimates
from identification.estimation.structure_fit import FittedStructure
from identification.estimation.windowed_run.windows import position_errors
from identification.model.estimates import Drive, Estimate
from identification.thresholds import HALF
from identification.tracing.model_errors import seen_by
from identification.tracing.probability import Evidence, probability
from identification.tracing.regression.candidates import EffectCandidate
from identification.tracing.regression.cross_validation import left_out_residual
from identification.tracing.regression.stepwise import Choice, Step, equal_rivals, explained_part
from identification.tracing.remaining_structure import signals_at, signals_of
from identification.tracing.result import (
    Change,
    Dependence,
    EffectRival,
    FoundEffect,
    MissingForce,
    Residual,
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
POSITION = "position"  # the residual of the free run
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


def found_effect(
    step: Step, after: FittedStructure, choice: Choice, terms: Evidence
) -> FoundEffect:  # fmt: skip
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
        return rms(left_out_residual(o.rows, slowest)[0])
    parts = [
        with_effect(seen, MECHANICAL, rival.effect, rival.values, i, rows)
        for i, rows in enumerate(seen.parts[MECHANICAL])
    ]
    rows = stacked(parts)
    keep = rows.speed >= slowest
    return rms((rows.b - rows.X @ o.fit.theta)[keep]) if np.any(keep) else None


def next_experiment(verdict: TraceVerdict, choice: Choice, left: Dependence) -> str:
    """The run that would tell rivals apart, or on what the rest depends."""
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


def parameters_of(model: FittedStructure, recorded: RecordedLogs) -> dict[str, Estimate]:
    """The nine and the actuator of a model, those that the logs tell with their intervals."""
    if model.fit is not None:
        return {k: e for k, e in model.fit.estimates.items() if "." not in k}
    if model.imposed:
        return imposed_estimates(model.plant, model.stage.theta, model.sd, recorded)
    return structure_estimates(model.plant, model.sd, recorded)


def residuals_of(
    start: EffectRows, first: Mapping[str, RowFit], end: EffectRows, base: Mapping[str, RowFit]
) -> tuple[Residual, ...]:
    """Rows for the pictures."""
    out = []
    for equation in (MECHANICAL, ACTUATOR):
        if equation not in first or len(first[equation].rows.b) != len(base[equation].rows.b):
            continue
        a, b = first[equation], base[equation]
        keep = b.rows.speed >= b.slowest
        windows = [one.sliding if equation == MECHANICAL else one.whole for one in start.logs]
        t, number, offset = [], [], 0.0
        for i, (one, w) in enumerate(zip(start.logs, windows, strict=True)):
            assert w is not None
            t.append(offset + one.log["t"][w.middle] - one.log["t"][0])
            number.append(np.full(len(w.start), float(i)))
            offset += one.log.duration
        signals = {k: v[keep] for k, v in signals_at(start, equation).items()}
        out.append(
            Residual(
                equation,
                np.concatenate(t)[keep],
                np.concatenate(number)[keep],
                (a.fit.residual * a.rows.sd)[keep],
                (b.fit.residual * b.rows.sd)[keep],
                b.rows.sd[keep],
                signals,
            )
        )
    return tuple(out)


def missing_force(
    before: FittedStructure, after: FittedStructure, logs: Sequence[MotionLog], slowest: float
) -> MissingForce | None:
    """The force that either model lacks on these logs, above a speed [m/s]; None where no body
    slides."""
    was = latent_forces(before.plant, logs, slowest)
    now = latent_forces(after.plant, logs, slowest) if after is not before else was
    both = [old.slides & new.slides for old, new in zip(was.logs, now.logs, strict=True)]
    if not any(np.any(one) for one in both):
        return None
    every: dict[str, list[Array]] = {}
    t, number, offset = [], [], 0.0
    left: list[tuple[Array, Array, Array]] = []
    for i, (one, old, new) in enumerate(zip(logs, was.logs, now.logs, strict=True)):
        at = np.flatnonzero(both[i])
        t.append(offset + one.log["t"][at] - one.log["t"][0])
        number.append(np.full(len(at), float(i)))
        offset += one.log.duration
        left.append((-old.force[at], -new.force[at], new.sd[at]))
        for name, values in signals_of(one).items():
            every.setdefault(name, []).append(values[at])
    signals = {k: np.concatenate(v) for k, v in every.items() if len(v) == len(logs)}
    old_force, new_force, sd = (np.concatenate(parts) for parts in zip(*left, strict=True))
    sliding = Residual(
        MECHANICAL, np.concatenate(t), np.concatenate(number), old_force, new_force, sd,
        {k: v for k, v in signals.items() if len(v) and np.ptp(v) > 0},
    )  # fmt: skip
    return MissingForce(was, now, sliding)


def run_residual(
    before: FittedStructure, after: FittedStructure, logs: Sequence[MotionLog], drive: Drive
) -> Residual | None:
    """Error of the shown position in the free run, sample by sample, for the pictures.

    None where a model's inertia is of no account, or its run cannot be followed.
    """
    if before.imposed or after.imposed:
        return None
    found: list[list[Array]] = []
    for model in (before,) if after is before else (before, after):
        errors = [position_errors(model.plant, log, drive) for log in logs]
        found.append([e for e in errors if e is not None])
        if len(found[-1]) < len(logs):
            return None
    ends = np.cumsum([0.0, *(log.log.duration for log in logs)])
    sizes = [len(log.log) for log in logs]
    t = [log.log["t"] - log.log["t"][0] + at for log, at in zip(logs, ends[:-1], strict=True)]
    return Residual(
        POSITION,
        np.concatenate(t),
        np.repeat(np.arange(float(len(logs))), sizes),
        np.concatenate(found[0]),
        np.concatenate(found[-1]),
        np.repeat([log.noise.y for log in logs], sizes),
        {},
    )
