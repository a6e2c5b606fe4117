"""Tables of the page: who may use it, what was dropped and worked on, and the summary of the fleet.

Tokens, uploads and the audit are append-only, as the rest of the registry is. `task` is the page's
background work; `machine_now` and `machine_trend` repeat what the results say, so that a list of
many machines is one query.
"""

from datetime import datetime

from sqlalchemy import BigInteger, CheckConstraint, ForeignKey, Index
from sqlalchemy.orm import Mapped, mapped_column

from workbench.registry.tables import Base

PAGE_APPEND_ONLY = ("access_token", "access_token_end", "upload", "audit")


class AccessTokenRow(Base):
    """A token by its hash, what it allows, and who made it; the token itself is kept nowhere."""

    __tablename__ = "access_token"
    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str]
    role: Mapped[str]
    sha256: Mapped[str]
    made_by: Mapped[str]
    at: Mapped[datetime]
    __table_args__ = (
        CheckConstraint("role IN ('read', 'change')", name="role"),
        Index(None, "name", unique=True),
        Index(None, "sha256", unique=True),
    )


class AccessTokenEndRow(Base):
    """A token that is not taken any more."""

    __tablename__ = "access_token_end"
    token_id: Mapped[int] = mapped_column(ForeignKey("access_token.id"), primary_key=True)
    made_by: Mapped[str]
    at: Mapped[datetime]


class UploadRow(Base):
    """A log that was dropped on the page: its name there, and what identifies its content."""

    __tablename__ = "upload"
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

    __tablename__ = "task"
    id: Mapped[int] = mapped_column(primary_key=True)
    upload_id: Mapped[str] = mapped_column(ForeignKey("upload.id"), index=True)
    kind: Mapped[str]
    state: Mapped[str]
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
        CheckConstraint("kind IN ('identify', 'trace')", name="kind"),
        CheckConstraint(
            "state IN ('waiting', 'running', 'done', 'failed', 'cancelled')", name="state"
        ),
        Index(None, "state", "id"),
    )


class AuditRow(Base):
    """A change that somebody made through the page or of its tokens: who, what, to what."""

    __tablename__ = "audit"
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
    values over the last logs, as JSON.
    """

    __tablename__ = "machine_now"
    machine: Mapped[str] = mapped_column(ForeignKey("machine.name"), primary_key=True)
    state: Mapped[str]
    heard_at: Mapped[datetime | None]
    logs: Mapped[int]
    moved: Mapped[str | None]
    moved_by: Mapped[float | None]
    moved_trend: Mapped[str | None]
    __table_args__ = (
        Index(None, "state", "machine"),
        Index(None, "heard_at", "machine"),
        Index(None, "moved_by", "machine"),
    )


class MachineTrendRow(Base):
    """A machine's parameters over its last logs, as JSON: name, then a value a log."""

    __tablename__ = "machine_trend"
    machine: Mapped[str] = mapped_column(ForeignKey("machine.name"), primary_key=True)
    trend: Mapped[str]
