"""The summary of the fleet kept beside its results, within the transaction that writes them."""

import json
from collections.abc import Mapping
from datetime import datetime
from typing import Any

from sqlalchemy import update
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import Session

from workbench.output import dumps
from workbench.registry.machine_summary import most_moved, state_of, with_log
from workbench.registry.page_tables import MachineNowRow, MachineTrendRow


def begin_glance(session: Session, machine: str) -> None:
    """A machine of which nothing is known yet; one that is there stays as it is."""
    insert = postgresql.insert if session.get_bind().dialect.name == "postgresql" else sqlite.insert
    first = {"machine": machine, "state": "no_log", "logs": 0}
    session.execute(insert(MachineNowRow).values(first).on_conflict_do_nothing())
    empty = {"machine": machine, "trend": "{}"}
    session.execute(insert(MachineTrendRow).values(empty).on_conflict_do_nothing())


def glance_heard(session: Session, machine: str, logs: int, now: datetime) -> None:
    """So many new logs of the machine have come."""
    more = {"heard_at": now, "logs": MachineNowRow.logs + logs}
    session.execute(update(MachineNowRow).where(MachineNowRow.machine == machine).values(more))


def glance_judged(
    session: Session, machine: str, verdict: str, evidence: Mapping[str, Any]
) -> None:
    """The newest log has its result."""
    row = session.get_one(MachineNowRow, machine)
    row.state = state_of(verdict, evidence)
    name, change = most_moved(evidence)
    if name is not None:
        kept = session.get_one(MachineTrendRow, machine)
        trend = with_log(json.loads(kept.trend), evidence)
        kept.trend = dumps(trend)
        row.moved, row.moved_by, row.moved_trend = name, change, dumps(trend.get(name, []))


def glance_moved(session: Session, machine: str) -> None:
    """Somebody has activated another version: the next log shows how that fits."""
    nothing = dict.fromkeys(("moved", "moved_by", "moved_trend"))
    values = {"state": "not_judged", **nothing}
    session.execute(update(MachineNowRow).where(MachineNowRow.machine == machine).values(values))
