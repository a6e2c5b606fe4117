"""Rivals that the equations do not tell from an effect taken, and whether the free run does."""

from collections.abc import Iterator
from dataclasses import replace

from identification.estimation.structure_fit import FittedStructure
from identification.thresholds import COMPLETE, EARNS, PENALTY
from identification.tracing.free_run.backward_elimination import Setting, fitted, only, seconds
from identification.tracing.regression.candidates import EffectCandidate
from identification.tracing.regression.stepwise import Choice, Step, merit, share


def equal_rivals(step: Step) -> tuple[EffectCandidate, ...]:
    """Rivals that explain as much as the effect taken, but for luck."""
    mine = merit(step.candidate)
    return tuple(
        c
        for c in step.rivals
        if c.effect.key not in step.apart
        and mine - merit(c) < PENALTY
        and share(c, step.base) >= 1.0 - EARNS
    )


def discriminated(choice: Choice, after: FittedStructure, setting: Setting) -> Choice:
    """The choice, its steps with those rivals named whose run falls short where this one follows.

    The equations see means over stretches of sliding; the run has the starts and stops too.
    """
    if after.imposed or after.misfit > COMPLETE:
        return choice

    def short(step: Step) -> Iterator[str]:
        for rival in equal_rivals(step):
            key = step.candidate.effect.key
            if setting.halt.reached():
                setting.halt.left_out(f"rivals of {key} on the free run")
                return
            stay = tuple(replace(x, candidate=rival) if x is step else x for x in choice.steps)
            run = fitted(only(choice, stay), setting)
            if setting.halt.reached():  # its run falls short of its end
                setting.halt.left_out(f"rivals of {key} on the free run")
                return
            lost = seconds(setting) * (run.misfit - after.misfit)
            if not run.imposed and run.misfit > COMPLETE and lost > PENALTY:
                yield rival.effect.key

    return replace(choice, steps=tuple(replace(x, apart=frozenset(short(x))) for x in choice.steps))
