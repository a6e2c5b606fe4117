"""The registry's layout: a new one as the tables are, an older one brought up by Alembic."""

from pathlib import Path
from typing import TYPE_CHECKING

from sqlalchemy import Connection, inspect, text

from workbench.registry.errors import BadRegistry
from workbench.registry.page_tables import PAGE_APPEND_ONLY
from workbench.registry.tables import APPEND_ONLY, Base
from workbench.registry.triggers import keep_append_only, keep_pointer

if TYPE_CHECKING:
    from alembic.config import Config

HEAD = "0004"  # known without importing Alembic, which most starts do not need
RESTORE = "somebody has changed the database by hand; restore it from a copy"
LAYOUT_LOCK = 0x5E7A0  # of PostgreSQL's advisory locks, held while the layout changes


def upgrade(connection: Connection, where: str) -> None:
    """Bring the layout up to date within the connection's transaction.

    Raises BadRegistry where it is of a newer workbench or damaged, or the database holds something
    else.
    """
    if revision(connection, where) == HEAD:
        _refuse_damaged(connection, where)
        return
    if connection.dialect.name == "postgresql":
        connection.execute(text("SELECT pg_advisory_xact_lock(:key)"), {"key": LAYOUT_LOCK})
    found = revision(connection, where)
    if found == HEAD:
        return
    if found is None:
        _refuse_foreign(connection, where)
    _run(connection, where, found)


def revision(connection: Connection, where: str) -> str | None:
    """The layout's revision; None where there is none yet. Raises BadRegistry where it has two."""
    if not inspect(connection).has_table("alembic_version"):
        return None
    found = connection.execute(text("SELECT version_num FROM alembic_version")).scalars().all()
    if len(found) > 1:
        raise BadRegistry(
            f"registry {where}: names {len(found)} layouts ({', '.join(sorted(found))}), one"
            f" needed; {RESTORE}"
        )
    return str(found[0]) if found else None


def _refuse_damaged(connection: Connection, where: str) -> None:
    """Raises BadRegistry where a table or one of the triggers that keep them is gone."""
    tables = set(inspect(connection).get_table_names())
    lost = sorted(set(Base.metadata.tables) - tables)
    if lost:
        raise BadRegistry(f"registry {where}: its table {lost[0]!r} is gone; {RESTORE}")
    sqlite = connection.dialect.name == "sqlite"
    query = (
        "SELECT DISTINCT tbl_name FROM sqlite_master WHERE type = 'trigger'"
        if sqlite
        else "SELECT DISTINCT c.relname FROM pg_trigger t JOIN pg_class c ON c.oid = t.tgrelid"
        " WHERE NOT t.tgisinternal AND pg_table_is_visible(c.oid)"
    )
    protected = set(connection.execute(text(query)).scalars())
    open_to_change = sorted({*APPEND_ONLY, *PAGE_APPEND_ONLY, "in_force"} - protected)
    if open_to_change:
        raise BadRegistry(
            f"registry {where}: nothing keeps its table {open_to_change[0]!r} from being changed"
            f" any more; {RESTORE}"
        )


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
    """Lay a new registry out, or bring one of the layout `found` up to today's."""
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
    if found is not None:
        command.upgrade(settings, "head")
        return
    Base.metadata.create_all(connection)
    keep_pointer(connection)
    keep_append_only(connection, (*APPEND_ONLY, *PAGE_APPEND_ONLY))
    command.stamp(settings, "head")
