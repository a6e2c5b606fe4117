"""What one result says of its machine: a state, and the parameter that moved most.

It is kept beside the results, within the transaction that writes them.
"""

import json
from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import Any, Literal

from sqlalchemy import update
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import Session

from workbench.output import dumps
from workbench.registry.page_tables import MachineNowRow, MachineTrendRow

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
