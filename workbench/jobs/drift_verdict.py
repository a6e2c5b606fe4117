"""Whether a machine has drifted: what a test of new logs has to give."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, Protocol

import numpy as np

from workbench.documents.model import Model
from workbench.logs.sources import Sources

TestedDrift = Literal["none", "drift", "structure", "not_judged"]


@dataclass(frozen=True)
class Moved:
    """A parameter that has changed: its unit, active value and now, p-value of the change."""

    name: str
    unit: str
    before: float
    after: float
    p_value: float


@dataclass(frozen=True)
class Reading:
    """A parameter by one log, with its 95 % interval, beside its active value.

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
    next log; plain JSON. parameters: what the log gave of each, moved or not.
    """

    verdict: TestedDrift
    reason: str
    moved: tuple[Moved, ...] = ()
    p_value: float | None = None
    state: Mapping[str, Any] = field(default_factory=dict)
    unsure: tuple[str, ...] = ()
    could_have_seen: Mapping[str, float | None] = field(default_factory=dict)
    parameters: tuple[Reading, ...] = ()


class DriftJudge(Protocol):
    """A test of a machine's new log against its active model."""

    def __call__(
        self, model: Model, sources: Sources, rng: np.random.Generator, state: Mapping[str, Any]
    ) -> Drift:
        """The verdict; state: of the log before under this model, empty at first."""
        ...
