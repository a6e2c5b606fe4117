"""Alarms on their way to a webhook: each is kept until it is taken, and delayed by itself alone."""

from collections.abc import Sequence
from datetime import datetime, timedelta
from typing import Any

from sqlalchemy import (
    ColumnElement,
    CursorResult,
    Select,
    and_,
    case,
    delete,
    func,
    literal,
    select,
    update,
)
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import Session

from workbench.registry.database import Database
from workbench.registry.rows import lock_machine
from workbench.registry.tables import LogRow, NoticeRow, OutboxRow, OutcomeRow, VersionRow
from workbench.registry.values import Alarm, LogVerdict

FIRST_DELAY = timedelta(minutes=1)  # after an alarm's first refusal; each further one doubles it
LONGEST_DELAY = timedelta(hours=4)


class Outbox:
    """The alarms that no webhook has taken yet."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def fill(self, verdicts: Sequence[LogVerdict], *, since: datetime, now: datetime) -> None:
        """Put the results of these verdicts from `since` on into it that never were in it."""
        delivered = and_(NoticeRow.log_id == OutcomeRow.log_id, NoticeRow.turn == OutcomeRow.turn)
        here = and_(OutboxRow.log_id == OutcomeRow.log_id, OutboxRow.turn == OutcomeRow.turn)
        at = literal(now, OutboxRow.next_at.type)
        new = (
            select(OutcomeRow.log_id, OutcomeRow.turn, literal(0), at)
            .outerjoin(NoticeRow, delivered)
            .outerjoin(OutboxRow, here)
            .where(
                OutcomeRow.verdict.in_(verdicts),
                OutcomeRow.at >= since,
                NoticeRow.log_id.is_(None),
                OutboxRow.log_id.is_(None),
            )
        )
        insert = postgresql.insert if self._database.dialect == "postgresql" else sqlite.insert
        columns = ["log_id", "turn", "refusals", "next_at"]
        with self._database.writing() as session:
            session.execute(insert(OutboxRow).from_select(columns, new).on_conflict_do_nothing())

    def due(self, now: datetime) -> tuple[Alarm, ...]:
        """The alarms to be tried now: those never tried first, then the oldest."""
        query = _alarms().where(OutboxRow.next_at <= now, OutboxRow.given_up_at.is_(None))
        with self._database.reading() as session:
            return tuple(_alarm(row) for row in session.execute(query))

    def take(self, alarm: Alarm, *, until: datetime, now: datetime) -> bool:
        """Whether the alarm is this worker's to send until then; False where another was first."""
        free = and_(_place(alarm), OutboxRow.next_at <= now, OutboxRow.given_up_at.is_(None))
        return self._change(free, next_at=until, tried_at=now) == 1

    def give_back(self, alarm: Alarm, *, now: datetime) -> None:
        """The alarm was not refused, only not reached: it is due again at once."""
        self._change(_place(alarm), next_at=now)

    def sent(self, alarm: Alarm, *, now: datetime) -> None:
        """Note that the webhook has taken the alarm; nothing where it is noted already."""
        with self._database.writing() as session:
            lock_machine(session, alarm.machine, now)
            if session.get(NoticeRow, (alarm.log_id, alarm.turn)) is None:
                session.add(NoticeRow(log_id=alarm.log_id, turn=alarm.turn, at=now))
            session.execute(delete(OutboxRow).where(_place(alarm)))

    def refused(self, alarm: Alarm, *, now: datetime) -> datetime:
        """When the alarm is tried again, now that it has been refused once more."""
        with self._database.writing() as session:
            query = select(OutboxRow).where(_place(alarm)).with_for_update()
            row = session.scalar(query)
            if row is None:  # another worker has brought it there meanwhile
                return now
            row.next_at = now + wait(row.refusals)
            row.refusals += 1
            return row.next_at

    def give_up(self, *, before: datetime, now: datetime) -> tuple[Alarm, ...]:
        """The alarms of results before that moment, which are not tried from now on."""
        late = _alarms().where(OutcomeRow.at < before, OutboxRow.given_up_at.is_(None))
        with self._database.writing() as session:
            found = [_alarm(row) for row in session.execute(late.with_for_update(of=OutboxRow))]
            for alarm in found:
                session.execute(update(OutboxRow).where(_place(alarm)).values(given_up_at=now))
            return tuple(found)

    def counts(self, now: datetime) -> dict[str, tuple[int, int]]:
        """How many alarms of each machine wait, and how many have been given up.

        One that a worker tries for the first time at this moment is neither.
        """
        in_hand = and_(OutboxRow.refusals == 0, OutboxRow.next_at > now)
        kind = case((OutboxRow.given_up_at.is_not(None), 1), (in_hand, None), else_=0)
        query = (
            select(LogRow.machine, func.count(kind) - func.sum(kind), func.sum(kind))
            .join(OutboxRow, OutboxRow.log_id == LogRow.id)
            .where(kind.is_not(None))
            .group_by(LogRow.machine)
        )
        with self._database.reading() as session:
            rows = session.execute(query)
            return {machine: (int(waiting), int(lost)) for machine, waiting, lost in rows}

    def _change(self, where: ColumnElement[bool], **values: datetime) -> int:
        """How many rows were there to be changed."""
        with self._database.writing() as session:
            return _changed(session, where, values)


def wait(refusals: int) -> timedelta:
    """How long an alarm waits that had been refused this often before."""
    doubled: timedelta = FIRST_DELAY * 2 ** min(refusals, 16)
    return min(doubled, LONGEST_DELAY)


def _changed(session: Session, where: ColumnElement[bool], values: dict[str, datetime]) -> int:
    done: Any = session.execute(update(OutboxRow).where(where).values(**values))
    result: CursorResult[Any] = done
    return result.rowcount


def _place(alarm: Alarm) -> ColumnElement[bool]:
    return and_(OutboxRow.log_id == alarm.log_id, OutboxRow.turn == alarm.turn)


def _alarms() -> Select[Any]:
    """What `_alarm` is made of."""
    number = (
        select(VersionRow.number)
        .where(VersionRow.id == OutcomeRow.version_id)
        .correlate(OutcomeRow)
        .scalar_subquery()
    )
    result = and_(OutcomeRow.log_id == OutboxRow.log_id, OutcomeRow.turn == OutboxRow.turn)
    return (
        select(
            OutboxRow.log_id, OutboxRow.turn, LogRow.machine, LogRow.file, LogRow.sha256,
            OutcomeRow.verdict, OutcomeRow.reason, number, OutcomeRow.at,
        )
        .join(OutcomeRow, result)
        .join(LogRow, LogRow.id == OutboxRow.log_id)
        .order_by(OutboxRow.tried_at.nulls_first(), OutcomeRow.at, LogRow.id)
    )  # fmt: skip


def _alarm(row: Any) -> Alarm:
    return Alarm(*row)
