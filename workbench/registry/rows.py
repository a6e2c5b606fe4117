"""Statements on the registry's rows, within a transaction of the caller."""

import hashlib
from collections.abc import Sequence
from datetime import datetime
from typing import get_args

from sqlalchemy import ColumnElement, and_, func, or_, select
from sqlalchemy.orm import Session, aliased

from design.judgement import Candidate, Document
from design.machine.nearest import nearest
from workbench.output import dumps
from workbench.registry.database import insert_missing
from workbench.registry.overview import summary_moved
from workbench.registry.tables import (
    ActiveVersionRow,
    DecisionRow,
    LogRow,
    MachineNowRow,
    MachineRow,
    MachineTrendRow,
    OutcomeRow,
    RecordRow,
    ReopeningRow,
    VersionRow,
)
from workbench.registry.values import (
    MOVES,
    BadRegistry,
    Decision,
    DecisionKind,
    Kind,
    SeenLog,
    Version,
    of_row,
)


def lock_machine(session: Session, name: str, now: datetime) -> None:
    """The machine, made where it is new; others that write of it wait for this transaction."""
    query = select(MachineRow.name).where(MachineRow.name == name).with_for_update()
    if session.scalar(query) is not None:
        return
    session.execute(insert_missing(session, MachineRow).values(name=name, added_at=now))
    session.scalar(query)
    known, trend = (insert_missing(session, table) for table in (MachineNowRow, MachineTrendRow))
    session.execute(known.values(machine=name, state="no_log", logs=0))
    session.execute(trend.values(machine=name, trend={}))


def need_machine(session: Session, name: str, *, lock: bool = False) -> None:
    """Raises BadRegistry where there is no such machine; lock: as `lock_machine` does."""
    query = select(MachineRow.name).where(MachineRow.name == name)
    if session.scalar(query.with_for_update() if lock else query) is None:
        known = session.scalars(select(MachineRow.name).order_by(MachineRow.name)).all()
        said = nearest(name, known) if known else "; it holds no machine yet"
        raise BadRegistry(f"the registry has no machine {name!r}{said}")


def add_record(
    session: Session, machine: str, kind: Kind, document: Document | None, now: datetime
) -> int | None:
    """The id of a document's row, the one there is where its content is known; None of none."""
    if document is None:
        return None
    digest = hashlib.sha256(dumps(document).encode()).hexdigest()
    own = {"machine": machine, "kind": kind, "sha256": digest}
    found = session.scalar(select(RecordRow.id).filter_by(**own))
    if found is not None:
        return found
    row = RecordRow(**own, document=document, made_at=now)
    session.add(row)
    session.flush()
    return row.id


def add_version(
    session: Session, machine: str, candidate: Candidate, now: datetime
) -> tuple[VersionRow, bool]:
    """The row of the version, and whether it is new; the same documents are the same version."""
    records = {
        f"{kind}_id": add_record(session, machine, kind, getattr(candidate, kind), now)
        for kind in get_args(Kind)
    }
    same = [getattr(VersionRow, key).is_not_distinct_from(id_) for key, id_ in records.items()]
    own = VersionRow.machine == machine
    found = session.scalar(select(VersionRow).where(own, *same))
    if found is not None:
        return found, False
    last = session.scalar(select(func.max(VersionRow.number)).where(own)) or 0
    row = VersionRow(machine=machine, number=last + 1, made_at=now, **records)
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
        reason=reason,
        evidence=evidence or {},
        made_by=by,
        at=now,
    )
    session.add(row)
    session.flush()
    session.expire(row)  # so that it is read as the database keeps it
    if kind in MOVES:
        pointer = session.get(ActiveVersionRow, version.machine)
        pointer = pointer or ActiveVersionRow(machine=version.machine)
        was_active = pointer.version_id == version.id
        pointer.version_id, pointer.decision_id = version.id, row.id
        session.add(pointer)
        session.flush()
        if log_id is None and not (was_active and _changed_since(session, version)):
            summary_moved(session, version.machine, "in_tune" if was_active else "not_judged")
    return row


def _changed_since(session: Session, version: VersionRow) -> bool:
    """Whether a log shows another machine than the version's model."""
    own = (OutcomeRow.version_id == version.id, OutcomeRow.verdict.in_(("structure", "refused")))
    return session.scalar(select(OutcomeRow.log_id).where(*own).limit(1)) is not None


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
    own = VersionRow.machine == machine
    found = session.scalar(select(VersionRow).where(own, VersionRow.number == number))
    if found is None:
        need_machine(session, machine)
        last = session.scalar(select(func.max(VersionRow.number)).where(own))
        have = f"it has 1 to {last}" if last else "it has none; 'workbench registry add' one"
        raise BadRegistry(f"{machine}: no version {number}; {have}")
    return found


def active_version(session: Session, machine: str) -> VersionRow | None:
    pointer = session.get(ActiveVersionRow, machine)
    return None if pointer is None else session.get_one(VersionRow, pointer.version_id)


def accepted_version(session: Session, machine: str) -> VersionRow | None:
    """The version that a person has activated last: the machine as somebody has accepted it.

    What a worker has activated since is not accepted; the machine's first version is.
    """
    moves = (
        select(VersionRow)
        .join(DecisionRow, DecisionRow.version_id == VersionRow.id)
        .where(DecisionRow.machine == machine, DecisionRow.kind.in_(MOVES))
    )
    by_person = moves.where(DecisionRow.log_id.is_(None)).order_by(DecisionRow.id.desc())
    return session.scalar(by_person.limit(1)) or session.scalar(
        moves.order_by(DecisionRow.id).limit(1)
    )


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
        model = session.get_one(RecordRow, current.model_id).document
        fitted = [str(entry.get("sha256")) for entry in model.get("log", ())]
    rows = session.scalars(
        select(LogRow).where(
            LogRow.machine == machine, or_(LogRow.id.in_(promoted), LogRow.sha256.in_(fitted))
        )
    )
    return tuple(of_row(SeenLog, row) for row in rows)


def versions(session: Session, *where: ColumnElement[bool]) -> Sequence[Version]:
    """Versions in the order of machines and numbers."""
    model, design, validation = (aliased(RecordRow) for _ in range(3))
    query = (
        select(VersionRow, model.sha256, design.sha256, validation.sha256)
        .join(model, model.id == VersionRow.model_id)
        .outerjoin(design, design.id == VersionRow.design_id)
        .outerjoin(validation, validation.id == VersionRow.validation_id)
        .where(*where)
        .order_by(VersionRow.machine, VersionRow.number)
    )
    return [
        of_row(Version, row, model=of_model, design=of_design, validation=of_validation)
        for row, of_model, of_design, of_validation in session.execute(query)
    ]


def version_value(session: Session, row: VersionRow) -> Version:
    return versions(session, VersionRow.id == row.id)[0]


def decisions(session: Session, *where: ColumnElement[bool]) -> Sequence[Decision]:
    """Decisions in the order in which they were made."""
    query = (
        select(DecisionRow, VersionRow.number, LogRow.sha256)
        .join(VersionRow, VersionRow.id == DecisionRow.version_id)
        .outerjoin(LogRow, LogRow.id == DecisionRow.log_id)
        .where(*where)
        .order_by(DecisionRow.id)
    )
    rows = session.execute(query)
    return [of_row(Decision, row, number=number, log=log) for row, number, log in rows]
