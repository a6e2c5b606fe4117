"""A machine's last results as its page shows them, and their way to the webhook."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Literal

from sqlalchemy import and_, select

from design.judgement import ALARMING
from workbench.registry.database import Database
from workbench.registry.rows import accepted_version, judged_now
from workbench.registry.tables import (
    LogRow,
    MachineNowRow,
    NoticeRow,
    OutboxRow,
    OutcomeRow,
    VersionRow,
)

Delivered = Literal["", "sent", "waiting", "given up"]


@dataclass(frozen=True)
class TestedLog:
    """A log of the machine, when it was recorded and tested; verdict None: it waits.

    parameters: what it gave of each; delivered: whether the webhook has taken its alarm; sound:
    whether it is of the machine as somebody has accepted it, and no alarm.
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
    sound: bool


def last_logs(
    database: Database, machine: str, last: int, *, sound: bool = False
) -> Sequence[TestedLog]:
    """The machine's last logs by the time of their files, the newest first.

    sound: those alone that were tested against the model of the version that a person has
    activated last, and were no alarm.
    """
    sent = and_(NoticeRow.log_id == OutcomeRow.log_id, NoticeRow.turn == OutcomeRow.turn)
    queued = and_(OutboxRow.log_id == OutcomeRow.log_id, OutboxRow.turn == OutcomeRow.turn)
    with database.reading() as session:
        accepted = accepted_version(session, machine)
        model = None if accepted is None else accepted.model_id
    of_accepted = VersionRow.model_id.is_not_distinct_from(model)
    is_sound = and_(of_accepted, OutcomeRow.verdict.not_in(ALARMING)).is_(True)
    query = (
        select(LogRow, OutcomeRow, VersionRow.number, NoticeRow.at, OutboxRow, is_sound)
        .select_from(LogRow)
        .outerjoin(OutcomeRow, judged_now())
        .outerjoin(VersionRow, VersionRow.id == OutcomeRow.version_id)
        .outerjoin(NoticeRow, sent)
        .outerjoin(OutboxRow, queued)
        .where(LogRow.machine == machine, *([is_sound] if sound else ()))
        .order_by(LogRow.mtime_ns.desc(), LogRow.file.desc(), LogRow.id.desc())
        .limit(last)
    )
    return [_judged(*row) for row in database.rows(query)]


def condition(database: Database, machine: str) -> str:
    """The machine's state by its last log; "no_log" where nothing is known of it."""
    with database.reading() as session:
        found = session.scalar(select(MachineNowRow.state).where(MachineNowRow.machine == machine))
    return found or "no_log"


def _judged(
    log: LogRow, done: OutcomeRow | None, number: int | None, sent: datetime | None,
    queued: OutboxRow | None, sound: bool,
) -> TestedLog:  # fmt: skip
    own = (log.file, log.sha256, log.mtime_ns / 1e9)
    if done is None:
        return TestedLog(*own, None, "", None, None, (), "", False)
    delivered: Delivered = "sent" if sent else ""
    if queued is not None:
        delivered = "waiting" if queued.given_up_at is None else "given up"
    parameters = tuple((done.evidence.get("drift") or {}).get("parameters") or ())
    return TestedLog(*own, done.verdict, done.reason, number, done.at, parameters, delivered, sound)
