"""What Alembic runs: the steps on the connection that `workbench.registry.migrate` hands over."""

from alembic import context

from workbench.registry.tables import Base

context.configure(
    connection=context.config.attributes["connection"],
    target_metadata=Base.metadata,
    compare_type=True,
)
with context.begin_transaction():
    context.run_migrations()
