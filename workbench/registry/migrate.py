"""The registry's layout brought up to date by Alembic, by whichever process comes first."""

from pathlib import Path
from typing import TYPE_CHECKING

from sqlalchemy import Connection, inspect, text

from workbench.registry.errors import BadRegistry
from workbench.registry.tables import Base

if TYPE_CHECKING:
    from alembic.config import Config

HEAD = "0002"  # known without importing Alembic, which most starts do not need
LOCK = 0x5E7A0  # of PostgreSQL's advisory locks, held while the layout changes


def upgrade(connection: Connection, where: str) -> None:
    """Bring the layout up to date within the connection's transaction.

    Raises BadRegistry where it is of a newer workbench, or the database holds something else.
    """
    if revision(connection) == HEAD:
        return
    if connection.dialect.name == "postgresql":
        connection.execute(text("SELECT pg_advisory_xact_lock(:key)"), {"key": LOCK})
    found = revision(connection)
    if found == HEAD:
        return
    if found is None:
        _refuse_foreign(connection, where)
    _run(connection, where, found)


def revision(connection: Connection) -> str | None:
    """The layout's revision; None where there is none yet."""
    if not inspect(connection).has_table("alembic_version"):
        return None
    found = connection.execute(text("SELECT version_num FROM alembic_version")).scalar()
    return None if found is None else str(found)


def config() -> "Config":
    """Alembic's configuration: where the steps are."""
    from alembic.config import Config

    out = Config()
    folder = Path(__file__).parent / "migrations"
    out.set_main_option("script_location", str(folder).replace("%", "%%"))
    out.set_main_option("path_separator", "os")
    return out


def _refuse_foreign(connection: Connection, where: str) -> None:
    ours = set(Base.metadata.tables)
    taken = sorted(ours & set(inspect(connection).get_table_names()))
    if taken:
        raise BadRegistry(
            f"registry {where}: holds a table {taken[0]!r} of something else; name another database"
        )


def _run(connection: Connection, where: str, found: str | None) -> None:
    from alembic import command
    from alembic.script import ScriptDirectory

    settings = config()
    known = {step.revision for step in ScriptDirectory.from_config(settings).walk_revisions()}
    if found is not None and found not in known:
        raise BadRegistry(
            f"registry {where}: layout {found!r}, this workbench knows up to {HEAD!r}; update the"
            " workbench"
        )
    settings.attributes["connection"] = connection
    command.upgrade(settings, "head")
