"""The fleet as a list of pages: filtered, sorted and cut by the database."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Literal, get_args

from sqlalchemy import ColumnElement, SQLColumnExpression, and_, case, func, select
from sqlalchemy.orm import Session

from workbench.registry.database import Database
from workbench.registry.machine_summary import MachineCondition
from workbench.registry.page_tables import MachineNowRow
from workbench.registry.tables import ActiveVersionRow, DecisionRow, VersionRow

FleetOrder = Literal["machine", "state", "heard", "moved"]
FLEET_ORDERS: tuple[FleetOrder, ...] = get_args(FleetOrder)
WORST_FIRST = ("structure", "drifting", "log_bad", "silent", "not_judged", "no_log", "in_tune")
MAY_FALL_SILENT = ("in_tune", "not_judged")  # states that a machine loses that is not heard from


@dataclass(frozen=True)
class FleetAsked:
    """Which machines, in which order, and which page of them.

    text: that the name holds; silent_since: a machine without a log since then is not heard from.
    """

    silent_since: datetime
    text: str = ""
    state: MachineCondition | None = None
    order: FleetOrder = "state"
    down: bool = False
    page: int = 1
    per_page: int = 50


@dataclass(frozen=True)
class FleetLine:
    """A machine in the list; trend: of the parameter that moved most, a value a log."""

    machine: str
    state: MachineCondition
    heard_at: datetime | None
    logs: int
    moved: str | None
    moved_by: float | None
    trend: Sequence[float]
    version: int | None
    since: datetime | None


@dataclass(frozen=True)
class FleetPage:
    """A page of the list; found: how many machines there are on all its pages; counts: of all
    machines, by state."""

    lines: Sequence[FleetLine]
    found: int
    counts: Mapping[str, int]


def fleet_page(database: Database, asked: FleetAsked) -> FleetPage:
    """The page that was asked for."""
    state = _state(asked.silent_since)
    where = _where(asked, state)
    with database.reading() as session:
        counted = session.execute(select(state, func.count()).group_by(state))
        counts: dict[str, int] = {one: count for one, count in counted}
        found: int | None
        if asked.text:
            found = session.scalar(select(func.count()).select_from(MachineNowRow).where(*where))
        else:
            found = counts.get(asked.state, 0) if asked.state else sum(counts.values())
        rows = session.execute(_lines(asked, state, where)).all()
        forces = _beside(session, [row.machine for row in rows])
        lines = [_line(row, forces.get(row.machine)) for row in rows]
    return FleetPage(lines, found or 0, counts)


def _state(silent_since: datetime) -> ColumnElement[str]:
    silent = and_(MachineNowRow.state.in_(MAY_FALL_SILENT), MachineNowRow.heard_at < silent_since)
    return case((silent, "silent"), else_=MachineNowRow.state)


def _where(asked: FleetAsked, state: ColumnElement[str]) -> list[ColumnElement[bool]]:
    out: list[ColumnElement[bool]] = []
    if asked.text:
        out.append(MachineNowRow.machine.icontains(asked.text, autoescape=True))
    if asked.state is not None:
        out.append(state == asked.state)
    return out


def _lines(
    asked: FleetAsked, state: ColumnElement[str], where: Sequence[ColumnElement[bool]]
) -> Any:
    """The page's machines with their states."""
    keys: Mapping[FleetOrder, SQLColumnExpression[Any]] = {
        "machine": MachineNowRow.machine,
        "state": case({name: k for k, name in enumerate(WORST_FIRST)}, value=state, else_=9),
        "heard": MachineNowRow.heard_at,
        "moved": func.abs(MachineNowRow.moved_by),
    }
    key = keys[asked.order]
    order = key.desc().nulls_last() if asked.down else key.asc().nulls_last()
    return (
        select(
            MachineNowRow.machine,
            MachineNowRow.heard_at,
            MachineNowRow.logs,
            MachineNowRow.moved,
            MachineNowRow.moved_by,
            MachineNowRow.moved_trend,
            state,
        )
        .where(*where)
        .order_by(order, MachineNowRow.machine)
        .limit(asked.per_page)
        .offset((asked.page - 1) * asked.per_page)
    )


def _beside(session: Session, machines: Sequence[str]) -> Mapping[str, tuple[int, datetime]]:
    """Active versions and since when, looked up for the page's machines alone."""
    query = (
        select(ActiveVersionRow.machine, VersionRow.number, DecisionRow.at)
        .join(VersionRow, VersionRow.id == ActiveVersionRow.version_id)
        .join(DecisionRow, DecisionRow.id == ActiveVersionRow.decision_id)
        .where(ActiveVersionRow.machine.in_(machines))
    )
    return {machine: (number, at) for machine, number, at in session.execute(query)}


def _line(row: Any, force: tuple[int, datetime] | None) -> FleetLine:
    machine, heard_at, logs, moved, moved_by, trend, state = row
    values = json.loads(trend) if trend else []
    return FleetLine(
        machine, state, heard_at, logs, moved, moved_by, values, *(force or (None, None))
    )


def any_machine(database: Database) -> bool:
    """Whether the registry holds a machine; raises RegistryAway where it does not answer."""
    with database.reading() as session:
        return session.scalar(select(MachineNowRow.machine).limit(1)) is not None
