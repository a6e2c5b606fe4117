"""Uploads and the work on them: a queue of tasks, each done once, whoever dies meanwhile.

A worker claims the oldest task that waits, or one whose worker is silent for longer than its lease.
What it writes counts only while the claim is its own: one that was cancelled, or taken over, finds
another state or another's token.
"""

import secrets
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any, Literal

from sqlalchemy import ColumnElement, CursorResult, and_, func, or_, select, update

from workbench.registry.access import note
from workbench.registry.database import Database
from workbench.registry.errors import BadRegistry, LostClaim
from workbench.registry.page_tables import TaskRow, UploadRow
from workbench.registry.rows import storable_text

TaskKind = Literal["identify", "trace"]
TaskState = Literal["waiting", "running", "done", "failed", "cancelled"]
EndState = Literal["done", "failed"]
UNDER_WAY = ("waiting", "running")
MOST_BEGUN = 3  # times that a task is begun; one that kills its workers is given up
SHOWN_UPLOADS = 50


@dataclass(frozen=True)
class Upload:
    """A log that was dropped: its name there, size [bytes] and fingerprint."""

    id: str
    file: str
    size: int
    sha256: str
    made_by: str
    at: datetime


@dataclass(frozen=True)
class WorkItem:
    """Work on an upload: where it stands, what goes on, the share that is done, what came of it."""

    id: int
    upload: str
    kind: TaskKind
    state: TaskState
    stage: str
    share: float
    said: str
    made_by: str
    at: datetime
    ended_at: datetime | None


@dataclass(frozen=True)
class WorkClaim:
    """A task in a worker's hands; the token identifies this claim."""

    task: WorkItem
    token: str


class Bench:
    """The uploads of a registry and the tasks on them."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def add(self, upload: Upload) -> None:
        """Note an upload, with who made it."""
        with self._database.writing() as session:
            values = {**vars(upload), "file": storable_text(upload.file)}
            session.add(UploadRow(**values))
            detail = f"{upload.file}, {upload.size} bytes"
            note(session, "log_dropped", upload.id, detail, by=upload.made_by, now=upload.at)

    def upload(self, upload: str) -> Upload:
        """The upload; raises BadRegistry where there is none."""
        with self._database.reading() as session:
            row = session.get(UploadRow, upload)
            if row is None:
                raise BadRegistry(f"no upload {upload!r}")
            return _upload(row)

    def uploads(self) -> Sequence[Upload]:
        """The last uploads, the newest first."""
        query = select(UploadRow).order_by(UploadRow.at.desc(), UploadRow.id).limit(SHOWN_UPLOADS)
        with self._database.reading() as session:
            return [_upload(row) for row in session.scalars(query)]

    def ask(self, upload: str, kind: TaskKind, *, by: str, now: datetime) -> WorkItem:
        """A task that waits from now on; the one there is where the same is under way."""
        same = and_(TaskRow.upload_id == upload, TaskRow.kind == kind, TaskRow.state.in_(UNDER_WAY))
        with self._database.writing() as session:
            # The upload's row is the lock of its tasks.
            found = session.scalar(
                select(UploadRow.id).where(UploadRow.id == upload).with_for_update()
            )
            if found is None:
                raise BadRegistry(f"no upload {upload!r}")
            row = session.scalar(select(TaskRow).where(same))
            if row is None:
                row = TaskRow(upload_id=upload, kind=kind, state="waiting", stage="", share=0.0,
                              said="", begun=0, made_by=by, at=now)  # fmt: skip
                session.add(row)
                note(session, f"{kind}_asked", upload, "", by=by, now=now)
                session.flush()
            return _task(row)

    def cancel(self, task: int, *, by: str, now: datetime) -> WorkItem:
        """The task, cancelled if it was not over; its worker stops at its next look."""
        with self._database.writing() as session:
            row = session.scalar(select(TaskRow).where(TaskRow.id == task).with_for_update())
            if row is None:
                raise BadRegistry(f"no task {task}")
            if row.state in UNDER_WAY:
                row.state, row.ended_at, row.said = "cancelled", now, f"cancelled by {by}"
                note(session, f"{row.kind}_cancelled", row.upload_id, "", by=by, now=now)
            return _task(row)

    def task(self, task: int) -> WorkItem:
        """The task; raises BadRegistry where there is none."""
        with self._database.reading() as session:
            row = session.get(TaskRow, task)
            if row is None:
                raise BadRegistry(f"no task {task}")
            return _task(row)

    def tasks(self, upload: str) -> Sequence[WorkItem]:
        """The upload's tasks in the order in which they were asked for."""
        query = select(TaskRow).where(TaskRow.upload_id == upload).order_by(TaskRow.id)
        with self._database.reading() as session:
            return [_task(row) for row in session.scalars(query)]

    def counts(self) -> dict[str, int]:
        """How many tasks there are in each state."""
        query = select(TaskRow.state, func.count()).group_by(TaskRow.state)
        with self._database.reading() as session:
            return {state: count for state, count in session.execute(query)}

    def claim(self, owner: str, *, lease: timedelta, now: datetime) -> WorkClaim | None:
        """The next task for this worker until the lease ends; None where none waits."""
        silent = and_(TaskRow.state == "running", TaskRow.until <= now)
        free = or_(TaskRow.state == "waiting", silent)
        with self._database.reading() as session:
            if session.scalar(select(TaskRow.id).where(free).limit(1)) is None:
                return None  # no lock is taken where nothing waits
        first = select(TaskRow).where(free).order_by(TaskRow.id).limit(1)
        query = first.with_for_update(skip_locked=True)
        with self._database.writing() as session:
            while (row := session.scalar(query)) is not None:
                if row.begun < MOST_BEGUN:
                    token = secrets.token_hex(16)
                    row.state, row.token, row.owner, row.until = (
                        "running",
                        token,
                        owner,
                        now + lease,
                    )
                    row.begun, row.share, row.stage = row.begun + 1, 0.0, ""
                    session.flush()
                    return WorkClaim(_task(row), token)
                row.state, row.ended_at = "failed", now
                row.said = f"begun {row.begun} times, and no worker has come to its end"
                session.flush()
        return None

    def progress(
        self, claim: WorkClaim, stage: str, share: float, *, lease: timedelta, now: datetime
    ) -> None:
        """How far the task is; lengthens the lease. Raises LostClaim where it is cancelled."""
        self._write(claim, stage=stage, share=share, until=now + lease)

    def finish(self, claim: WorkClaim, state: EndState, said: str, *, now: datetime) -> None:
        """The task is over; raises LostClaim where it is cancelled or another's by now."""
        share = {"share": 1.0} if state == "done" else {}
        self._write(claim, state=state, said=storable_text(said), ended_at=now, **share)

    def give_back(self, claim: WorkClaim) -> None:
        """The task waits again: its worker was asked to end. Nothing where it is another's."""
        with self._database.writing() as session:
            values = {"state": "waiting", "token": None, "until": None, "begun": TaskRow.begun - 1}
            session.execute(update(TaskRow).where(_own(claim)).values(values))

    def _write(self, claim: WorkClaim, **values: Any) -> None:
        with self._database.writing() as session:
            done: Any = session.execute(update(TaskRow).where(_own(claim)).values(**values))
            result: CursorResult[Any] = done
            if result.rowcount != 1:
                raise LostClaim(f"task {claim.task.id}: cancelled, or in another worker's hands")


def _own(claim: WorkClaim) -> ColumnElement[bool]:
    return and_(
        TaskRow.id == claim.task.id, TaskRow.token == claim.token, TaskRow.state == "running"
    )


def _upload(row: UploadRow) -> Upload:
    return Upload(row.id, row.file, row.size, row.sha256, row.made_by, row.at)


def _task(row: TaskRow) -> WorkItem:
    kind: Any = row.kind
    state: Any = row.state
    return WorkItem(
        row.id, row.upload_id, kind, state, row.stage, row.share, row.said, row.made_by, row.at,
        row.ended_at,
    )  # fmt: skip
