"""Whether a machine has drifted: what a test of new logs has to give, and one by a new fit."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, Protocol

import numpy as np
from scipy.stats import norm

from identification.drift.reference_model import FORCES
from identification.model.estimates import Estimate
from identification.model.karnopp import NAMES
from workbench.documents.model import Model, used
from workbench.logs.sources import Sources
from workbench.steps.identify import identify

JudgedDrift = Literal["none", "drift", "structure", "not_judged"]
PRACTICAL_MARGIN = 0.05  # relative change that does not matter
FALSE_ALARM_LEVEL = 1e-3  # over all parameters of one log


@dataclass(frozen=True)
class Moved:
    """A parameter that has changed: its unit, value in force and now, p-value of the change."""

    name: str
    unit: str
    before: float
    after: float
    p_value: float


@dataclass(frozen=True)
class Reading:
    """A parameter by one log, with its 95 % interval, beside its value in force.

    change: relative to that, with its standard deviation.
    """

    name: str
    unit: str
    before: float
    after: float
    low: float
    high: float
    change: float
    sd: float


@dataclass(frozen=True)
class Drift:
    """Verdict of a test: which parameters moved, and why.

    p_value: of the smallest kind, over all parameters. unsure: parameters of which some have
    changed, and nobody can say which; could_have_seen: smallest relative change of each that would
    have been found, None where none would. state: what the same test wants to be given with the
    next log; plain JSON. parameters: what the log told of each, moved or not.
    """

    verdict: JudgedDrift
    reason: str
    moved: tuple[Moved, ...] = ()
    p_value: float | None = None
    state: Mapping[str, Any] = field(default_factory=dict)
    unsure: tuple[str, ...] = ()
    could_have_seen: Mapping[str, float | None] = field(default_factory=dict)
    parameters: tuple[Reading, ...] = ()


class DriftJudge(Protocol):
    """A test of a machine's new log against its model in force."""

    def __call__(
        self, model: Model, sources: Sources, rng: np.random.Generator, state: Mapping[str, Any]
    ) -> Drift:
        """The verdict; state: of the log before under this model, empty at first."""
        ...


def drift_by_refit(
    model: Model, sources: Sources, rng: np.random.Generator, state: Mapping[str, Any]
) -> Drift:
    """The nine of the log alone against those in force; each may change by 5 % unnoticed.

    A force is judged against the largest friction force where it is small. Raises NotIdentifiable,
    BadLog. `state` is not used: every log is judged alone.
    """
    found, _ = identify(sources.runs, rng, card=sources.card.name, rig=sources.rig)
    if model.fit.adequate and not found.fit.adequate:
        return Drift(
            "structure",
            "no parameters bring the model to follow the log (chi-square"
            f" {found.fit.chi_square:.3g}, {model.fit.chi_square:.3g} in force): it lacks"
            " something; 'workbench trace' tells what",
        )
    changes = [
        change
        for name in NAMES
        if (change := _change(name, model, found.friction[name])) is not None
    ]
    if not changes:
        return Drift("not_judged", "the log and the model in force tell no parameter together")
    least = min(1.0, min(one.p_value for one in changes) * len(changes))
    moved = tuple(one for one in changes if one.p_value * len(changes) < FALSE_ALARM_LEVEL)
    if not moved:
        return Drift(
            "none", f"no parameter has moved by more than {100 * PRACTICAL_MARGIN:g} %", (), least
        )
    said = ", ".join(f"{m.name} {m.before:.4g} -> {m.after:.4g} {m.unit}" for m in moved)
    return Drift("drift", f"moved: {said}", moved, least)


def _change(name: str, model: Model, now: Estimate) -> Moved | None:
    """The change of one parameter; None where one side does not tell it."""
    before = model.friction[name]
    if not (before.known and now.known) or now.sd is None:
        return None
    was, found = used(before), used(now)
    scale = abs(was)
    if name in FORCES:
        largest = max(abs(getattr(model.karnopp, force)) for force in FORCES)
        scale = max(scale, 0.1 * largest)
    beyond = abs(found - was) - PRACTICAL_MARGIN * scale
    sd = float(np.hypot(now.sd, before.sd or 0.0))
    p_value = 1.0 if beyond <= 0 else float(2.0 * norm.sf(beyond / sd)) if sd > 0 else 0.0
    return Moved(name, before.unit, was, found, p_value)
