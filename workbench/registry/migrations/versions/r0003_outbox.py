"""The outbox: alarms on their way to a webhook, and when each is tried next."""

from alembic import op

from workbench.registry.tables import OutboxRow

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Make its table, as it is today: who changes it later writes it out here as it was."""
    OutboxRow.metadata.create_all(op.get_bind(), [OutboxRow.metadata.tables["outbox"]])
