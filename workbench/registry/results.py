"""A machine's results as its page shows them: the last ones, and their way to the webhook."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Literal

from sqlalchemy import and_, func, select

from workbench.registry.database import Database
from workbench.registry.page_tables import MachineNowRow
from workbench.registry.rows import judged_now
from workbench.registry.tables import LogRow, NoticeRow, OutboxRow, OutcomeRow, VersionRow

Delivered = Literal["", "sent", "waiting", "given up"]


@dataclass(frozen=True)
class TestedLog:
    """A log of the machine, when it was recorded and tested; verdict None: it waits.

    parameters: what it gave of each; delivered: whether the webhook has taken its alarm.
    """

    file: str
    sha256: str
    recorded_at: float
    verdict: str | None
    reason: str
    number: int | None
    at: datetime | None
    parameters: Sequence[Mapping[str, Any]]
    delivered: Delivered


def last_logs(database: Database, machine: str, last: int) -> Sequence[TestedLog]:
    """The machine's last logs by the time of their files, the newest first."""
    sent = and_(NoticeRow.log_id == OutcomeRow.log_id, NoticeRow.turn == OutcomeRow.turn)
    queued = and_(OutboxRow.log_id == OutcomeRow.log_id, OutboxRow.turn == OutcomeRow.turn)
    query = (
        select(LogRow, OutcomeRow, VersionRow.number, NoticeRow.at, OutboxRow)
        .select_from(LogRow)
        .outerjoin(OutcomeRow, judged_now())
        .outerjoin(VersionRow, VersionRow.id == OutcomeRow.version_id)
        .outerjoin(NoticeRow, sent)
        .outerjoin(OutboxRow, queued)
        .where(LogRow.machine == machine)
        .order_by(LogRow.mtime_ns.desc(), LogRow.file.desc(), LogRow.id.desc())
        .limit(last)
    )
    with database.reading() as session:
        return [_judged(*row) for row in session.execute(query)]


def condition(database: Database, machine: str) -> str:
    """The machine's state by its last log; "no_log" where nothing is known of it."""
    with database.reading() as session:
        found = session.scalar(select(MachineNowRow.state).where(MachineNowRow.machine == machine))
    return found or "no_log"


def log_count(database: Database, machine: str) -> int:
    """How many logs of the machine there are."""
    query = select(func.count(LogRow.id)).where(LogRow.machine == machine)
    with database.reading() as session:
        return session.scalar(query) or 0


def _judged(
    log: LogRow, done: OutcomeRow | None, number: int | None, sent: datetime | None,
    queued: OutboxRow | None,
) -> TestedLog:  # fmt: skip
    recorded = log.mtime_ns / 1e9
    if done is None:
        return TestedLog(log.file, log.sha256, recorded, None, "", None, None, (), "")
    drift = json.loads(done.evidence).get("drift") or {}
    delivered: Delivered = "sent" if sent else ""
    if queued is not None:
        delivered = "waiting" if queued.given_up_at is None else "given up"
    parameters = tuple(drift.get("parameters") or ())
    return TestedLog(log.file, log.sha256, recorded, done.verdict, done.reason, number, done.at,
                     parameters, delivered)  # fmt: skip
