"""Statements on the registry's rows, within a transaction of the caller."""

import hashlib
import json
from datetime import datetime
from typing import Any

from sqlalchemy import ColumnElement, and_, func, or_, select
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import Session, aliased

from workbench.cards.nearest import nearest
from workbench.output import dumps
from workbench.registry.errors import BadRegistry
from workbench.registry.overview import begin_summary, summary_moved
from workbench.registry.tables import (
    ActiveVersionRow,
    DecisionRow,
    LogRow,
    MachineRow,
    OutcomeRow,
    RecordRow,
    ReopeningRow,
    VersionRow,
)
from workbench.registry.values import (
    Candidate,
    Decision,
    DecisionKind,
    Document,
    Kind,
    SeenLog,
    Version,
)


def lock_machine(session: Session, name: str, now: datetime) -> None:
    """The machine, made where it is new; others that write of it wait for this transaction."""
    query = select(MachineRow.name).where(MachineRow.name == name).with_for_update()
    if session.scalar(query) is not None:
        return
    values = {"name": name, "added_at": now}
    insert = postgresql.insert if session.get_bind().dialect.name == "postgresql" else sqlite.insert
    session.execute(insert(MachineRow).values(values).on_conflict_do_nothing())
    session.scalar(query)
    begin_summary(session, name)


def need_machine(session: Session, name: str, *, lock: bool = False) -> None:
    """Raises BadRegistry where there is no such machine; lock: as `lock_machine` does."""
    query = select(MachineRow.name).where(MachineRow.name == name)
    if session.scalar(query.with_for_update() if lock else query) is None:
        known = session.scalars(select(MachineRow.name).order_by(MachineRow.name)).all()
        said = nearest(name, known) if known else "; it holds no machine yet"
        raise BadRegistry(f"the registry has no machine {name!r}{said}")


def add_record(
    session: Session, machine: str, kind: Kind, document: Document, now: datetime
) -> RecordRow:
    """The row of the document, the one there is where its content is known."""
    text = dumps(document)
    digest = hashlib.sha256(text.encode()).hexdigest()
    found = session.scalar(
        select(RecordRow).where(
            RecordRow.machine == machine, RecordRow.kind == kind, RecordRow.sha256 == digest
        )
    )
    if found is not None:
        return found
    row = RecordRow(machine=machine, kind=kind, sha256=digest, document=text, made_at=now)
    session.add(row)
    session.flush()
    return row


def add_version(
    session: Session, machine: str, candidate: Candidate, now: datetime
) -> tuple[VersionRow, bool]:
    """The row of the version, and whether it is new; the same documents are the same version."""
    model = add_record(session, machine, "model", candidate.model, now).id

    def of(kind: Kind, document: Document | None) -> int | None:
        return None if document is None else add_record(session, machine, kind, document, now).id

    design, validation = of("design", candidate.design), of("validation", candidate.validation)
    found = session.scalar(
        select(VersionRow).where(
            VersionRow.machine == machine,
            VersionRow.model_id == model,
            VersionRow.design_id.is_not_distinct_from(design),
            VersionRow.validation_id.is_not_distinct_from(validation),
        )
    )
    if found is not None:
        return found, False
    last = session.scalar(select(func.max(VersionRow.number)).where(VersionRow.machine == machine))
    row = VersionRow(
        machine=machine,
        number=(last or 0) + 1,
        model_id=model,
        design_id=design,
        validation_id=validation,
        made_at=now,
    )
    session.add(row)
    session.flush()
    return row, True


def decide(
    session: Session,
    kind: DecisionKind,
    version: VersionRow,
    *,
    reason: str,
    by: str,
    now: datetime,
    evidence: Document | None = None,
    log_id: int | None = None,
) -> DecisionRow:
    """The row of a decision; "promoted" and "rolled_back" move the pointer to the version."""
    row = DecisionRow(
        machine=version.machine,
        kind=kind,
        version_id=version.id,
        log_id=log_id,
        reason=storable_text(reason),
        evidence=dumps(evidence or {}),
        made_by=by,
        at=now,
    )
    session.add(row)
    session.flush()
    if kind in ("promoted", "rolled_back"):
        pointer = session.get(ActiveVersionRow, version.machine)
        if pointer is None:
            session.add(
                ActiveVersionRow(machine=version.machine, version_id=version.id, decision_id=row.id)
            )
        else:
            pointer.version_id, pointer.decision_id = version.id, row.id
        session.flush()
        if log_id is None:
            summary_moved(session, version.machine)
    return row


def turn() -> ColumnElement[int]:
    """How often the log of a query's `LogRow` was reopened."""
    return (
        select(func.count(ReopeningRow.id))
        .where(ReopeningRow.log_id == LogRow.id)
        .correlate(LogRow)
        .scalar_subquery()
    )


def judged_now() -> ColumnElement[bool]:
    """Joins a log with its result, earlier ones of a log that was reopened left out."""
    return and_(OutcomeRow.log_id == LogRow.id, OutcomeRow.turn == turn())


def numbered(session: Session, machine: str, number: int) -> VersionRow:
    """The machine's version of that number; raises BadRegistry with those there are."""
    found = session.scalar(
        select(VersionRow).where(VersionRow.machine == machine, VersionRow.number == number)
    )
    if found is None:
        need_machine(session, machine)
        last = session.scalar(
            select(func.max(VersionRow.number)).where(VersionRow.machine == machine)
        )
        have = f"it has 1 to {last}" if last else "it has none; 'workbench registry add' one"
        raise BadRegistry(f"{machine}: no version {number}; {have}")
    return found


def active_version(session: Session, machine: str) -> VersionRow | None:
    """The row of the active version."""
    pointer = session.get(ActiveVersionRow, machine)
    return None if pointer is None else session.get_one(VersionRow, pointer.version_id)


def logs_behind(session: Session, machine: str) -> tuple[SeenLog, ...]:
    """The logs from which the active version comes, and those that have activated another.

    The latter count after a rollback too: what a person took back was still seen on a later log.
    """
    promoted = (
        select(DecisionRow.log_id)
        .where(DecisionRow.machine == machine, DecisionRow.kind == "promoted")
        .where(DecisionRow.log_id.is_not(None))
    )
    fitted: list[str] = []
    current = active_version(session, machine)
    if current is not None:
        model = json.loads(session.get_one(RecordRow, current.model_id).document)
        fitted = [str(entry.get("sha256")) for entry in model.get("log", ())]
    rows = session.scalars(
        select(LogRow).where(
            LogRow.machine == machine, or_(LogRow.id.in_(promoted), LogRow.sha256.in_(fitted))
        )
    )
    return tuple(seen(row) for row in rows)


def seen(row: LogRow) -> SeenLog:
    """The log file as it was found."""
    return SeenLog(row.sha256, row.file, row.size, row.mtime_ns)


def storable_text(text: str) -> str:
    """The text as every database takes it: no lone surrogates of odd file names, and no NUL."""
    return text.replace("\0", "\\0").encode("utf-8", "backslashreplace").decode("utf-8")


def version_values(session: Session, *where: ColumnElement[bool]) -> dict[int, Version]:
    """Versions by the ids of their rows, in the order of machines and numbers."""
    model, design, validation = (aliased(RecordRow) for _ in range(3))
    query = (
        select(VersionRow, model.sha256, design.sha256, validation.sha256)
        .join(model, model.id == VersionRow.model_id)
        .outerjoin(design, design.id == VersionRow.design_id)
        .outerjoin(validation, validation.id == VersionRow.validation_id)
        .where(*where)
        .order_by(VersionRow.machine, VersionRow.number)
    )
    return {
        row.id: Version(row.machine, row.number, of_model, of_design, of_validation, row.made_at)
        for row, of_model, of_design, of_validation in session.execute(query)
    }


def version_value(session: Session, row: VersionRow) -> Version:
    """The version as a value."""
    return version_values(session, VersionRow.id == row.id)[row.id]


def decision_values(session: Session, *where: ColumnElement[bool]) -> tuple[Decision, ...]:
    """Decisions in the order in which they were made."""
    query = (
        select(DecisionRow, VersionRow.number, LogRow.sha256)
        .join(VersionRow, VersionRow.id == DecisionRow.version_id)
        .outerjoin(LogRow, LogRow.id == DecisionRow.log_id)
        .where(*where)
        .order_by(DecisionRow.id)
    )
    return tuple(_decision(row, number, log) for row, number, log in session.execute(query))


def _decision(row: DecisionRow, number: int, log: str | None) -> Decision:
    kind: Any = row.kind
    return Decision(
        id=row.id,
        machine=row.machine,
        kind=kind,
        number=number,
        log=log,
        reason=row.reason,
        evidence=json.loads(row.evidence),
        made_by=row.made_by,
        at=row.at,
    )


def decision_value(session: Session, row: DecisionRow) -> Decision:
    """The decision as a value."""
    return decision_values(session, DecisionRow.id == row.id)[0]
