"""The first layout. No step makes it any more: a new registry is laid out as the tables are today,
and only one from before comes through the steps after this."""

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None
