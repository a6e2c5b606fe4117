"""Alarms on their way to a webhook: each is kept until it is taken, and delayed by itself alone."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any

from sqlalchemy import ColumnElement, Select, and_, case, delete, func, literal, select

from design.judgement import LogVerdict
from workbench.registry.database import Database, changed, insert_missing
from workbench.registry.rows import lock_machine
from workbench.registry.tables import LogRow, NoticeRow, OutboxRow, OutcomeRow, VersionRow
from workbench.registry.values import Alarm

FIRST_DELAY = timedelta(minutes=1)  # after an alarm's first refusal; each further one doubles it
LONGEST_DELAY = timedelta(hours=4)


@dataclass(frozen=True)
class Outbox:
    """The alarms that no webhook has taken yet."""

    database: Database

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
        columns = ["log_id", "turn", "refusals", "next_at"]
        with self.database.writing() as session:
            session.execute(insert_missing(session, OutboxRow).from_select(columns, new))

    def due(self, now: datetime) -> tuple[Alarm, ...]:
        """The alarms to be tried now: those never tried first, then the oldest."""
        query = _alarms().where(OutboxRow.next_at <= now, OutboxRow.given_up_at.is_(None))
        return tuple(Alarm(*row) for row in self.database.rows(query))

    def take(self, alarm: Alarm, *, until: datetime, now: datetime) -> bool:
        """Whether the alarm is this worker's to send until then; False where another was first."""
        free = and_(_place(alarm), OutboxRow.next_at <= now, OutboxRow.given_up_at.is_(None))
        return self._change(free, next_at=until, tried_at=now) == 1

    def give_back(self, alarm: Alarm, *, now: datetime) -> None:
        """The alarm was not refused, only not reached: it is due again at once."""
        self._change(_place(alarm), next_at=now)

    def sent(self, alarm: Alarm, *, now: datetime) -> None:
        """Note that the webhook has taken the alarm; nothing where it is noted already."""
        with self.database.writing() as session:
            lock_machine(session, alarm.machine, now)
            if session.get(NoticeRow, (alarm.log_id, alarm.turn)) is None:
                session.add(NoticeRow(log_id=alarm.log_id, turn=alarm.turn, at=now))
            session.execute(delete(OutboxRow).where(_place(alarm)))

    def refused(self, alarm: Alarm, *, now: datetime) -> datetime:
        """When the alarm is tried again, now that it has been refused once more."""
        with self.database.writing() as session:
            row = session.scalar(select(OutboxRow).where(_place(alarm)).with_for_update())
            if row is None:  # another worker has brought it there meanwhile
                return now
            row.next_at = now + wait(row.refusals)
            row.refusals += 1
            return row.next_at

    def give_up(self, *, before: datetime, now: datetime) -> tuple[Alarm, ...]:
        """The alarms of results before that moment, which are not tried from now on."""
        late = _alarms().where(OutcomeRow.at < before, OutboxRow.given_up_at.is_(None))
        with self.database.writing() as session:
            rows = session.execute(late.with_for_update(of=OutboxRow)).all()
            found = tuple(Alarm(*row) for row in rows)
            for alarm in found:
                changed(session, OutboxRow, _place(alarm), given_up_at=now)
            return found

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
        rows = self.database.rows(query)
        return {machine: (int(waiting), int(lost)) for machine, waiting, lost in rows}

    def _change(self, where: ColumnElement[bool], **values: datetime) -> int:
        """How many rows were there to be changed."""
        with self.database.writing() as session:
            return changed(session, OutboxRow, where, **values)


def wait(refusals: int) -> timedelta:
    """How long an alarm waits that had been refused this often before."""
    doubled: timedelta = FIRST_DELAY * 2 ** min(refusals, 16)
    return min(doubled, LONGEST_DELAY)


def _place(alarm: Alarm) -> ColumnElement[bool]:
    return and_(OutboxRow.log_id == alarm.log_id, OutboxRow.turn == alarm.turn)


def _alarms() -> Select[Any]:
    """Alarms, each as the fields of an `Alarm`."""
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
