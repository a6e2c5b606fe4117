"""What the registry holds, as values; which of two logs of a machine is the older, and what may be
wrong with a registry."""

import re
from collections.abc import Iterable
from dataclasses import dataclass, fields
from datetime import datetime
from pathlib import PurePath
from typing import Any, Literal, TypeVar

from design.judgement import Document, LogVerdict
from identification.errors import UserError

Value = TypeVar("Value")

Kind = Literal["model", "design", "validation"]
DecisionKind = Literal["added", "promoted", "rolled_back", "refused"]
MOVES: tuple[DecisionKind, ...] = ("promoted", "rolled_back")  # what moves the pointer
Role = Literal["read", "change"]
TaskKind = Literal["identify", "trace"]
TaskState = Literal["waiting", "running", "done", "failed", "cancelled"]
MachineCondition = Literal[
    "in_tune", "drifting", "structure", "log_bad", "not_judged", "no_log", "silent"
]


def of_row(kind: type[Value], row: object, **more: Any) -> Value:
    """A value whose fields the row has by the same names; more: those that it has not."""
    names = (one.name for one in fields(kind))  # type: ignore[arg-type]  # a dataclass
    return kind(**{name: getattr(row, name) for name in names if name not in more}, **more)


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
class Claim:
    """A machine in a worker's hands until `until`; the token identifies this claim."""

    machine: str
    token: str
    owner: str
    until: datetime


Order = Literal["time-or-name", "time"]
_DIGITS = re.compile(r"(\d+)")
_YEAR = re.compile(r"(19|20)\d\d")


def older(log: SeenLog, other: SeenLog, order: Order = "time-or-name") -> bool:
    """Whether `log` was recorded before `other`, by its time or by the numbers in its name.

    order "time": by the files' times alone, for loggers whose numbers begin again.
    """
    if (log.mtime_ns, log.file) < (other.mtime_ns, other.file):
        return True
    if order == "time":
        return False
    one, two = _numbered(log.file), _numbered(other.file)
    return one is not None and two is not None and one[0] == two[0] and one[1] < two[1]


def newest_of_later(
    log: SeenLog, others: Iterable[SeenLog], order: Order = "time-or-name"
) -> SeenLog | None:
    """Of the others, the newest that `log` is older than; None where it is older than none."""
    later = [one for one in others if one.sha256 != log.sha256 and older(log, one, order)]
    return max(later, key=lambda one: (one.mtime_ns, one.file), default=None)


def _numbered(file: str) -> tuple[tuple[str, ...], tuple[int, ...]] | None:
    """A name's texts and its numbers; None where these are in no order of time.

    With the year last ("24.11.2026") a larger number may be an earlier day.
    """
    parts = _DIGITS.split(PurePath(file).stem)
    numbers = parts[1::2]
    if not numbers or any(_YEAR.fullmatch(number) for number in numbers[1:]):
        return None
    return tuple(parts[0::2]), tuple(int(number) for number in numbers)


class BadRegistry(UserError):
    """A registry that cannot be used, or a question that it cannot answer."""


class RegistryAway(UserError):
    """A database that does not answer, is locked or full; the same may work later."""


class LostClaim(UserError):
    """A worker's lease has ended and another has taken over; its result is dropped."""
