"""The registry of machines: the active version, the earlier ones, and why it changed."""

import json
import re
from collections.abc import Sequence
from datetime import datetime
from typing import Any, Self, get_args

from sqlalchemy import ColumnElement, Select, func, select
from sqlalchemy.orm import InstrumentedAttribute, Session

from workbench.registry.database import Database
from workbench.registry.errors import BadRegistry
from workbench.registry.rows import (
    active_version,
    add_version,
    decide,
    decision_value,
    decision_values,
    judged_now,
    lock_machine,
    need_machine,
    numbered,
    version_value,
    version_values,
)
from workbench.registry.tables import (
    ActiveVersionRow,
    DecisionRow,
    LogRow,
    MachineRow,
    OutcomeRow,
    RecordRow,
    VersionRow,
)
from workbench.registry.values import Candidate, Decision, Kind, MachineState, Version

_NAME = re.compile(r"[^/\\\x00-\x1f\x7f]+")
MOVES = ("promoted", "rolled_back")


class Registry:
    """Models, designs and validations of machines, append-only, one active version a machine.

    where: a file of SQLite or a PostgreSQL URL. Everything that changes is one transaction. All
    raise BadRegistry for a question it cannot answer, RegistryAway where the database is away.
    """

    def __init__(self, where: str, *, create: bool = True) -> None:
        self.database = Database(where, create=create)

    def __enter__(self) -> Self:
        return self

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
            lock_machine(session, machine, now)
            row, new = add_version(session, machine, candidate, now)
            if new:
                decide(session, "added", row, reason=reason, by=by, now=now)
            return version_value(session, row)

    def promote(
        self, machine: str, number: int, *, reason: str, by: str, now: datetime
    ) -> Decision:
        """Activate a version; raises BadRegistry where it already is, or is not there."""
        with self.database.writing() as session:
            need_machine(session, machine, lock=True)
            row = numbered(session, machine, number)
            current = active_version(session, machine)
            if current is not None and current.id == row.id:
                raise BadRegistry(f"{machine}: version {number} is active already")
            made = decide(session, "promoted", row, reason=reason, by=by, now=now)
            return decision_value(session, made)

    def rollback(self, machine: str, *, reason: str, by: str, now: datetime) -> Decision:
        """Activate the version before the present one; a second call goes further."""
        with self.database.writing() as session:
            need_machine(session, machine, lock=True)
            earlier = self._earlier(session, machine)
            if len(earlier) < 2:
                have = "one version" if earlier else "no version"
                raise BadRegistry(
                    f"{machine}: {have} has been active, so there is none to go back to"
                )
            row = session.get_one(VersionRow, earlier[-2])
            made = decide(session, "rolled_back", row, reason=reason, by=by, now=now)
            return decision_value(session, made)

    def machines(self) -> tuple[MachineState, ...]:
        """Every machine by name."""
        with self.database.reading() as session:
            return _states(session)

    def machine(self, name: str) -> MachineState:
        """One machine; raises BadRegistry where there is none of that name."""
        with self.database.reading() as session:
            need_machine(session, name)
            (found,) = _states(session, name)
            return found

    def active_version(self, machine: str) -> Version | None:
        """The active version; None where nothing has been promoted."""
        with self.database.reading() as session:
            row = active_version(session, machine)
            return None if row is None else version_value(session, row)

    def version(self, machine: str, number: int) -> Version:
        """The version of that number."""
        with self.database.reading() as session:
            return version_value(session, numbered(session, machine, number))

    def versions(self, machine: str) -> tuple[Version, ...]:
        """Every version of a machine, in the order of their numbers."""
        with self.database.reading() as session:
            need_machine(session, machine)
            return tuple(version_values(session, VersionRow.machine == machine).values())

    def decisions(self, machine: str | None = None) -> tuple[Decision, ...]:
        """Decisions of one machine or of all, in the order in which they were made."""
        where = () if machine is None else (DecisionRow.machine == machine,)
        with self.database.reading() as session:
            if machine is not None:
                need_machine(session, machine)
            return decision_values(session, *where)

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

    def documents(self, version: Version) -> dict[str, dict[str, Any] | None]:
        """A version's documents by kind, None where it has none of that kind."""
        return {
            kind: self.document(version, kind) if getattr(version, kind) else None
            for kind in get_args(Kind)
        }

    def _earlier(self, session: Session, machine: str) -> Sequence[int]:
        """Active versions one after the other, the present one last; a rollback takes one off."""
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


def _states(session: Session, name: str | None = None) -> tuple[MachineState, ...]:
    """The machines by name, or the one of that name, in a few queries for all of them."""

    def only(column: InstrumentedAttribute[str]) -> tuple[ColumnElement[bool], ...]:
        return () if name is None else (column == name,)

    pointers = session.scalars(
        select(ActiveVersionRow).where(*only(ActiveVersionRow.machine))
    ).all()
    forces = {row.machine: row for row in pointers}
    current = select(ActiveVersionRow.version_id).where(*only(ActiveVersionRow.machine))
    versions = version_values(session, VersionRow.id.in_(current))
    behind = select(ActiveVersionRow.decision_id).where(*only(ActiveVersionRow.machine))
    decisions = {d.id: d for d in decision_values(session, DecisionRow.id.in_(behind))}
    made = _counts(session, select(VersionRow.machine, func.count()), only(VersionRow.machine))
    logs = _counts(session, select(LogRow.machine, func.count()), only(LogRow.machine))
    judged = select(LogRow.machine, func.count()).join(OutcomeRow, judged_now())
    done = _counts(session, judged, only(LogRow.machine))
    bad = (*only(LogRow.machine), OutcomeRow.verdict == "set_aside")
    excluded = _counts(session, judged, bad)
    query = select(MachineRow.name).where(*only(MachineRow.name)).order_by(MachineRow.name)
    return tuple(
        MachineState(
            name=one,
            in_force=versions[forces[one].version_id] if one in forces else None,
            since=decisions[forces[one].decision_id] if one in forces else None,
            versions=made.get(one, 0),
            logs=logs.get(one, 0),
            waiting=logs.get(one, 0) - done.get(one, 0),
            set_aside=excluded.get(one, 0),
        )
        for one in session.scalars(query)
    )


def _counts(
    session: Session, query: Select[str, int], where: tuple[ColumnElement[bool], ...]
) -> dict[str, int]:
    """Numbers by machine of a query whose first column is the machine."""
    machine = query.selected_columns[0]
    rows = session.execute(query.where(*where).group_by(machine))
    return {name: count for name, count in rows}
