"""Which effects are missing: forward selection with exchange, against a calibrated threshold."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from identification.arrays import Array
from identification.effects._base import Effect
from identification.effects._library import Library
from identification.estimation.regression.effect_columns import Values
from identification.estimation.regression.effect_rows import EffectRows
from identification.estimation.regression.equation_rows import (
    ACTUATOR,
    BREAKAWAY,
    MECHANICAL,
    REST,
    MotionLog,
)
from identification.estimation.regression.motion_log import again
from identification.estimation.regression.row_fit import (
    RowFit,
    base_fits,
    converged_fits,
    row_fit,
)
from identification.estimation.regression.signals_behind_effects import (
    command_of,
    driven,
    reached,
    shown_to_true,
)
from identification.progress import Halted, Progress
from identification.thresholds import EARNS, MATERIAL, PENALTY
from identification.tracing.regression.candidates import (
    EffectCandidate,
)
from identification.tracing.regression.library_search import at_own_scale, of_sliding, scales_of
from identification.tracing.regression.significance import chance, is_chance

MOST_EFFECTS = 4  # effects in one machine
SHIFT = 1.0  # of the position's noise
# What a halted choice leaves out
EFFECTS = "the effects of the library"
FURTHER_EFFECT = "a further effect beside the first"


@dataclass(frozen=True, eq=False)
class Step:
    """One effect taken: the candidate, its p-value, its rivals in order, stage and base before.

    explained: share of what is missing that it accounts for in the free run, where that decided.
    """

    candidate: EffectCandidate
    p_value: float
    rivals: tuple[EffectCandidate, ...]
    stage: EffectRows
    base: Mapping[str, RowFit]
    explained: float | None = None


@dataclass(frozen=True, eq=False)
class Choice:
    """The plain stage, the steps taken, and the stage with all effects in it; tried: what else was
    tried beside them."""

    start: EffectRows
    first: Mapping[str, RowFit]
    steps: tuple[Step, ...]
    end: EffectRows
    base: Mapping[str, RowFit]
    tried: tuple[EffectCandidate, ...] = ()

    @property
    def effects(self) -> tuple[tuple[Effect, Values], ...]:
        """The effects taken, at the parameters that the equations give them."""
        return tuple((s.candidate.effect, s.candidate.values) for s in self.steps)


def choose(
    start: EffectRows, first: Mapping[str, RowFit], library: Library, rng: np.random.Generator,
    report: Progress, begun: Choice | None = None, most: int = MOST_EFFECTS,
) -> Choice:  # fmt: skip
    """Effects that the logs show, one after the other, each tested beside those before.

    start, first: the plain model and what it leaves, as `first_stage` gives them; begun: a choice
    to go on from; most: effects at most. Halted, it is the choice so far. Source: stepwise
    regression, Efroymson, in Ralston, Wilf (eds.), Mathematical Methods for Digital Computers
    (1960); orthogonal forward selection, Chen, Billings, Luo (1989); thresholds are ours.
    """
    stage, base, steps = start, first, list[Step]()
    tried: Sequence[EffectCandidate] = ()
    if begun is not None:
        stage, base, steps, tried = begun.end, begun.base, list(begun.steps), begun.tried
    try:
        for turn in range(len(steps), most):
            tried = at_own_scale(stage, base, library, partial(_report, report, turn))
            step = next_step(tried, stage, base, rng)
            if step is None:
                break
            stage, base = with_candidate(step.stage, step.candidate)
            steps = [*steps, step]
    except Halted:
        start.logs[0].halt.left_out(FURTHER_EFFECT if steps else EFFECTS)
    return Choice(start, first, tuple(steps), stage, base, tuple(tried))


def _report(report: Progress, turn: int, part: float) -> None:
    report("tracing", (turn + part) / MOST_EFFECTS)


def scaled_as(step: Step, stage: EffectRows) -> EffectRows:
    """The stage at the scale of a step."""
    return of_sliding(stage, step.stage.scale(MECHANICAL))


def next_step(
    found: Sequence[EffectCandidate],
    stage: EffectRows,
    base: Mapping[str, RowFit],
    rng: np.random.Generator,
) -> Step | None:
    """The candidate that gains most, if it is material and significant; None without one."""
    if not found:
        return None
    scales = scales_of(found, base)
    scaled = replace(stage, scales=scales)
    base = base_fits(scaled)
    ranked = sorted((rescaled(scaled, c, base) for c in found), key=lambda c: -merit(c))
    # What explains little of what is missing in its own equations must not hide the next.
    worth = [c for c in ranked if material(c, scaled, base) and share(c, base) >= 1.0 - EARNS]
    if not worth:
        return None
    best = worth[0]
    ranked = [best, *(c for c in ranked if c is not best)]
    p_value = chance(best, ranked, scaled, base, rng)
    if is_chance(p_value) or merit(best) <= 0:
        return None
    return Step(best, p_value, tuple(ranked[1:]), scaled, base)


def merit(candidate: EffectCandidate) -> float:
    """Gain less what its parameters would gain by chance.

    As Akaike's criterion (IEEE Trans. Automatic Control 19 (1974) 716) penalises a likelihood, by a
    penalty that is calibrated on machines without an effect.
    """
    return candidate.gain - PENALTY * len(candidate.effect.params)


def equal_rivals(step: Step) -> tuple[EffectCandidate, ...]:
    """Rivals that explain as much as the effect taken, but for chance."""
    mine = merit(step.candidate)
    return tuple(
        c for c in step.rivals if mine - merit(c) < PENALTY and share(c, step.base) >= 1.0 - EARNS
    )


def share(candidate: EffectCandidate, base: Mapping[str, RowFit]) -> float:
    """Share of what is missing in its equations that an effect explains."""
    missing = sum(max(base[k].criterion - len(base[k].rows.b), 0.0) for k in candidate.outcomes)
    return float(candidate.gain / max(missing, candidate.gain, 1e-300))


def explained_part(candidate: EffectCandidate, base: Mapping[str, RowFit]) -> float:
    """Part of the square beyond the sensors' noise that an effect explains in its equations, on
    the rows that count with it."""
    before, after = 0.0, 0.0
    for equation, o in candidate.outcomes.items():
        own = base[equation]
        if o.robust:
            without, left, noise = own.criterion, o.criterion, len(o.rows.b)
        else:
            keep = own.rows.speed >= o.slowest
            without, left = (float(np.sum(x.fit.residual[keep] ** 2)) for x in (own, o))
            noise = int(np.count_nonzero(keep))
        before += max(without - noise, 0.0)
        after += max(left - noise, 0.0)
    return max(0.0, 1.0 - after / before) if before > 0.0 else 0.0


def rescaled(
    stage: EffectRows, candidate: EffectCandidate, base: Mapping[str, RowFit]
) -> EffectCandidate:
    """The candidate compared at the stage's scales."""
    outcomes = {e: row_fit(stage, e, o.rows) for e, o in candidate.outcomes.items()}
    gain = sum(base[e].criterion - o.criterion for e, o in outcomes.items())
    return replace(candidate, outcomes=outcomes, gain=float(gain))


def contribution_size(
    candidate: EffectCandidate, base: Mapping[str, RowFit], equation: str, band: float
) -> float:
    """What the effect changes in an equation where it acts, in its unit: root mean square weighted
    by its own square, so that an end cushion is not the smaller the longer the log is elsewhere."""
    before, after = base[equation], candidate.outcomes[equation]
    own = after.rows.X.shape[1] - before.rows.X.shape[1]
    if own > 0 and not after.robust:
        # In the band the body takes any force: what an effect does there says nothing.
        fast = after.rows.speed >= max(after.slowest, band)
        moved = (after.rows.X[:, -own:] @ after.fit.theta[-own:])[fast]
        return _where_it_acts(moved)
    keep = after.rows.speed >= max(before.slowest, after.slowest)
    moved = before.fit.residual * before.rows.sd - after.fit.residual * after.rows.sd
    return _where_it_acts(moved[keep])


def _where_it_acts(moved: Array) -> float:
    """Root mean square of values, weighted by their squares."""
    square = float(np.sum(moved**2))
    return float(np.sqrt(np.sum(moved**4) / square)) if square > 0.0 else 0.0


def material(candidate: EffectCandidate, stage: EffectRows, base: Mapping[str, RowFit]) -> bool:
    """Whether the effect is large enough to matter to the machine, noise apart. Ours."""
    level = 0.5 * float(np.sum(np.abs(stage.theta[1:3])))
    if candidate.effect.place.shows:
        return any(shift_rms(candidate, stage, one) > SHIFT * one.noise.y for one in stage.logs)
    for equation in candidate.outcomes:
        size = contribution_size(candidate, base, equation, stage.band)
        if equation == MECHANICAL and size > MATERIAL * level:
            return True
        if equation == ACTUATOR and size > MATERIAL * float(np.std(base[equation].rows.b)):
            return True
        if equation == REST and size > float(np.median(base[equation].rows.sd)):
            return True
        if equation == BREAKAWAY and size > 2.0 * MATERIAL * level:
            return True
    return False


def shift_rms(candidate: EffectCandidate, stage: EffectRows, one: MotionLog) -> float:
    """Spread of what a sensor effect adds to the shown position [m]."""
    true = shown_to_true(candidate.effect, candidate.values, one, stage.friction)
    return float(np.std(one.log["y"] - true))


def with_candidate(
    stage: EffectRows, candidate: EffectCandidate
) -> tuple[EffectRows, dict[str, RowFit]]:
    """The stage with the effect in it, fitted, and what it leaves; sliding at the stage's scale, or
    the rows in which the effect is might be left out again."""
    return converged_fits(of_sliding(absorb(stage, candidate), stage.scale(MECHANICAL)))


def absorb(stage: EffectRows, candidate: EffectCandidate) -> EffectRows:
    """The stage with the effect in it: its columns join, or the logs' signals are freed of it."""
    effect, values = candidate.effect, candidate.values
    if not effect.place.on_signals:
        chosen = (*stage.chosen, (effect, values))
        return replace(stage, chosen=chosen, borne=stage.surely_borne)
    logs = []
    for one in stage.logs:
        if effect.place.shows:
            log = one.log.with_signals(y=shown_to_true(effect, values, one, stage.friction))
        else:
            whole = reached(effect, values, one, stage.friction)
            more = {"F": driven(one, whole)} if one.zoh else {}
            log = one.log.with_signals(u=command_of(one, whole), **more)
        logs.append(again(one, log))
    return replace(stage, logs=tuple(logs), taken=(*stage.taken, effect.key))
