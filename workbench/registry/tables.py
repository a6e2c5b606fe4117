"""Tables of the registry. All but `in_force`, `claim` and `outbox` are append-only, by triggers.

Of those of the page, tokens, uploads and the audit are. `task` is the page's background work;
`machine_now` and `machine_trend` repeat what the results say, so that a list of many machines is
one query.
"""

import json
import re
from datetime import UTC, datetime
from typing import Any, get_args

from sqlalchemy import (
    BigInteger,
    CheckConstraint,
    DateTime,
    Dialect,
    ForeignKey,
    ForeignKeyConstraint,
    Index,
    MetaData,
    Text,
    TypeDecorator,
    UniqueConstraint,
)
from sqlalchemy.orm import DeclarativeBase, Mapped, declared_attr, mapped_column

from design.judgement import Document, LogVerdict
from workbench.output import dumps
from workbench.registry import values

APPEND_ONLY = ("machine", "log", "record", "version", "decision", "attempt", "outcome", "notice",
               "reopening")  # fmt: skip
PAGE_APPEND_ONLY = ("access_token", "access_token_end", "upload", "audit")
NAMING = {
    "ix": "ix_%(table_name)s_%(column_0_N_name)s",
    "uq": "uq_%(table_name)s_%(column_0_N_name)s",
    "ck": "ck_%(table_name)s_%(constraint_name)s",
    "fk": "fk_%(table_name)s_%(column_0_N_name)s",
    "pk": "pk_%(table_name)s",
}


class StorableText(TypeDecorator[str]):
    """A text as every database takes it: no lone surrogates of odd file names, and no NUL."""

    impl = Text()
    cache_ok = True

    def process_bind_param(self, value: str | None, dialect: Dialect) -> str | None:
        if value is None:
            return None
        return value.replace("\0", "\\0").encode("utf-8", "backslashreplace").decode("utf-8")


class UtcTime(TypeDecorator[datetime]):
    """A moment with its time zone, UTC in every database; SQLite keeps it without the zone."""

    impl = DateTime(timezone=True)
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        if value is None:
            return None
        if value.tzinfo is None:
            raise ValueError(f"{value} has no time zone; give an aware datetime")
        moment = value.astimezone(UTC)
        return moment.replace(tzinfo=None) if dialect.name == "sqlite" else moment

    def process_result_value(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        if value is None:
            return None
        return value.replace(tzinfo=UTC) if value.tzinfo is None else value.astimezone(UTC)


class JsonText(TypeDecorator[Any]):
    """A document as strict JSON in a text."""

    impl = Text()
    cache_ok = True

    def process_bind_param(self, value: Any, dialect: Dialect) -> str | None:
        return None if value is None else dumps(value)

    def process_result_value(self, value: str | None, dialect: Dialect) -> Any:
        """The document; None where there is none, as beside a row without a partner."""
        return None if value is None else json.loads(value)


WORDS: tuple[Any, ...] = (
    values.DecisionKind, values.Kind, LogVerdict, values.MachineCondition, values.Role,
    values.TaskKind, values.TaskState,
)  # fmt: skip
COLUMN_TYPES: dict[Any, Any] = {
    str: StorableText(),
    datetime: UtcTime(),
    Document: JsonText(),
    **dict.fromkeys(WORDS, Text()),
}


class Base(DeclarativeBase):
    """All tables of the registry."""

    metadata = MetaData(naming_convention=NAMING)
    type_annotation_map = COLUMN_TYPES

    @declared_attr.directive
    def __tablename__(cls) -> str:
        """The class's name: that of AccessTokenRow is access_token."""
        return re.sub(r"\B(?=[A-Z])", "_", cls.__name__.removesuffix("Row")).lower()


def one_of(column: str, kind: Any) -> CheckConstraint:
    """That a column holds one of these words."""
    return CheckConstraint(f"{column} IN {get_args(kind)}", name=column)


class MachineRow(Base):
    """A machine by its name."""

    name: Mapped[str] = mapped_column(primary_key=True)
    added_at: Mapped[datetime]


class LogRow(Base):
    """A log file by its fingerprint; size and mtime identify a known file without reading it
    again."""

    id: Mapped[int] = mapped_column(primary_key=True)
    machine: Mapped[str] = mapped_column(ForeignKey("machine.name"))
    sha256: Mapped[str]
    file: Mapped[str]
    size: Mapped[int] = mapped_column(BigInteger)
    mtime_ns: Mapped[int] = mapped_column(BigInteger)
    seen_at: Mapped[datetime]
    __table_args__ = (UniqueConstraint("machine", "sha256"),)


class RecordRow(Base):
    """A document (model, design, validation) by its content."""

    id: Mapped[int] = mapped_column(primary_key=True)
    machine: Mapped[str] = mapped_column(ForeignKey("machine.name"))
    kind: Mapped[values.Kind]
    sha256: Mapped[str]
    document: Mapped[Document]
    made_at: Mapped[datetime]
    __table_args__ = (
        UniqueConstraint("machine", "kind", "sha256"),
        one_of("kind", values.Kind),
    )


class VersionRow(Base):
    """A model and its design, numbered from 1 a machine: what can be activated."""

    id: Mapped[int] = mapped_column(primary_key=True)
    machine: Mapped[str] = mapped_column(ForeignKey("machine.name"))
    number: Mapped[int]
    model_id: Mapped[int] = mapped_column(ForeignKey("record.id"))
    design_id: Mapped[int | None] = mapped_column(ForeignKey("record.id"))
    validation_id: Mapped[int | None] = mapped_column(ForeignKey("record.id"))
    made_at: Mapped[datetime]
    __table_args__ = (UniqueConstraint("machine", "number"), UniqueConstraint("machine", "id"))


class DecisionRow(Base):
    """What was decided of a version, by whom and why."""

    id: Mapped[int] = mapped_column(primary_key=True)
    machine: Mapped[str] = mapped_column(ForeignKey("machine.name"))
    kind: Mapped[values.DecisionKind]
    version_id: Mapped[int] = mapped_column(ForeignKey("version.id"))
    log_id: Mapped[int | None] = mapped_column(ForeignKey("log.id"))
    reason: Mapped[str]
    evidence: Mapped[Document]
    made_by: Mapped[str]
    at: Mapped[datetime]
    __table_args__ = (
        one_of("kind", values.DecisionKind),
        UniqueConstraint("id", "machine", "version_id"),
        Index(None, "machine", "id"),
    )


class ActiveVersionRow(Base):
    """The one active version of a machine, and the decision that put it there."""

    __tablename__ = "in_force"
    machine: Mapped[str] = mapped_column(ForeignKey("machine.name"), primary_key=True)
    version_id: Mapped[int]
    decision_id: Mapped[int]
    __table_args__ = (
        ForeignKeyConstraint(["machine", "version_id"], ["version.machine", "version.id"]),
        ForeignKeyConstraint(
            ["decision_id", "machine", "version_id"],
            ["decision.id", "decision.machine", "decision.version_id"],
        ),
    )


class ClaimRow(Base):
    """The worker that has a machine's new logs in hand, until its lease ends."""

    machine: Mapped[str] = mapped_column(ForeignKey("machine.name"), primary_key=True)
    token: Mapped[str]
    owner: Mapped[str]
    until: Mapped[datetime]
    lease_ms: Mapped[int | None] = mapped_column(BigInteger)


class ReopeningRow(Base):
    """A log is to be tested again; the number of these is the log's turn, from 0."""

    id: Mapped[int] = mapped_column(primary_key=True)
    log_id: Mapped[int] = mapped_column(ForeignKey("log.id"), index=True)
    reason: Mapped[str]
    made_by: Mapped[str]
    at: Mapped[datetime]


class AttemptRow(Base):
    """A worker began with a log."""

    id: Mapped[int] = mapped_column(primary_key=True)
    log_id: Mapped[int] = mapped_column(ForeignKey("log.id"), index=True)
    turn: Mapped[int]
    token: Mapped[str]
    owner: Mapped[str]
    at: Mapped[datetime]


class OutcomeRow(Base):
    """What a log led to; one a log and turn, so that no log counts twice."""

    log_id: Mapped[int] = mapped_column(ForeignKey("log.id"), primary_key=True)
    turn: Mapped[int] = mapped_column(primary_key=True)
    version_id: Mapped[int | None] = mapped_column(ForeignKey("version.id"))
    verdict: Mapped[LogVerdict]
    reason: Mapped[str]
    evidence: Mapped[Document]
    token: Mapped[str]
    at: Mapped[datetime]
    __table_args__ = (one_of("verdict", LogVerdict),)


class NoticeRow(Base):
    """The alarm of a log has been taken by the webhook."""

    log_id: Mapped[int] = mapped_column(primary_key=True)
    turn: Mapped[int] = mapped_column(primary_key=True)
    at: Mapped[datetime]
    __table_args__ = (ForeignKeyConstraint(["log_id", "turn"], ["outcome.log_id", "outcome.turn"]),)


class OutboxRow(Base):
    """An alarm that the webhook has not taken yet: refused how often, and when it is tried next.

    next_at lies ahead too while a worker has it in hand; given_up_at: it is not tried any more.
    """

    log_id: Mapped[int] = mapped_column(primary_key=True)
    turn: Mapped[int] = mapped_column(primary_key=True)
    refusals: Mapped[int]
    next_at: Mapped[datetime]
    tried_at: Mapped[datetime | None]
    given_up_at: Mapped[datetime | None]
    __table_args__ = (ForeignKeyConstraint(["log_id", "turn"], ["outcome.log_id", "outcome.turn"]),)


class AccessTokenRow(Base):
    """A token by its hash, what it allows, and who made it; the token itself is kept nowhere."""

    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str]
    role: Mapped[values.Role]
    sha256: Mapped[str]
    made_by: Mapped[str]
    at: Mapped[datetime]
    __table_args__ = (
        one_of("role", values.Role),
        Index(None, "name", unique=True),
        Index(None, "sha256", unique=True),
    )


class AccessTokenEndRow(Base):
    """A token that is not taken any more."""

    token_id: Mapped[int] = mapped_column(ForeignKey("access_token.id"), primary_key=True)
    made_by: Mapped[str]
    at: Mapped[datetime]


class UploadRow(Base):
    """A log that was dropped on the page: its name there, and what identifies its content."""

    id: Mapped[str] = mapped_column(primary_key=True)
    file: Mapped[str]
    size: Mapped[int] = mapped_column(BigInteger)
    sha256: Mapped[str]
    made_by: Mapped[str]
    at: Mapped[datetime]
    __table_args__ = (Index(None, "at"),)


class TaskRow(Base):
    """Work on an upload: its place in the queue, how far it is, and who has it in hand until when.

    token: of the worker's claim; share: done, 0 to 1; said: why it failed, or what came of it.
    """

    id: Mapped[int] = mapped_column(primary_key=True)
    upload: Mapped[str] = mapped_column("upload_id", ForeignKey("upload.id"), index=True)
    kind: Mapped[values.TaskKind]
    state: Mapped[values.TaskState]
    stage: Mapped[str]
    share: Mapped[float]
    said: Mapped[str]
    begun: Mapped[int]
    token: Mapped[str | None]
    owner: Mapped[str | None]
    until: Mapped[datetime | None]
    made_by: Mapped[str]
    at: Mapped[datetime]
    ended_at: Mapped[datetime | None]
    __table_args__ = (
        one_of("kind", values.TaskKind),
        one_of("state", values.TaskState),
        Index(None, "state", "id"),
    )


class AuditRow(Base):
    """A change that somebody made through the page or of its tokens: who, what, to what."""

    id: Mapped[int] = mapped_column(primary_key=True)
    at: Mapped[datetime]
    made_by: Mapped[str]
    kind: Mapped[str]
    subject: Mapped[str]
    detail: Mapped[str]
    __table_args__ = (Index(None, "subject", "id"),)


class MachineNowRow(Base):
    """What is known of a machine now: state by its last log, when one came, what moved most.

    moved_by: relative change of that parameter against the active version; moved_trend: its
    values over the last logs.
    """

    machine: Mapped[str] = mapped_column(ForeignKey("machine.name"), primary_key=True)
    state: Mapped[values.MachineCondition]
    heard_at: Mapped[datetime | None]
    logs: Mapped[int]
    moved: Mapped[str | None]
    moved_by: Mapped[float | None]
    moved_trend: Mapped[list[float] | None] = mapped_column(JsonText())
    __table_args__ = (
        Index(None, "state", "machine"),
        Index(None, "heard_at", "machine"),
        Index(None, "moved_by", "machine"),
    )


class MachineTrendRow(Base):
    """A machine's parameters over its last logs: name, then a value a log."""

    machine: Mapped[str] = mapped_column(ForeignKey("machine.name"), primary_key=True)
    trend: Mapped[Document]
