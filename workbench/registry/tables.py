"""Tables of the registry. All but `in_force`, `claim` and `outbox` are append-only, by triggers.

Those of the page are in `page_tables`.
"""

from datetime import UTC, datetime

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
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column

APPEND_ONLY = (
    "machine",
    "log",
    "record",
    "version",
    "decision",
    "attempt",
    "outcome",
    "notice",
    "reopening",
)
NAMING = {
    "ix": "ix_%(table_name)s_%(column_0_N_name)s",
    "uq": "uq_%(table_name)s_%(column_0_N_name)s",
    "ck": "ck_%(table_name)s_%(constraint_name)s",
    "fk": "fk_%(table_name)s_%(column_0_N_name)s",
    "pk": "pk_%(table_name)s",
}


class UtcTime(TypeDecorator[datetime]):
    """A moment with its time zone, UTC in every database; SQLite keeps it without the zone."""

    impl = DateTime(timezone=True)
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        """The moment as the database keeps it."""
        if value is None:
            return None
        if value.tzinfo is None:
            raise ValueError(f"{value} has no time zone; give an aware datetime")
        moment = value.astimezone(UTC)
        return moment.replace(tzinfo=None) if dialect.name == "sqlite" else moment

    def process_result_value(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        """The moment in UTC."""
        if value is None:
            return None
        return value.replace(tzinfo=UTC) if value.tzinfo is None else value.astimezone(UTC)


class Base(DeclarativeBase):
    """All tables of the registry."""

    metadata = MetaData(naming_convention=NAMING)
    type_annotation_map = {str: Text(), datetime: UtcTime()}  # noqa: RUF012 - SQLAlchemy's form


class MachineRow(Base):
    """A machine by its name."""

    __tablename__ = "machine"
    name: Mapped[str] = mapped_column(primary_key=True)
    added_at: Mapped[datetime]


class LogRow(Base):
    """A log file by its fingerprint; size and mtime identify a known file without reading it
    again."""

    __tablename__ = "log"
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

    __tablename__ = "record"
    id: Mapped[int] = mapped_column(primary_key=True)
    machine: Mapped[str] = mapped_column(ForeignKey("machine.name"))
    kind: Mapped[str]
    sha256: Mapped[str]
    document: Mapped[str]
    made_at: Mapped[datetime]
    __table_args__ = (
        UniqueConstraint("machine", "kind", "sha256"),
        CheckConstraint("kind IN ('model', 'design', 'validation')", name="kind"),
    )


class VersionRow(Base):
    """A model and its design, numbered from 1 a machine: what can be activated."""

    __tablename__ = "version"
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

    __tablename__ = "decision"
    id: Mapped[int] = mapped_column(primary_key=True)
    machine: Mapped[str] = mapped_column(ForeignKey("machine.name"))
    kind: Mapped[str]
    version_id: Mapped[int] = mapped_column(ForeignKey("version.id"))
    log_id: Mapped[int | None] = mapped_column(ForeignKey("log.id"))
    reason: Mapped[str]
    evidence: Mapped[str]
    made_by: Mapped[str]
    at: Mapped[datetime]
    __table_args__ = (
        CheckConstraint("kind IN ('added', 'promoted', 'rolled_back', 'refused')", name="kind"),
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

    __tablename__ = "claim"
    machine: Mapped[str] = mapped_column(ForeignKey("machine.name"), primary_key=True)
    token: Mapped[str]
    owner: Mapped[str]
    until: Mapped[datetime]
    lease_ms: Mapped[int | None] = mapped_column(BigInteger)


class ReopeningRow(Base):
    """A log is to be tested again; the number of these is the log's turn, from 0."""

    __tablename__ = "reopening"
    id: Mapped[int] = mapped_column(primary_key=True)
    log_id: Mapped[int] = mapped_column(ForeignKey("log.id"), index=True)
    reason: Mapped[str]
    made_by: Mapped[str]
    at: Mapped[datetime]


class AttemptRow(Base):
    """A worker began with a log."""

    __tablename__ = "attempt"
    id: Mapped[int] = mapped_column(primary_key=True)
    log_id: Mapped[int] = mapped_column(ForeignKey("log.id"), index=True)
    turn: Mapped[int]
    token: Mapped[str]
    owner: Mapped[str]
    at: Mapped[datetime]


class OutcomeRow(Base):
    """What a log led to; one a log and turn, so that no log counts twice."""

    __tablename__ = "outcome"
    log_id: Mapped[int] = mapped_column(ForeignKey("log.id"), primary_key=True)
    turn: Mapped[int] = mapped_column(primary_key=True)
    version_id: Mapped[int | None] = mapped_column(ForeignKey("version.id"))
    verdict: Mapped[str]
    reason: Mapped[str]
    evidence: Mapped[str]
    token: Mapped[str]
    at: Mapped[datetime]
    __table_args__ = (
        CheckConstraint(
            "verdict IN ('none', 'not_judged', 'structure', 'promoted', 'refused', 'set_aside')",
            name="verdict",
        ),
    )


class NoticeRow(Base):
    """The alarm of a log has been taken by the webhook."""

    __tablename__ = "notice"
    log_id: Mapped[int] = mapped_column(primary_key=True)
    turn: Mapped[int] = mapped_column(primary_key=True)
    at: Mapped[datetime]
    __table_args__ = (ForeignKeyConstraint(["log_id", "turn"], ["outcome.log_id", "outcome.turn"]),)


class OutboxRow(Base):
    """An alarm that the webhook has not taken yet: refused how often, and when it is tried next.

    next_at lies ahead too while a worker has it in hand; given_up_at: it is not tried any more.
    """

    __tablename__ = "outbox"
    log_id: Mapped[int] = mapped_column(primary_key=True)
    turn: Mapped[int] = mapped_column(primary_key=True)
    refusals: Mapped[int]
    next_at: Mapped[datetime]
    tried_at: Mapped[datetime | None]
    given_up_at: Mapped[datetime | None]
    __table_args__ = (ForeignKeyConstraint(["log_id", "turn"], ["outcome.log_id", "outcome.turn"]),)
