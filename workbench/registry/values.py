"""What the registry holds, as values."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any, Literal

Document = Mapping[str, Any]
Kind = Literal["model", "design", "validation"]
DecisionKind = Literal["added", "promoted", "rolled_back", "refused"]
LogVerdict = Literal["none", "not_judged", "structure", "promoted", "refused", "set_aside"]
ALARMING: tuple[LogVerdict, ...] = ("structure", "promoted", "refused", "set_aside")


@dataclass(frozen=True)
class Version:
    """A model and its design, `number` from 1 a machine; sha256 of each document, None: none.

    `registry.document(version, kind)` gives a document itself.
    """

    machine: str
    number: int
    model: str
    design: str | None
    validation: str | None
    made_at: datetime


@dataclass(frozen=True)
class Decision:
    """What was decided of a machine's version, by whom and why; log: sha256 that led to it."""

    id: int
    machine: str
    kind: DecisionKind
    number: int
    log: str | None
    reason: str
    evidence: Document
    made_by: str
    at: datetime


@dataclass(frozen=True)
class MachineState:
    """A machine: the active version with the decision behind it, and how many logs it had.

    waiting: logs seen and not yet tested; set_aside: those that could not be.
    """

    name: str
    in_force: Version | None
    since: Decision | None
    versions: int
    logs: int
    waiting: int
    set_aside: int


@dataclass(frozen=True)
class SeenLog:
    """A log file as it was found: its fingerprint, and what identifies it without reading it
    again."""

    sha256: str
    file: str
    size: int
    mtime_ns: int


@dataclass(frozen=True)
class LogOutcome:
    """What a log led to; number: the active version against which it was tested.

    turn: how often the log had been reopened before.
    """

    machine: str
    log: SeenLog
    verdict: LogVerdict
    reason: str
    number: int | None
    evidence: Document
    at: datetime
    turn: int = 0


@dataclass(frozen=True)
class Alarm:
    """What a webhook is sent of one log; version: the active number against which it was tested.

    log_id, turn: its place in the registry; turn is how often the log had been reopened before.
    """

    log_id: int
    turn: int
    machine: str
    log: str
    sha256: str
    verdict: str
    reason: str
    version: int | None
    at: datetime


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


@dataclass(frozen=True)
class Claim:
    """A machine in a worker's hands until `until`; the token identifies this claim."""

    machine: str
    token: str
    owner: str
    until: datetime
