"""New logs and who has them in hand: one result a log, however many workers and whatever dies.

A machine's logs are tested one after the other, since a result may change what the next is tested
against. So a worker claims a machine, for the time of a lease that it renews. Every result is one
transaction that holds only while the claim does: a worker that has been taken for dead and comes
back finds another's token, and its result is dropped.
"""

import secrets
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import datetime, timedelta

from sqlalchemy import ColumnElement, and_, delete, func, select
from sqlalchemy.orm import Session

from design.judgement import Candidate, Document, Judgement
from workbench.registry import rows
from workbench.registry.database import Database, changed
from workbench.registry.overview import summary_tested
from workbench.registry.tables import (
    AttemptRow,
    ClaimRow,
    LogRow,
    MachineNowRow,
    OutcomeRow,
    ReopeningRow,
    VersionRow,
)
from workbench.registry.values import (
    BadRegistry,
    Claim,
    DecisionKind,
    LogOutcome,
    LostClaim,
    Order,
    SeenLog,
    Version,
    newest_of_later,
    of_row,
)

OFTEN = 5
OLDER = "older_than"  # key of the evidence that names the newer log behind the active model
CLOCKS_APART = timedelta(minutes=1)  # by which the clocks of workers may differ
MILLISECOND = timedelta(milliseconds=1)
SHORTEST = 4  # characters of a fingerprint by which a log may be named


@dataclass(frozen=True)
class Queue:
    """The logs of machines that wait for a result, and the claims on them."""

    database: Database

    def known(self, machine: str) -> dict[tuple[str, int, int], str]:
        """Fingerprints of the logs seen, by file name, size and modification time."""
        query = select(LogRow.file, LogRow.size, LogRow.mtime_ns, LogRow.sha256)
        found = self.database.rows(query.where(LogRow.machine == machine))
        return {(file, size, mtime_ns): sha256 for file, size, mtime_ns, sha256 in found}

    def announce(self, machine: str, logs: Sequence[SeenLog], *, now: datetime) -> int:
        """How many of the logs are new; they wait from now on."""
        if not logs:
            return 0
        with self.database.writing() as session:
            rows.lock_machine(session, machine, now)
            query = select(LogRow.sha256).where(LogRow.machine == machine)
            have = set(session.scalars(query))
            new: dict[str, SeenLog] = {}
            for log in logs:
                if log.sha256 not in have:
                    new.setdefault(log.sha256, log)
            every = new.values()
            session.add_all(LogRow(machine=machine, seen_at=now, **vars(log)) for log in every)
            if new:
                own, logs_now = MachineNowRow.machine == machine, MachineNowRow.logs + len(new)
                changed(session, MachineNowRow, own, heard_at=now, logs=logs_now)
            return len(new)

    def claim(
        self,
        machine: str,
        *,
        owner: str,
        lease: timedelta,
        now: datetime,
        gone: Callable[[str], bool] = lambda _owner: False,
    ) -> Claim | None:
        """The machine for this worker until the lease ends; None while another has it.

        gone: whether a worker of that name is known to have died; its lease ends at once. A lease
        that ends later than any clock about as fast as this one could have set it is not waited
        for: should its worker live on, its result is dropped and made again.
        """
        with self.database.writing() as session:
            rows.lock_machine(session, machine, now)
            row = session.get(ClaimRow, machine)
            held = row is not None and row.until > now and not _too_late(row, now)
            if row is not None and held and not gone(row.owner):
                return None
            found = Claim(machine, secrets.token_hex(16), owner, now + lease)
            session.merge(ClaimRow(**vars(found), lease_ms=round(lease / MILLISECOND)))
            return found

    def holder(self, machine: str) -> str:
        """Who has the machine in hand, and until when unless it goes on; "" where nobody has."""
        with self.database.reading() as session:
            row = session.get(ClaimRow, machine)
            return "" if row is None else f"worker {row.owner} has it until {row.until:%H:%M:%S}Z"

    def renew(self, claim: Claim, *, lease: timedelta, now: datetime) -> None:
        """Lengthen the lease; raises LostClaim where another has taken over."""
        with self.database.writing() as session:
            row = _hold(session, claim, now)
            row.until, row.lease_ms = now + lease, round(lease / MILLISECOND)

    def release(self, claim: Claim) -> None:
        """Give the machine back; nothing where another has taken over."""
        with self.database.writing() as session:
            session.execute(delete(ClaimRow).where(_own(claim)))

    def newer_behind(
        self, machine: str, log: SeenLog, order: Order = "time-or-name"
    ) -> SeenLog | None:
        """Of the logs behind the machine's models, the newest that `log` is older than; or None."""
        with self.database.reading() as session:
            return _newer(session, machine, log, order)

    def waiting(self, machine: str) -> tuple[tuple[SeenLog, int], ...]:
        """Logs without a result and how often each was begun; oldest first.

        One begun `OFTEN` times comes last: it may be what its workers die of.
        """
        begun = func.count(AttemptRow.id)
        now = and_(AttemptRow.log_id == LogRow.id, AttemptRow.turn == rows.turn())
        query = (
            select(LogRow, begun)
            .select_from(LogRow)
            .outerjoin(OutcomeRow, rows.judged_now())
            .outerjoin(AttemptRow, now)
            .where(LogRow.machine == machine, OutcomeRow.log_id.is_(None))
            .group_by(LogRow.id)
            .order_by(LogRow.mtime_ns, LogRow.file, LogRow.id)
        )
        found = [(of_row(SeenLog, row), int(count)) for row, count in self.database.rows(query)]
        return tuple(sorted(found, key=lambda entry: max(entry[1] - OFTEN + 1, 0)))

    def begin(self, claim: Claim, log: SeenLog, *, now: datetime) -> None:
        """Note that the worker begins with a log; raises LostClaim."""
        with self.database.writing() as session:
            _hold(session, claim, now)
            row, now_turn = _log(session, claim.machine, log)
            session.add(AttemptRow(log_id=row.id, turn=now_turn, token=claim.token,
                                   owner=claim.owner, at=now))  # fmt: skip

    def finish(
        self,
        claim: Claim,
        log: SeenLog,
        judgement: Judgement,
        *,
        by: str,
        now: datetime,
        order: Order = "time-or-name",
    ) -> LogOutcome:
        """Record a log's result, with its candidate and the decision on it, all or nothing.

        What an older log than one behind the active model has led to is recorded and not
        activated. A second call with the same claim gives the first's: a commit may have been kept
        although its answer was lost. Raises LostClaim where another has taken over.
        """
        with self.database.writing() as session:
            rows.lock_machine(session, claim.machine, now)
            row, now_turn = _log(session, claim.machine, log)
            done = session.get(OutcomeRow, (row.id, now_turn))
            if done is not None and done.token == claim.token:
                return _recorded(session, done)
            _hold(session, claim, now)
            current = rows.active_version(session, claim.machine)
            accepted = rows.accepted_version(session, claim.machine)
            newer = _newer(session, claim.machine, log, order)
            if newer is not None:
                judgement = _of_older(judgement, log, newer)
            for kind, candidate, reason in _decided(judgement):
                version, _ = rows.add_version(session, claim.machine, candidate, now)
                rows.decide(session, kind, version, reason=reason, by=by, now=now,
                            evidence=judgement.evidence, log_id=row.id)  # fmt: skip
            done = OutcomeRow(
                log_id=row.id,
                turn=now_turn,
                version_id=None if current is None else current.id,
                verdict=judgement.verdict,
                reason=judgement.reason,
                evidence=judgement.evidence,
                token=claim.token,
                at=now,
            )
            session.add(done)
            if newer is None:
                of_accepted = (
                    accepted is None or current is None or (current.model_id == accepted.model_id)
                )
                summary_tested(
                    session, claim.machine, judgement.verdict, judgement.evidence, of_accepted
                )
            session.flush()
            session.expire(done)  # so that it is read as the database keeps it
            return _recorded(session, done)

    def reopen(
        self, machine: str, logs: Sequence[str], *, reason: str, by: str, now: datetime
    ) -> tuple[str, ...]:
        """Files that wait again from now on; their earlier results stay.

        logs: names or beginnings of fingerprints of logs with a result, none: all that were
        excluded. Raises BadRegistry where one is not there or waits anyhow.
        """
        with self.database.writing() as session:
            rows.need_machine(session, machine, lock=True)
            query = select(LogRow, OutcomeRow.verdict).join(OutcomeRow, rows.judged_now())
            found = session.execute(query.where(LogRow.machine == machine).order_by(LogRow.id))
            judged = [(row, verdict) for row, verdict in found]
            chosen = [row for row, verdict in judged if not logs and verdict == "set_aside"]
            for name in dict.fromkeys(logs):
                own = _named(machine, name, [row for row, _ in judged])
                chosen += [row for row in own if row not in chosen]
            for row in chosen:
                session.add(ReopeningRow(log_id=row.id, reason=reason, made_by=by, at=now))
            return tuple(row.file for row in chosen)

    def last_evidence(self, version: Version) -> Document | None:
        """Evidence of the latest result against this version; None where there is none yet.

        That of a log older than the version's own is left out: it is of the machine before.
        """
        query = (
            select(OutcomeRow.evidence)
            .join(VersionRow, VersionRow.id == OutcomeRow.version_id)
            .where(
                VersionRow.machine == version.machine,
                VersionRow.number == version.number,
                OutcomeRow.verdict != "set_aside",
            )
            .order_by(OutcomeRow.at.desc(), OutcomeRow.log_id.desc())
        )
        with self.database.reading() as session:
            return next((found for found in session.scalars(query) if OLDER not in found), None)

    def outcomes(self, machine: str) -> tuple[LogOutcome, ...]:
        """Results of a machine's logs, in the order of their files."""
        order = (LogRow.mtime_ns, LogRow.file, LogRow.id, OutcomeRow.turn)
        found = self.database.rows(_OUTCOMES.where(LogRow.machine == machine).order_by(*order))
        return tuple(_outcome(*row) for row in found)

    def verdicts(self) -> dict[tuple[str, str], int]:
        """How many logs have each verdict, by machine and verdict."""
        query = (
            select(LogRow.machine, OutcomeRow.verdict, func.count())
            .join(OutcomeRow, rows.judged_now())
            .group_by(LogRow.machine, OutcomeRow.verdict)
        )
        return {(name, verdict): count for name, verdict, count in self.database.rows(query)}


def _newer(session: Session, machine: str, log: SeenLog, order: Order) -> SeenLog | None:
    """As `Queue.newer_behind`; a name that the machine has used before gives no order."""
    query = select(func.count(LogRow.id)).where(
        LogRow.machine == machine, LogRow.file == log.file, LogRow.sha256 != log.sha256
    )
    used_before = bool(session.scalar(query))
    behind = rows.logs_behind(session, machine)
    return newest_of_later(log, behind, "time" if used_before else order)


def _of_older(judgement: Judgement, log: SeenLog, newer: SeenLog) -> Judgement:
    """The judgement of a log older than `newer`, from which a model comes: nothing is promoted."""
    promoted = judgement.verdict == "promoted"
    so = "not made active: " if promoted else ""
    said = f"{so}{log.file} is older than {newer.file}, from which a later model comes"
    return replace(
        judgement,
        verdict="refused" if promoted else judgement.verdict,
        reason=f"{judgement.reason}; {said}",
        evidence={**judgement.evidence, OLDER: {"file": newer.file, "sha256": newer.sha256}},
    )


def _named(machine: str, name: str, logs: Sequence[LogRow]) -> list[LogRow]:
    """The logs of that file name, or the one whose fingerprint begins so; raises BadRegistry."""
    found = [row for row in logs if row.file == name]
    if found:
        return found
    found = [row for row in logs if len(name) >= SHORTEST and row.sha256.startswith(name)]
    if len(found) > 1:
        raise BadRegistry(
            f"{machine}: {len(found)} logs have a fingerprint that begins with {name!r}; give"
            " more of it, or the file's name"
        )
    if not found:
        raise BadRegistry(
            f"{machine}: no log {name!r} with a result; give a file's name or at least {SHORTEST}"
            f" characters of a fingerprint, as 'workbench registry show {machine}' has them"
        )
    return found


def _decided(judgement: Judgement) -> Iterator[tuple[DecisionKind, Candidate, str]]:
    """The decisions that a judgement means, the one that may move the pointer last."""
    if judgement.rival is not None:
        yield "refused", *judgement.rival
    if judgement.candidate is not None:
        kind: DecisionKind = "promoted" if judgement.verdict == "promoted" else "refused"
        yield kind, judgement.candidate, judgement.reason


def _too_late(row: ClaimRow, now: datetime) -> bool:
    """Whether the claim was made by a clock that is ahead of this one by more than they may be."""
    return row.lease_ms is not None and row.until > now + row.lease_ms * MILLISECOND + CLOCKS_APART


def _hold(session: Session, claim: Claim, now: datetime) -> ClaimRow:
    """The claim's row, locked; raises LostClaim where it is another's by now."""
    rows.lock_machine(session, claim.machine, now)
    row = session.scalar(select(ClaimRow).where(_own(claim)))
    if row is None:
        raise LostClaim(
            f"{claim.machine}: the lease has ended and another worker has taken over; its result"
            " counts"
        )
    return row


def _own(claim: Claim) -> ColumnElement[bool]:
    return and_(ClaimRow.machine == claim.machine, ClaimRow.token == claim.token)


def _log(session: Session, machine: str, log: SeenLog) -> tuple[LogRow, int]:
    """The log's row, and how often it was reopened."""
    own = (LogRow.machine == machine, LogRow.sha256 == log.sha256)
    row, reopened = session.execute(select(LogRow, rows.turn()).where(*own)).one()
    return row, reopened


_OUTCOMES = (
    select(OutcomeRow, LogRow, VersionRow.number)
    .join(LogRow, LogRow.id == OutcomeRow.log_id)
    .outerjoin(VersionRow, VersionRow.id == OutcomeRow.version_id)
)


def _recorded(session: Session, done: OutcomeRow) -> LogOutcome:
    own = (OutcomeRow.log_id == done.log_id, OutcomeRow.turn == done.turn)
    return _outcome(*session.execute(_OUTCOMES.where(*own)).one())


def _outcome(row: OutcomeRow, log: LogRow, number: int | None) -> LogOutcome:
    seen = of_row(SeenLog, log)
    return of_row(LogOutcome, row, machine=log.machine, log=seen, number=number)
