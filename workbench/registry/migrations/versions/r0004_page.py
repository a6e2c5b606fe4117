"""The page: tokens, uploads, its background work, the audit, and the fleet at a glance."""

import json

import sqlalchemy as sa
from alembic import op

from workbench.registry.at_a_glance import Trend, glance, state_of, with_log
from workbench.registry.tables import UtcTime

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None

KEYS = {  # what a replaced row would collide with, as in the first step
    "access_token": (
        "o.id = NEW.id",
        "o.name = NEW.name",
        "o.sha256 = NEW.sha256",
    ),
    "access_token_end": ("o.token_id = NEW.token_id",),
    "upload": ("o.id = NEW.id",),
    "audit": ("o.id = NEW.id",),
}


def upgrade() -> None:
    """Make the tables, their triggers, and a glance of every machine that is there."""
    _tokens()
    _work()
    _glances()
    if op.get_bind().dialect.name == "postgresql":
        for table in KEYS:
            op.execute(
                f"CREATE TRIGGER {table}_append_only BEFORE UPDATE OR DELETE OR TRUNCATE ON {table}"
                " FOR EACH STATEMENT EXECUTE FUNCTION registry_append_only()"
            )
    else:
        _sqlite_triggers()
    _fill()


def _tokens() -> None:
    op.create_table(
        "access_token",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("name", sa.Text(), nullable=False),
        sa.Column("role", sa.Text(), nullable=False),
        sa.Column("sha256", sa.Text(), nullable=False),
        sa.Column("made_by", sa.Text(), nullable=False),
        sa.Column("at", UtcTime(), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_access_token"),
        sa.CheckConstraint("role IN ('read', 'change')", name=op.f("ck_access_token_role")),
    )
    for column in ("name", "sha256"):
        op.create_index(f"ix_access_token_{column}", "access_token", [column], unique=True)
    op.create_table(
        "access_token_end",
        sa.Column("token_id", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("made_by", sa.Text(), nullable=False),
        sa.Column("at", UtcTime(), nullable=False),
        sa.PrimaryKeyConstraint("token_id", name="pk_access_token_end"),
        sa.ForeignKeyConstraint(
            ["token_id"], ["access_token.id"], name="fk_access_token_end_token_id"
        ),
    )
    op.create_table(
        "audit",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("at", UtcTime(), nullable=False),
        sa.Column("made_by", sa.Text(), nullable=False),
        sa.Column("kind", sa.Text(), nullable=False),
        sa.Column("subject", sa.Text(), nullable=False),
        sa.Column("detail", sa.Text(), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_audit"),
    )
    op.create_index("ix_audit_subject_id", "audit", ["subject", "id"])


def _work() -> None:
    op.create_table(
        "upload",
        sa.Column("id", sa.Text(), nullable=False),
        sa.Column("file", sa.Text(), nullable=False),
        sa.Column("size", sa.BigInteger(), nullable=False),
        sa.Column("sha256", sa.Text(), nullable=False),
        sa.Column("made_by", sa.Text(), nullable=False),
        sa.Column("at", UtcTime(), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_upload"),
    )
    op.create_index("ix_upload_at", "upload", ["at"])
    op.create_table(
        "task",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("upload_id", sa.Text(), nullable=False),
        sa.Column("kind", sa.Text(), nullable=False),
        sa.Column("state", sa.Text(), nullable=False),
        sa.Column("stage", sa.Text(), nullable=False),
        sa.Column("share", sa.Double(), nullable=False),
        sa.Column("said", sa.Text(), nullable=False),
        sa.Column("begun", sa.Integer(), nullable=False),
        sa.Column("token", sa.Text(), nullable=True),
        sa.Column("owner", sa.Text(), nullable=True),
        sa.Column("until", UtcTime(), nullable=True),
        sa.Column("made_by", sa.Text(), nullable=False),
        sa.Column("at", UtcTime(), nullable=False),
        sa.Column("ended_at", UtcTime(), nullable=True),
        sa.PrimaryKeyConstraint("id", name="pk_task"),
        sa.ForeignKeyConstraint(["upload_id"], ["upload.id"], name="fk_task_upload_id"),
        sa.CheckConstraint("kind IN ('identify', 'trace')", name=op.f("ck_task_kind")),
        sa.CheckConstraint(
            "state IN ('waiting', 'running', 'done', 'failed', 'cancelled')",
            name=op.f("ck_task_state"),
        ),
    )
    op.create_index("ix_task_upload_id", "task", ["upload_id"])
    op.create_index("ix_task_state_id", "task", ["state", "id"])


def _glances() -> None:
    op.create_table(
        "machine_now",
        sa.Column("machine", sa.Text(), nullable=False),
        sa.Column("state", sa.Text(), nullable=False),
        sa.Column("heard_at", UtcTime(), nullable=True),
        sa.Column("logs", sa.Integer(), nullable=False),
        sa.Column("moved", sa.Text(), nullable=True),
        sa.Column("moved_by", sa.Double(), nullable=True),
        sa.Column("moved_trend", sa.Text(), nullable=True),
        sa.PrimaryKeyConstraint("machine", name="pk_machine_now"),
        sa.ForeignKeyConstraint(["machine"], ["machine.name"], name="fk_machine_now_machine"),
    )
    for column in ("state", "heard_at", "moved_by"):
        op.create_index(f"ix_machine_now_{column}_machine", "machine_now", [column, "machine"])
    op.create_table(
        "machine_trend",
        sa.Column("machine", sa.Text(), nullable=False),
        sa.Column("trend", sa.Text(), nullable=False),
        sa.PrimaryKeyConstraint("machine", name="pk_machine_trend"),
        sa.ForeignKeyConstraint(["machine"], ["machine.name"], name="fk_machine_trend_machine"),
    )


def _sqlite_triggers() -> None:
    for table, keys in KEYS.items():
        said = f"SELECT RAISE(ABORT, '{table} is append-only')"
        for event in ("UPDATE", "DELETE"):
            op.execute(
                f"CREATE TRIGGER {table}_{event.lower()} BEFORE {event} ON {table}"
                f" BEGIN {said}; END"
            )
        taken = " OR ".join(f"({key})" for key in keys)
        op.execute(
            f"CREATE TRIGGER {table}_replace BEFORE INSERT ON {table}"
            f" WHEN EXISTS (SELECT 1 FROM {table} AS o WHERE {taken}) BEGIN {said}; END"
        )


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
            moved, by = glance(evidence)
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
