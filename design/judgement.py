"""What a log of a machine has led to: a verdict with its reason, and what was made."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

Document = Mapping[str, Any]
LogVerdict = Literal["none", "not_judged", "structure", "promoted", "refused", "set_aside"]
ALARMING: tuple[LogVerdict, ...] = ("structure", "promoted", "refused", "set_aside")


@dataclass(frozen=True)
class Candidate:
    """A model with its design and validation, as documents, that a log has led to."""

    model: Document
    design: Document | None = None
    validation: Document | None = None


@dataclass(frozen=True)
class Judgement:
    """What a worker makes of one log; a candidate is activated where it is "promoted".

    rival: one that was made too and is refused, with its reason.
    """

    verdict: LogVerdict
    reason: str
    candidate: Candidate | None = None
    evidence: Document = field(default_factory=dict)
    rival: tuple[Candidate, str] | None = None
