"""A claim says for how long it was taken, so that one made by a fast clock is seen as such."""

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the length of the lease; unknown for claims that are held now."""
    op.add_column("claim", sa.Column("lease_ms", sa.BigInteger(), nullable=True))
