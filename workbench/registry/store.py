"""The registry of machines: the active version, the earlier ones, and why it changed."""

import re
from collections.abc import Sequence
from contextlib import AbstractContextManager
from datetime import datetime
from typing import Any, get_args

from sqlalchemy import Select, func, select
from sqlalchemy.orm import Session

from design.judgement import Candidate
from workbench.registry import rows
from workbench.registry.database import Database
from workbench.registry.tables import (
    ActiveVersionRow,
    DecisionRow,
    LogRow,
    MachineRow,
    OutcomeRow,
    RecordRow,
    VersionRow,
)
from workbench.registry.values import MOVES, BadRegistry, Decision, Kind, MachineState, Version

_NAME = re.compile(r"[^/\\\x00-\x1f\x7f]+")


class Registry(AbstractContextManager["Registry"]):
    """Models, designs and validations of machines, append-only, one active version a machine.

    where: a file of SQLite or a PostgreSQL URL. Everything that changes is one transaction. All
    raise BadRegistry for a question it cannot answer, RegistryAway where the database is away.
    """

    def __init__(self, where: str, *, create: bool = True) -> None:
        self.database = Database(where, create=create)

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Give every connection back."""
        self.database.close()

    def add(
        self, machine: str, candidate: Candidate, *, reason: str, by: str, now: datetime
    ) -> Version:
        """The version that holds these documents; not active yet. The same again adds nothing.

        Raises BadRegistry where the name could be no folder's.
        """
        if not machine or machine.startswith((".", "_")) or not _NAME.fullmatch(machine):
            raise BadRegistry(
                f"machine {machine!r}: a name needed that can be a folder's, as bench-a"
            )
        with self.database.writing() as session:
            rows.lock_machine(session, machine, now)
            row, new = rows.add_version(session, machine, candidate, now)
            if new:
                rows.decide(session, "added", row, reason=reason, by=by, now=now)
            return rows.version_value(session, row)

    def promote(
        self, machine: str, number: int, *, reason: str, by: str, now: datetime
    ) -> Decision:
        """Activate a version, or accept the active one that a worker has put there.

        Raises BadRegistry where it is accepted and active already, or is not there.
        """
        with self.database.writing() as session:
            rows.need_machine(session, machine, lock=True)
            row = rows.numbered(session, machine, number)
            current = rows.active_version(session, machine)
            accepted = rows.accepted_version(session, machine)
            if current is not None and accepted is not None and current.id == row.id == accepted.id:
                raise BadRegistry(f"{machine}: version {number} is active already")
            made = rows.decide(session, "promoted", row, reason=reason, by=by, now=now)
            return rows.decisions(session, DecisionRow.id == made.id)[0]

    def rollback(self, machine: str, *, reason: str, by: str, now: datetime) -> Decision:
        """Activate the version before the present one; a second call goes further."""
        with self.database.writing() as session:
            rows.need_machine(session, machine, lock=True)
            earlier = self._earlier(session, machine)
            if len(earlier) < 2:
                have = "no version has been active"
                if earlier:
                    first = session.get_one(VersionRow, earlier[0])
                    have = f"version {first.number} is the first that was active"
                raise BadRegistry(f"{machine}: {have}, so there is none to go back to")
            row = session.get_one(VersionRow, earlier[-2])
            made = rows.decide(session, "rolled_back", row, reason=reason, by=by, now=now)
            return rows.decisions(session, DecisionRow.id == made.id)[0]

    def machines(self) -> tuple[MachineState, ...]:
        """Every machine by name."""
        with self.database.reading() as session:
            return _states(session)

    def machine(self, name: str) -> MachineState:
        """One machine; raises BadRegistry where there is none of that name."""
        with self.database.reading() as session:
            rows.need_machine(session, name)
            (found,) = _states(session, name)
            return found

    def active_version(self, machine: str) -> Version | None:
        """The active version; None where nothing has been promoted."""
        with self.database.reading() as session:
            row = rows.active_version(session, machine)
            return None if row is None else rows.version_value(session, row)

    def accepted_version(self, machine: str) -> Version | None:
        """The version that a person has activated last, else the first; None where there is none.

        The axis test's limits are those of the logs that were tested against its model.
        """
        with self.database.reading() as session:
            row = rows.accepted_version(session, machine)
            return None if row is None else rows.version_value(session, row)

    def version(self, machine: str, number: int) -> Version:
        with self.database.reading() as session:
            return rows.version_value(session, rows.numbered(session, machine, number))

    def versions(self, machine: str) -> tuple[Version, ...]:
        """Every version of a machine, in the order of their numbers."""
        with self.database.reading() as session:
            rows.need_machine(session, machine)
            return tuple(rows.versions(session, VersionRow.machine == machine))

    def decisions(self, machine: str | None = None) -> tuple[Decision, ...]:
        """Decisions of one machine or of all, in the order in which they were made."""
        where = () if machine is None else (DecisionRow.machine == machine,)
        with self.database.reading() as session:
            if machine is not None:
                rows.need_machine(session, machine)
            return tuple(rows.decisions(session, *where))

    def document(self, version: Version, kind: Kind) -> dict[str, Any]:
        """A version's document as model.json and the others hold it; raises BadRegistry if none."""
        query = select(RecordRow.document).filter_by(
            machine=version.machine, kind=kind, sha256=getattr(version, kind)
        )
        for (found,) in self.database.rows(query):
            return dict(found)
        raise BadRegistry(f"{version.machine}, version {version.number}: has no {kind}")

    def documents(self, version: Version) -> dict[str, dict[str, Any] | None]:
        """A version's documents by kind, None where it has none of that kind."""
        return {
            kind: self.document(version, kind) if getattr(version, kind) else None
            for kind in get_args(Kind)
        }

    def _earlier(self, session: Session, machine: str) -> Sequence[int]:
        """Active versions one after the other, the present one last; a rollback takes one off."""
        stack: list[int] = []
        query = select(DecisionRow.kind, DecisionRow.version_id).order_by(DecisionRow.id)
        own = (DecisionRow.machine == machine, DecisionRow.kind.in_(MOVES))
        for kind, version in session.execute(query.where(*own)):
            if kind == "rolled_back":
                stack.pop()
            elif stack[-1:] != [version]:  # else the active one was accepted
                stack.append(version)
        return stack


def _states(session: Session, name: str | None = None) -> tuple[MachineState, ...]:
    """The machines by name, or the one of that name, in a few queries for all of them."""
    machines = select(MachineRow.name)
    if name is not None:
        machines = machines.where(MachineRow.name == name)
    pointers = select(ActiveVersionRow).where(ActiveVersionRow.machine.in_(machines)).subquery()
    active = {
        one.machine: one
        for one in rows.versions(session, VersionRow.id.in_(select(pointers.c.version_id)))
    }
    since = {
        one.machine: one
        for one in rows.decisions(session, DecisionRow.id.in_(select(pointers.c.decision_id)))
    }
    judged = _of_machine(LogRow).join(OutcomeRow, rows.judged_now())
    counted = machines.add_columns(
        _of_machine(VersionRow).scalar_subquery(),
        _of_machine(LogRow).scalar_subquery(),
        judged.scalar_subquery(),
        judged.where(OutcomeRow.verdict == "set_aside").scalar_subquery(),
    )
    return tuple(
        MachineState(one, active.get(one), since.get(one), made, logs, logs - done, excluded)
        for one, made, logs, done, excluded in session.execute(counted.order_by(MachineRow.name))
    )


def _of_machine(table: type[VersionRow | LogRow]) -> Select[int]:
    """How many rows of the table are of a query's `MachineRow`."""
    of = table.machine == MachineRow.name
    return select(func.count()).select_from(table).where(of).correlate(MachineRow)
