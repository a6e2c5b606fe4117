"""The fleet as a list of pages: filtered, sorted and cut by the database, of what the last result
says of each machine: a state, and the parameter that moved most.

That is kept beside the results, within the transaction that writes them.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Literal, get_args

from sqlalchemy import ColumnElement, SQLColumnExpression, and_, case, func, select, update
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import Session

from workbench.output import dumps
from workbench.registry.database import Database
from workbench.registry.page_tables import MachineNowRow, MachineTrendRow
from workbench.registry.tables import ActiveVersionRow, DecisionRow, VersionRow

MachineCondition = Literal[
    "in_tune", "drifting", "structure", "log_bad", "not_judged", "no_log", "silent"
]
Trend = dict[str, list[float]]
TREND_LOGS = 32  # logs that a trend goes back
INTERVAL_DEVIATIONS = 1.96  # to each side, of 95 %
_BY_VERDICT: Mapping[str, MachineCondition] = {
    "none": "in_tune",
    "promoted": "in_tune",
    "structure": "structure",
    "set_aside": "log_bad",
}


def state_of(verdict: str, evidence: Mapping[str, Any]) -> MachineCondition:
    """The machine's state after a log of that verdict ("refused": what was found stays so)."""
    if verdict == "refused":
        found = _drift(evidence).get("verdict")
        return {"drift": "drifting", "structure": "structure"}.get(found, "not_judged")  # type: ignore[return-value, arg-type]
    return _BY_VERDICT.get(verdict, "not_judged")


def most_moved(evidence: Mapping[str, Any]) -> tuple[str | None, float | None]:
    """The parameter that moved most, with its relative change; None where the log gave none.

    That is the one whose change is largest beyond its own 95 % interval; where all lie within
    theirs, the one nearest to its edge.
    """
    found = [one for one in _parameters(evidence) if one.get("change") is not None]
    if not found:
        return None, None

    def most(one: Mapping[str, Any]) -> tuple[float, float]:
        change, sd = abs(float(one["change"])), float(one.get("sd") or 0.0)
        return max(0.0, change - INTERVAL_DEVIATIONS * sd), change / sd if sd > 0.0 else 0.0

    largest = max(found, key=most)
    return str(largest["name"]), float(largest["change"])


def with_log(trend: Mapping[str, Sequence[float]], evidence: Mapping[str, Any]) -> Trend:
    """The trend with what a log gave of each parameter at its end."""
    out = {name: list(values) for name, values in trend.items()}
    for one in _parameters(evidence):
        if one.get("after") is not None:
            recent = out.setdefault(str(one["name"]), [])
            recent.append(float(f"{float(one['after']):.6g}"))
            del recent[:-TREND_LOGS]
    return out


def _drift(evidence: Mapping[str, Any]) -> Mapping[str, Any]:
    found = evidence.get("drift")
    return found if isinstance(found, Mapping) else {}


def _parameters(evidence: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """What the drift test gave of each parameter; of older results only of those that moved."""
    drift = _drift(evidence)
    found = drift.get("parameters")
    if found:
        return list(found)
    return [
        {**one, "change": (one["after"] - one["before"]) / abs(one["before"])}
        for one in drift.get("moved", ())
        if one.get("before")
    ]


def begin_summary(session: Session, machine: str) -> None:
    """A machine of which nothing is known yet; one that is there stays as it is."""
    insert = postgresql.insert if session.get_bind().dialect.name == "postgresql" else sqlite.insert
    first = {"machine": machine, "state": "no_log", "logs": 0}
    session.execute(insert(MachineNowRow).values(first).on_conflict_do_nothing())
    empty = {"machine": machine, "trend": "{}"}
    session.execute(insert(MachineTrendRow).values(empty).on_conflict_do_nothing())


def summary_heard(session: Session, machine: str, logs: int, now: datetime) -> None:
    """So many new logs of the machine have come."""
    more = {"heard_at": now, "logs": MachineNowRow.logs + logs}
    session.execute(update(MachineNowRow).where(MachineNowRow.machine == machine).values(more))


def summary_tested(
    session: Session, machine: str, verdict: str, evidence: Mapping[str, Any]
) -> None:
    """The newest log has its result."""
    row = session.get_one(MachineNowRow, machine)
    row.state = state_of(verdict, evidence)
    name, change = most_moved(evidence)
    if name is not None:
        trend_row = session.get_one(MachineTrendRow, machine)
        trend = with_log(json.loads(trend_row.trend), evidence)
        trend_row.trend = dumps(trend)
        row.moved, row.moved_by, row.moved_trend = (
            name,
            change,
            dumps(trend.get(name, [])),
        )


def summary_moved(session: Session, machine: str) -> None:
    """Somebody has activated another version: the next log shows how that fits."""
    nothing = dict.fromkeys(("moved", "moved_by", "moved_trend"))
    values = {"state": "not_judged", **nothing}
    session.execute(update(MachineNowRow).where(MachineNowRow.machine == machine).values(values))


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
