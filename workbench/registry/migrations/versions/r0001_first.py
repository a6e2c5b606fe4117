"""The first layout: tables, and triggers that keep all but pointer and claim append-only."""

import sqlalchemy as sa
from alembic import op

from workbench.registry.tables import UtcTime

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None

KEYS = {  # what a replaced row would collide with; SQLite's REPLACE calls no DELETE trigger
    "machine": ("o.name = NEW.name",),
    "log": ("o.id = NEW.id", "o.machine = NEW.machine AND o.sha256 = NEW.sha256"),
    "record": (
        "o.id = NEW.id",
        "o.machine = NEW.machine AND o.kind = NEW.kind AND o.sha256 = NEW.sha256",
    ),
    "version": ("o.id = NEW.id", "o.machine = NEW.machine AND o.number = NEW.number"),
    "decision": ("o.id = NEW.id",),
    "attempt": ("o.id = NEW.id",),
    "outcome": ("o.log_id = NEW.log_id AND o.turn = NEW.turn",),
    "notice": ("o.log_id = NEW.log_id AND o.turn = NEW.turn",),
    "reopening": ("o.id = NEW.id",),
}
POSTGRES_FUNCTIONS = (
    """CREATE FUNCTION registry_append_only() RETURNS trigger LANGUAGE plpgsql AS $$ BEGIN
    RAISE EXCEPTION '% is append-only', TG_TABLE_NAME USING ERRCODE = 'restrict_violation';
    END $$""",
    """CREATE FUNCTION registry_forward() RETURNS trigger LANGUAGE plpgsql AS $$ BEGIN
    IF NEW.machine <> OLD.machine OR NEW.decision_id <= OLD.decision_id THEN
        RAISE EXCEPTION 'in_force moves by a new decision only'
        USING ERRCODE = 'restrict_violation';
    END IF; RETURN NEW; END $$""",
)


def upgrade() -> None:
    """Make everything."""
    _documents()
    _decisions()
    _jobs()
    if op.get_bind().dialect.name == "postgresql":
        _postgres_triggers()
    else:
        _sqlite_triggers()


def _documents() -> None:
    op.create_table(
        "machine",
        sa.Column("name", sa.Text(), nullable=False),
        sa.Column("added_at", UtcTime(), nullable=False),
        sa.PrimaryKeyConstraint("name", name="pk_machine"),
    )
    op.create_table(
        "log",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("machine", sa.Text(), nullable=False),
        sa.Column("sha256", sa.Text(), nullable=False),
        sa.Column("file", sa.Text(), nullable=False),
        sa.Column("size", sa.BigInteger(), nullable=False),
        sa.Column("mtime_ns", sa.BigInteger(), nullable=False),
        sa.Column("seen_at", UtcTime(), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_log"),
        sa.ForeignKeyConstraint(["machine"], ["machine.name"], name="fk_log_machine"),
        sa.UniqueConstraint("machine", "sha256", name="uq_log_machine_sha256"),
    )
    op.create_table(
        "record",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("machine", sa.Text(), nullable=False),
        sa.Column("kind", sa.Text(), nullable=False),
        sa.Column("sha256", sa.Text(), nullable=False),
        sa.Column("document", sa.Text(), nullable=False),
        sa.Column("made_at", UtcTime(), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_record"),
        sa.ForeignKeyConstraint(["machine"], ["machine.name"], name="fk_record_machine"),
        sa.UniqueConstraint("machine", "kind", "sha256", name="uq_record_machine_kind_sha256"),
        sa.CheckConstraint(
            "kind IN ('model', 'design', 'validation')", name=op.f("ck_record_kind")
        ),
    )
    records = [
        sa.ForeignKeyConstraint([column], ["record.id"], name=f"fk_version_{column}")
        for column in ("model_id", "design_id", "validation_id")
    ]
    op.create_table(
        "version",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("machine", sa.Text(), nullable=False),
        sa.Column("number", sa.Integer(), nullable=False),
        sa.Column("model_id", sa.Integer(), nullable=False),
        sa.Column("design_id", sa.Integer(), nullable=True),
        sa.Column("validation_id", sa.Integer(), nullable=True),
        sa.Column("made_at", UtcTime(), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_version"),
        sa.ForeignKeyConstraint(["machine"], ["machine.name"], name="fk_version_machine"),
        *records,
        sa.UniqueConstraint("machine", "number", name="uq_version_machine_number"),
        sa.UniqueConstraint("machine", "id", name="uq_version_machine_id"),
    )


def _decisions() -> None:
    op.create_table(
        "decision",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("machine", sa.Text(), nullable=False),
        sa.Column("kind", sa.Text(), nullable=False),
        sa.Column("version_id", sa.Integer(), nullable=False),
        sa.Column("log_id", sa.Integer(), nullable=True),
        sa.Column("reason", sa.Text(), nullable=False),
        sa.Column("evidence", sa.Text(), nullable=False),
        sa.Column("made_by", sa.Text(), nullable=False),
        sa.Column("at", UtcTime(), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_decision"),
        sa.ForeignKeyConstraint(["machine"], ["machine.name"], name="fk_decision_machine"),
        sa.ForeignKeyConstraint(["version_id"], ["version.id"], name="fk_decision_version_id"),
        sa.ForeignKeyConstraint(["log_id"], ["log.id"], name="fk_decision_log_id"),
        sa.UniqueConstraint(
            "id", "machine", "version_id", name="uq_decision_id_machine_version_id"
        ),
        sa.CheckConstraint(
            "kind IN ('added', 'promoted', 'rolled_back', 'refused')",
            name=op.f("ck_decision_kind"),
        ),
    )
    op.create_index("ix_decision_machine_id", "decision", ["machine", "id"])
    op.create_table(
        "in_force",
        sa.Column("machine", sa.Text(), nullable=False),
        sa.Column("version_id", sa.Integer(), nullable=False),
        sa.Column("decision_id", sa.Integer(), nullable=False),
        sa.PrimaryKeyConstraint("machine", name="pk_in_force"),
        sa.ForeignKeyConstraint(["machine"], ["machine.name"], name="fk_in_force_machine"),
        sa.ForeignKeyConstraint(
            ["machine", "version_id"],
            ["version.machine", "version.id"],
            name="fk_in_force_machine_version_id",
        ),
        sa.ForeignKeyConstraint(
            ["decision_id", "machine", "version_id"],
            ["decision.id", "decision.machine", "decision.version_id"],
            name="fk_in_force_decision_id_machine_version_id",
        ),
    )


def _jobs() -> None:
    op.create_table(
        "claim",
        sa.Column("machine", sa.Text(), nullable=False),
        sa.Column("token", sa.Text(), nullable=False),
        sa.Column("owner", sa.Text(), nullable=False),
        sa.Column("until", UtcTime(), nullable=False),
        sa.PrimaryKeyConstraint("machine", name="pk_claim"),
        sa.ForeignKeyConstraint(["machine"], ["machine.name"], name="fk_claim_machine"),
    )
    op.create_table(
        "attempt",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("log_id", sa.Integer(), nullable=False),
        sa.Column("turn", sa.Integer(), nullable=False),
        sa.Column("token", sa.Text(), nullable=False),
        sa.Column("owner", sa.Text(), nullable=False),
        sa.Column("at", UtcTime(), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_attempt"),
        sa.ForeignKeyConstraint(["log_id"], ["log.id"], name="fk_attempt_log_id"),
    )
    op.create_index("ix_attempt_log_id", "attempt", ["log_id"])
    op.create_table(
        "reopening",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("log_id", sa.Integer(), nullable=False),
        sa.Column("reason", sa.Text(), nullable=False),
        sa.Column("made_by", sa.Text(), nullable=False),
        sa.Column("at", UtcTime(), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_reopening"),
        sa.ForeignKeyConstraint(["log_id"], ["log.id"], name="fk_reopening_log_id"),
    )
    op.create_index("ix_reopening_log_id", "reopening", ["log_id"])
    op.create_table(
        "outcome",
        sa.Column("log_id", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("turn", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("version_id", sa.Integer(), nullable=True),
        sa.Column("verdict", sa.Text(), nullable=False),
        sa.Column("reason", sa.Text(), nullable=False),
        sa.Column("evidence", sa.Text(), nullable=False),
        sa.Column("token", sa.Text(), nullable=False),
        sa.Column("at", UtcTime(), nullable=False),
        sa.PrimaryKeyConstraint("log_id", "turn", name="pk_outcome"),
        sa.ForeignKeyConstraint(["log_id"], ["log.id"], name="fk_outcome_log_id"),
        sa.ForeignKeyConstraint(["version_id"], ["version.id"], name="fk_outcome_version_id"),
        sa.CheckConstraint(
            "verdict IN ('none', 'not_judged', 'structure', 'promoted', 'refused', 'set_aside')",
            name=op.f("ck_outcome_verdict"),
        ),
    )
    op.create_table(
        "notice",
        sa.Column("log_id", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("turn", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("at", UtcTime(), nullable=False),
        sa.PrimaryKeyConstraint("log_id", "turn", name="pk_notice"),
        sa.ForeignKeyConstraint(
            ["log_id", "turn"], ["outcome.log_id", "outcome.turn"], name="fk_notice_log_id_turn"
        ),
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
    op.execute(
        "CREATE TRIGGER in_force_delete BEFORE DELETE ON in_force"
        " BEGIN SELECT RAISE(ABORT, 'in_force is never empty again'); END"
    )
    moved = "SELECT RAISE(ABORT, 'in_force moves by a new decision only')"
    op.execute(
        "CREATE TRIGGER in_force_update BEFORE UPDATE ON in_force"
        f" WHEN NEW.machine <> OLD.machine OR NEW.decision_id <= OLD.decision_id BEGIN {moved}; END"
    )
    op.execute(
        "CREATE TRIGGER in_force_replace BEFORE INSERT ON in_force"
        " WHEN EXISTS (SELECT 1 FROM in_force AS o WHERE o.machine = NEW.machine)"
        f" BEGIN {moved}; END"
    )


def _postgres_triggers() -> None:
    for function in POSTGRES_FUNCTIONS:
        op.execute(function)
    for table in KEYS:
        op.execute(
            f"CREATE TRIGGER {table}_append_only BEFORE UPDATE OR DELETE OR TRUNCATE ON {table}"
            " FOR EACH STATEMENT EXECUTE FUNCTION registry_append_only()"
        )
    op.execute(
        "CREATE TRIGGER in_force_kept BEFORE DELETE OR TRUNCATE ON in_force"
        " FOR EACH STATEMENT EXECUTE FUNCTION registry_append_only()"
    )
    op.execute(
        "CREATE TRIGGER in_force_forward BEFORE UPDATE ON in_force"
        " FOR EACH ROW EXECUTE FUNCTION registry_forward()"
    )
