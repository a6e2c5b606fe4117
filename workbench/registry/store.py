"""The registry of machines: what is in force, what was, and why it changed."""

import json
from collections.abc import Sequence
from datetime import datetime
from types import TracebackType
from typing import Any, Self

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from workbench.registry.database import Database
from workbench.registry.errors import BadRegistry
from workbench.registry.rows import (
    add_version,
    decide,
    decision_value,
    judged_now,
    lock_machine,
    need_machine,
    numbered,
    version_in_force,
    version_value,
)
from workbench.registry.tables import (
    DecisionRow,
    InForceRow,
    LogRow,
    MachineRow,
    OutcomeRow,
    RecordRow,
    VersionRow,
)
from workbench.registry.values import Candidate, Decision, Kind, MachineState, Version

MOVES = ("promoted", "rolled_back")


class Registry:
    """Models, designs and validations of machines, append-only, one version in force a machine.

    where: a file of SQLite or a PostgreSQL URL. Everything that changes is one transaction. All
    raise BadRegistry for a question it cannot answer, RegistryAway where the database is away.
    """

    def __init__(self, where: str, *, create: bool = True) -> None:
        self.database = Database(where, create=create)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Give every connection back."""
        self.database.close()

    def add(
        self, machine: str, candidate: Candidate, *, reason: str, by: str, now: datetime
    ) -> Version:
        """The version that holds these documents; not in force yet. The same again adds nothing."""
        with self.database.writing() as session:
            lock_machine(session, machine, now)
            row, new = add_version(session, machine, candidate, now)
            if new:
                decide(session, "added", row, reason=reason, by=by, now=now)
            return version_value(session, row)

    def promote(
        self, machine: str, number: int, *, reason: str, by: str, now: datetime
    ) -> Decision:
        """Put a version in force; raises BadRegistry where it already is, or is not there."""
        with self.database.writing() as session:
            need_machine(session, machine, lock=True)
            row = numbered(session, machine, number)
            current = version_in_force(session, machine)
            if current is not None and current.id == row.id:
                raise BadRegistry(f"{machine}: version {number} is in force already")
            made = decide(session, "promoted", row, reason=reason, by=by, now=now)
            return decision_value(session, made)

    def rollback(self, machine: str, *, reason: str, by: str, now: datetime) -> Decision:
        """Put the version in force that was before the present one; a second call goes further."""
        with self.database.writing() as session:
            need_machine(session, machine, lock=True)
            earlier = self._earlier(session, machine)
            if len(earlier) < 2:
                have = "one version" if earlier else "no version"
                raise BadRegistry(
                    f"{machine}: {have} has been in force, so there is none to go back to"
                )
            row = session.get_one(VersionRow, earlier[-2])
            made = decide(session, "rolled_back", row, reason=reason, by=by, now=now)
            return decision_value(session, made)

    def machines(self) -> tuple[MachineState, ...]:
        """Every machine by name."""
        with self.database.reading() as session:
            names = session.scalars(select(MachineRow.name).order_by(MachineRow.name)).all()
            return tuple(_state(session, name) for name in names)

    def machine(self, name: str) -> MachineState:
        """One machine; raises BadRegistry where there is none of that name."""
        with self.database.reading() as session:
            need_machine(session, name)
            return _state(session, name)

    def in_force(self, machine: str) -> Version | None:
        """The version in force; None where nothing has been promoted."""
        with self.database.reading() as session:
            row = version_in_force(session, machine)
            return None if row is None else version_value(session, row)

    def version(self, machine: str, number: int) -> Version:
        """The version of that number."""
        with self.database.reading() as session:
            return version_value(session, numbered(session, machine, number))

    def versions(self, machine: str) -> tuple[Version, ...]:
        """Every version of a machine, in the order of their numbers."""
        with self.database.reading() as session:
            need_machine(session, machine)
            rows = session.scalars(
                select(VersionRow).where(VersionRow.machine == machine).order_by(VersionRow.number)
            ).all()
            return tuple(version_value(session, row) for row in rows)

    def decisions(self, machine: str | None = None) -> tuple[Decision, ...]:
        """Decisions of one machine or of all, in the order in which they were made."""
        query = select(DecisionRow).order_by(DecisionRow.id)
        if machine is not None:
            query = query.where(DecisionRow.machine == machine)
        with self.database.reading() as session:
            if machine is not None:
                need_machine(session, machine)
            return tuple(decision_value(session, row) for row in session.scalars(query))

    def document(self, version: Version, kind: Kind) -> dict[str, Any]:
        """A version's document as model.json and the others hold it; raises BadRegistry if none."""
        digest = getattr(version, kind)
        with self.database.reading() as session:
            text = session.scalar(
                select(RecordRow.document).where(
                    RecordRow.machine == version.machine,
                    RecordRow.kind == kind,
                    RecordRow.sha256 == digest,
                )
            )
        if text is None:
            raise BadRegistry(f"{version.machine}, version {version.number}: has no {kind}")
        found: dict[str, Any] = json.loads(text)
        return found

    def _earlier(self, session: Session, machine: str) -> Sequence[int]:
        """Versions in force one after the other, the present one last; a rollback takes one off."""
        stack: list[int] = []
        rows = session.execute(
            select(DecisionRow.kind, DecisionRow.version_id)
            .where(DecisionRow.machine == machine, DecisionRow.kind.in_(MOVES))
            .order_by(DecisionRow.id)
        )
        for kind, version in rows:
            if kind == "promoted":
                stack.append(version)
            else:
                stack.pop()
        return stack


def _state(session: Session, name: str) -> MachineState:
    pointer = session.get(InForceRow, name)
    version = version_in_force(session, name)
    since = None if pointer is None else session.get_one(DecisionRow, pointer.decision_id)
    logs = select(func.count()).select_from(LogRow).where(LogRow.machine == name)
    judged = logs.join(OutcomeRow, judged_now())
    count = session.scalar(logs) or 0
    versions = select(func.count()).select_from(VersionRow).where(VersionRow.machine == name)
    return MachineState(
        name=name,
        in_force=None if version is None else version_value(session, version),
        since=None if since is None else decision_value(session, since),
        versions=session.scalar(versions) or 0,
        logs=count,
        waiting=count - (session.scalar(judged) or 0),
        set_aside=session.scalar(judged.where(OutcomeRow.verdict == "set_aside")) or 0,
    )
