"""Uploads and the work on them: a queue of tasks, each done once, whoever dies meanwhile.

A worker claims the oldest task that waits, or one whose worker is silent for longer than its lease.
What it writes counts only while the claim is its own: one that was cancelled, or taken over, finds
another state or another's token.
"""

import secrets
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any, Literal, TypeVar

from sqlalchemy import ColumnElement, and_, func, or_, select
from sqlalchemy.orm import Session

from workbench.registry.access import note
from workbench.registry.database import Database, changed
from workbench.registry.tables import TaskRow, UploadRow
from workbench.registry.values import BadRegistry, LostClaim, TaskKind

Row = TypeVar("Row", UploadRow, TaskRow)
EndState = Literal["done", "failed"]
UNDER_WAY = ("waiting", "running")
MOST_BEGUN = 3  # times that a task is begun; one that kills its workers is given up
SHOWN_UPLOADS = 50


@dataclass(frozen=True)
class Bench:
    """The uploads of a registry and the tasks on them; the token of a task identifies a claim."""

    database: Database

    def add(self, upload: UploadRow) -> None:
        """Note an upload, with who made it."""
        with self.database.writing() as session:
            session.add(upload)
            detail = f"{upload.file}, {upload.size} bytes"
            note(session, "log_dropped", upload.id, detail, by=upload.made_by, now=upload.at)

    def upload(self, upload: str) -> UploadRow:
        """The upload; raises BadRegistry where there is none."""
        with self.database.reading() as session:
            return _there(session, UploadRow, upload)

    def uploads(self) -> Sequence[UploadRow]:
        """The last uploads, the newest first."""
        query = select(UploadRow).order_by(UploadRow.at.desc(), UploadRow.id).limit(SHOWN_UPLOADS)
        return [row for (row,) in self.database.rows(query)]

    def ask(self, upload: str, kind: TaskKind, *, by: str, now: datetime) -> TaskRow:
        """A task that waits from now on; the one there is where the same is under way."""
        same = and_(TaskRow.upload == upload, TaskRow.kind == kind, TaskRow.state.in_(UNDER_WAY))
        with self.database.writing() as session:
            _there(session, UploadRow, upload, lock=True)  # which locks its tasks
            row = session.scalar(select(TaskRow).where(same))
            if row is None:
                row = TaskRow(upload=upload, kind=kind, state="waiting", stage="", share=0.0,
                              said="", begun=0, made_by=by, at=now)  # fmt: skip
                session.add(row)
                note(session, f"{kind}_asked", upload, "", by=by, now=now)
            return row

    def cancel(self, task: int, *, by: str, now: datetime) -> TaskRow:
        """The task, cancelled if it was not over; its worker stops at its next look."""
        with self.database.writing() as session:
            row = _there(session, TaskRow, task, lock=True)
            if row.state in UNDER_WAY:
                row.state, row.ended_at, row.said = "cancelled", now, f"cancelled by {by}"
                note(session, f"{row.kind}_cancelled", row.upload, "", by=by, now=now)
            return row

    def task(self, task: int) -> TaskRow:
        """The task; raises BadRegistry where there is none."""
        with self.database.reading() as session:
            return _there(session, TaskRow, task)

    def tasks(self, upload: str) -> Sequence[TaskRow]:
        """The upload's tasks in the order in which they were asked for."""
        query = select(TaskRow).where(TaskRow.upload == upload).order_by(TaskRow.id)
        return [row for (row,) in self.database.rows(query)]

    def counts(self) -> dict[str, int]:
        """How many tasks there are in each state."""
        query = select(TaskRow.state, func.count()).group_by(TaskRow.state)
        return {state: count for state, count in self.database.rows(query)}

    def claim(self, owner: str, *, lease: timedelta, now: datetime) -> TaskRow | None:
        """The next task for this worker until the lease ends; None where none waits."""
        silent = and_(TaskRow.state == "running", TaskRow.until <= now)
        free = or_(TaskRow.state == "waiting", silent)
        if not self.database.rows(select(TaskRow.id).where(free).limit(1)):
            return None  # no lock is taken where nothing waits
        first = select(TaskRow).where(free).order_by(TaskRow.id).limit(1)
        query = first.with_for_update(skip_locked=True)
        with self.database.writing() as session:
            while (row := session.scalar(query)) is not None:
                if row.begun < MOST_BEGUN:
                    row.state, row.owner, row.until = "running", owner, now + lease
                    row.begun, row.share, row.stage = row.begun + 1, 0.0, ""
                    row.token = secrets.token_hex(16)
                    return row
                row.state, row.ended_at = "failed", now
                row.said = f"begun {row.begun} times, and no worker has come to its end"
                session.flush()
        return None

    def progress(
        self, claim: TaskRow, stage: str, share: float, *, lease: timedelta, now: datetime
    ) -> None:
        """How far the task is; lengthens the lease. Raises LostClaim where it is cancelled."""
        self._write(claim, stage=stage, share=share, until=now + lease)

    def finish(self, claim: TaskRow, state: EndState, said: str, *, now: datetime) -> None:
        """The task is over; raises LostClaim where it is cancelled or another's by now."""
        share = {"share": 1.0} if state == "done" else {}
        self._write(claim, state=state, said=said, ended_at=now, **share)

    def give_back(self, claim: TaskRow) -> None:
        """The task waits again: its worker was asked to end. Nothing where it is another's."""
        begun = TaskRow.begun - 1
        with self.database.writing() as session:
            changed(session, TaskRow, _own(claim), state="waiting", token=None, until=None,
                    begun=begun)  # fmt: skip

    def _write(self, claim: TaskRow, **values: Any) -> None:
        with self.database.writing() as session:
            if changed(session, TaskRow, _own(claim), **values) != 1:
                raise LostClaim(f"task {claim.id}: cancelled, or in another worker's hands")


def _own(claim: TaskRow) -> ColumnElement[bool]:
    return and_(TaskRow.id == claim.id, TaskRow.token == claim.token, TaskRow.state == "running")


def _there(session: Session, table: type[Row], key: str | int, *, lock: bool = False) -> Row:
    """The row of an upload or a task; raises BadRegistry where there is none."""
    row = session.get(table, key, with_for_update=lock)
    if row is None:
        raise BadRegistry(f"no {table.__tablename__} {key!r}")
    return row
