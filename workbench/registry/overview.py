"""The fleet as a list of pages: filtered, sorted and cut by the database, of what the last result
says of each machine: a state, and the parameter that moved most.

That is kept beside the results, within the transaction that writes them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Literal, get_args

from sqlalchemy import ColumnElement, SQLColumnExpression, and_, case, func, select
from sqlalchemy.orm import Session

from workbench.registry.database import Database, changed
from workbench.registry.tables import (
    ActiveVersionRow,
    DecisionRow,
    MachineNowRow,
    MachineTrendRow,
    VersionRow,
)
from workbench.registry.values import MachineCondition, of_row

Trend = dict[str, list[float]]
TREND_LOGS = 32  # logs that a trend goes back
INTERVAL_DEVIATIONS = 1.96  # to each side, of 95 %
WORST_FIRST: tuple[MachineCondition, ...] = (
    "structure", "drifting", "log_bad", "silent", "not_judged", "no_log", "in_tune",
)  # fmt: skip
CHANGED: tuple[MachineCondition, ...] = ("structure", "drifting")
_BY_VERDICT: Mapping[str, MachineCondition] = {
    "none": "in_tune",
    "structure": "structure",
    "set_aside": "log_bad",
    "drift": "drifting",
}


def state_of(
    verdict: str,
    evidence: Mapping[str, Any],
    before: MachineCondition = "no_log",
    accepted: bool = True,
) -> MachineCondition:
    """The machine's state after a log of that verdict ("refused", "promoted": what was found).

    A drift or a changed structure stays until a log against the model that somebody has accepted
    says otherwise. before: the state before the log; accepted: whether it was tested against that
    model.
    """
    if verdict in ("refused", "promoted"):
        first: MachineCondition = "in_tune" if verdict == "promoted" else "not_judged"
        found = _BY_VERDICT.get((evidence.get("drift") or {}).get("verdict", ""), first)
    else:
        found = _BY_VERDICT.get(verdict, "not_judged")
    if before in CHANGED and (not accepted or found in ("log_bad", "not_judged")):
        return min(before, found, key=WORST_FIRST.index)
    return found


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


def _parameters(evidence: Mapping[str, Any]) -> Sequence[Mapping[str, Any]]:
    """What the drift test gave of each parameter; of older results only of those that moved."""
    drift = evidence.get("drift") or {}
    return drift.get("parameters") or [
        {**one, "change": (one["after"] - one["before"]) / abs(one["before"])}
        for one in drift.get("moved", ())
        if one.get("before")
    ]


def summary_tested(
    session: Session, machine: str, verdict: str, evidence: Mapping[str, Any], accepted: bool
) -> None:
    """The newest log has its result; accepted: against the model that somebody has accepted."""
    row = session.get_one(MachineNowRow, machine)
    before, row.state = row.state, state_of(verdict, evidence, row.state, accepted)
    name, change = most_moved(evidence)
    if name is None:
        return
    trend = session.get_one(MachineTrendRow, machine)
    values = trend.trend = with_log(trend.trend, evidence)
    if row.moved is None or before not in CHANGED or state_of(verdict, evidence) == row.state:
        row.moved, row.moved_by = name, change  # else what had moved is what counts
    row.moved_trend = values.get(row.moved, [])


def summary_moved(session: Session, machine: str, then: MachineCondition) -> None:
    """Somebody has activated another version: the next log shows how that fits; or has accepted the
    active one. then: the state of a machine that has had logs."""
    own = MachineNowRow.machine == machine
    state = case((MachineNowRow.logs == 0, "no_log"), else_=then)
    changed(session, MachineNowRow, own, state=state, moved=None, moved_by=None,
            moved_trend=None)  # fmt: skip


FleetOrder = Literal["machine", "state", "heard", "moved"]
FLEET_ORDERS: tuple[FleetOrder, ...] = get_args(FleetOrder)
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
    now = MachineNowRow
    silent = and_(now.state.in_(MAY_FALL_SILENT), now.heard_at < asked.silent_since)
    state = case((silent, "silent"), else_=now.state)
    where = [now.machine.icontains(asked.text, autoescape=True)] if asked.text else []
    if asked.state is not None:
        where.append(state == asked.state)
    with database.reading() as session:
        counted = session.execute(select(state, func.count()).group_by(state))
        counts: dict[str, int] = {one: count for one, count in counted}
        found: int | None
        if asked.text:
            found = session.scalar(select(func.count()).select_from(now).where(*where))
        else:
            found = counts.get(asked.state, 0) if asked.state else sum(counts.values())
        rows = session.execute(_lines(asked, state, where)).all()
        active = _active(session, [row.machine for row in rows])
    lines = [
        of_row(FleetLine, row, trend=row.trend or [], version=version, since=since)
        for row in rows
        for version, since in [active.get(row.machine, (None, None))]
    ]
    return FleetPage(lines, found or 0, counts)


def _lines(
    asked: FleetAsked, state: ColumnElement[str], where: Sequence[ColumnElement[bool]]
) -> Any:
    """The page's machines with their states."""
    now = MachineNowRow
    keys: Mapping[FleetOrder, SQLColumnExpression[Any]] = {
        "machine": now.machine,
        "state": case({name: k for k, name in enumerate(WORST_FIRST)}, value=state, else_=9),
        "heard": now.heard_at,
        "moved": func.abs(now.moved_by),
    }
    key = keys[asked.order]
    order = (key.desc() if asked.down else key.asc()).nulls_last(), now.machine
    return (
        select(now.machine, now.heard_at, now.logs, now.moved, now.moved_by,
               now.moved_trend.label("trend"), state.label("state"))
        .where(*where).order_by(*order)
        .limit(asked.per_page).offset((asked.page - 1) * asked.per_page)
    )  # fmt: skip


def _active(session: Session, machines: Sequence[str]) -> Mapping[str, tuple[int, datetime]]:
    """Active versions and since when, looked up for the page's machines alone."""
    query = (
        select(ActiveVersionRow.machine, VersionRow.number, DecisionRow.at)
        .join(VersionRow, VersionRow.id == ActiveVersionRow.version_id)
        .join(DecisionRow, DecisionRow.id == ActiveVersionRow.decision_id)
        .where(ActiveVersionRow.machine.in_(machines))
    )
    return {machine: (number, at) for machine, number, at in session.execute(query)}


def any_machine(database: Database) -> bool:
    """Whether the registry holds a machine; raises RegistryAway where it does not answer."""
    with database.reading() as session:
        return session.scalar(select(MachineNowRow.machine).limit(1)) is not None
