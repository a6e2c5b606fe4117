"""Rivals that the equations do not tell from an effect taken, and whether the free run does."""

from collections.abc import Iterator
from dataclasses import replace

from identification.candidates import Candidate
from identification.choice import SHARE, Choice, Step, merit, share
from identification.needed import Setting, fitted, only, seconds
from identification.refit import COMPLETE
from identification.structure import Model

ALIKE = 10.0  # gain by which two effects that explain equally may differ


def alike(step: Step) -> tuple[Candidate, ...]:
    """Rivals that explain as much as the effect taken, but for luck."""
    mine = merit(step.candidate)
    return tuple(
        c
        for c in step.rivals
        if c.effect.key not in step.apart
        and mine - merit(c) < ALIKE
        and share(c, step.base) >= SHARE
    )


def told_apart(choice: Choice, after: Model, setting: Setting) -> Choice:
    """The choice, its steps with those rivals named whose run falls short where this one follows.

    The equations see means over stretches of sliding; the run has the starts and stops too.
    """
    if after.led or after.misfit > COMPLETE:
        return choice

    def short(step: Step) -> Iterator[str]:
        for rival in alike(step):
            stay = tuple(replace(x, candidate=rival) if x is step else x for x in choice.steps)
            run = fitted(only(choice, stay), setting)
            lost = seconds(setting) * (run.misfit - after.misfit)
            if not run.led and run.misfit > COMPLETE and lost > ALIKE:
                yield rival.effect.key

    return replace(choice, steps=tuple(replace(x, apart=frozenset(short(x))) for x in choice.steps))
