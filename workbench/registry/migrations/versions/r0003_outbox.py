"""The outbox: alarms on their way to a webhook, and when each is tried next."""

import sqlalchemy as sa
from alembic import op

from workbench.registry.tables import UtcTime

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Make its table."""
    op.create_table(
        "outbox",
        sa.Column("log_id", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("turn", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("refusals", sa.Integer(), nullable=False),
        sa.Column("next_at", UtcTime(), nullable=False),
        sa.Column("tried_at", UtcTime(), nullable=True),
        sa.Column("given_up_at", UtcTime(), nullable=True),
        sa.PrimaryKeyConstraint("log_id", "turn", name="pk_outbox"),
        sa.ForeignKeyConstraint(
            ["log_id", "turn"], ["outcome.log_id", "outcome.turn"], name="fk_outbox_log_id_turn"
        ),
    )
