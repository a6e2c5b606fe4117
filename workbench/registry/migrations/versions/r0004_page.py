"""The page: tokens, uploads, its background work, the audit, and the fleet in summary."""

import json

import sqlalchemy as sa
from alembic import op

from workbench.registry.migrate import keep_append_only
from workbench.registry.overview import Trend, most_moved, state_of, with_log
from workbench.registry.tables import PAGE_APPEND_ONLY, Base, UtcTime

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None

TABLES = (*PAGE_APPEND_ONLY, "task", "machine_now", "machine_trend")


def upgrade() -> None:
    """Make the tables, their triggers, and a summary of every machine that is there.

    The tables as they are today: who changes one later writes it out here as it was.
    """
    tables = [Base.metadata.tables[name] for name in TABLES]
    Base.metadata.create_all(op.get_bind(), tables)
    keep_append_only(op.get_bind(), PAGE_APPEND_ONLY)
    _fill()


def _fill() -> None:
    """What the results so far say of each machine, machine by machine."""
    connection = op.get_bind()
    columns = ("machine", "state", "heard_at", "logs", "moved", "moved_by", "moved_trend")
    now = sa.table("machine_now", *map(sa.column, columns))
    trends = sa.table("machine_trend", sa.column("machine"), sa.column("trend"))
    logs = sa.text("SELECT count(*), max(seen_at) FROM log WHERE machine = :m").columns(
        sa.column("count", sa.Integer()), sa.column("heard", UtcTime())
    )
    results = sa.text(
        "SELECT o.verdict, o.evidence FROM outcome o JOIN log l ON l.id = o.log_id"
        " WHERE l.machine = :m ORDER BY o.at, o.log_id"
    )
    for machine in connection.execute(sa.text("SELECT name FROM machine")).scalars().all():
        count, heard = connection.execute(logs, {"m": machine}).one()
        trend: Trend = {}
        state: str = "no_log"
        moved: str | None = None
        by: float | None = None
        for verdict, text in connection.execute(results, {"m": machine}):
            evidence = json.loads(text)
            state, trend = state_of(verdict, evidence), with_log(trend, evidence)
            moved, by = most_moved(evidence)
        last = json.dumps(trend[moved]) if moved in trend else None
        values = {"machine": machine, "state": state, "logs": count, "moved": moved}
        insert = sa.insert(now).values(
            **values,
            moved_by=by,
            moved_trend=last,
            heard_at=sa.bindparam("heard", heard, UtcTime()),
        )
        connection.execute(insert)
        connection.execute(sa.insert(trends).values(machine=machine, trend=json.dumps(trend)))
