"""The registry's layout: a new one as the tables are, an older one brought up by Alembic, and the
triggers that keep tables append-only and the pointer to the active version moving forward."""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from sqlalchemy import Connection, Table, UniqueConstraint, inspect, text

from workbench.registry.tables import APPEND_ONLY, PAGE_APPEND_ONLY, Base
from workbench.registry.values import BadRegistry

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
    taken = sorted(set(Base.metadata.tables) & set(inspect(connection).get_table_names()))
    if found is None and taken:
        raise BadRegistry(
            f"registry {where}: holds a table {taken[0]!r} of something else; name another database"
        )
    if found != HEAD:
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
    postgres = connection.dialect.name == "postgresql"
    # The pointer first: the other triggers call one of these functions on PostgreSQL.
    for statement in POSTGRES_FUNCTIONS if postgres else SQLITE_POINTER:
        connection.execute(text(statement))
    keep_append_only(connection, (*APPEND_ONLY, *PAGE_APPEND_ONLY))
    command.stamp(settings, "head")


POSTGRES_FUNCTIONS = (
    """CREATE FUNCTION registry_append_only() RETURNS trigger LANGUAGE plpgsql AS $$ BEGIN
    RAISE EXCEPTION '% is append-only', TG_TABLE_NAME USING ERRCODE = 'restrict_violation';
    END $$""",
    """CREATE FUNCTION registry_forward() RETURNS trigger LANGUAGE plpgsql AS $$ BEGIN
    IF NEW.machine <> OLD.machine OR NEW.decision_id <= OLD.decision_id THEN
        RAISE EXCEPTION 'in_force moves by a new decision only'
        USING ERRCODE = 'restrict_violation';
    END IF; RETURN NEW; END $$""",
    "CREATE TRIGGER in_force_kept BEFORE DELETE OR TRUNCATE ON in_force"
    " FOR EACH STATEMENT EXECUTE FUNCTION registry_append_only()",
    "CREATE TRIGGER in_force_forward BEFORE UPDATE ON in_force"
    " FOR EACH ROW EXECUTE FUNCTION registry_forward()",
)
POSTGRES_KEEPS = (
    "CREATE TRIGGER {0}_append_only BEFORE UPDATE OR DELETE OR TRUNCATE ON {0}"
    " FOR EACH STATEMENT EXECUTE FUNCTION registry_append_only()"
)
POINTER_MOVES = "BEGIN SELECT RAISE(ABORT, 'in_force moves by a new decision only'); END"
SQLITE_POINTER = (
    "CREATE TRIGGER in_force_delete BEFORE DELETE ON in_force"
    " BEGIN SELECT RAISE(ABORT, 'in_force is never empty again'); END",
    "CREATE TRIGGER in_force_update BEFORE UPDATE ON in_force"
    f" WHEN NEW.machine <> OLD.machine OR NEW.decision_id <= OLD.decision_id {POINTER_MOVES}",
    "CREATE TRIGGER in_force_replace BEFORE INSERT ON in_force"
    f" WHEN EXISTS (SELECT 1 FROM in_force AS o WHERE o.machine = NEW.machine) {POINTER_MOVES}",
)


def keep_append_only(connection: Connection, names: Iterable[str]) -> None:
    """From now on rows of these tables are neither changed, replaced nor taken away."""
    postgres = connection.dialect.name == "postgresql"
    for name in names:
        for statement in [POSTGRES_KEEPS.format(name)] if postgres else _sqlite(name):
            connection.execute(text(statement))


def _sqlite(name: str) -> Iterator[str]:
    """SQLite's REPLACE calls no DELETE trigger: what it would collide with is looked for."""
    said = f"SELECT RAISE(ABORT, '{name} is append-only')"
    for event in ("UPDATE", "DELETE"):
        yield f"CREATE TRIGGER {name}_{event.lower()} BEFORE {event} ON {name} BEGIN {said}; END"
    same = (" AND ".join(f"o.{column} = NEW.{column}" for column in key)
            for key in _keys(Base.metadata.tables[name]))  # fmt: skip
    taken = " OR ".join(f"({one})" for one in same)
    yield (
        f"CREATE TRIGGER {name}_replace BEFORE INSERT ON {name}"
        f" WHEN EXISTS (SELECT 1 FROM {name} AS o WHERE {taken}) BEGIN {said}; END"
    )


def _keys(table: Table) -> Iterator[list[str]]:
    """Columns by which a row is the only one."""
    yield [column.name for column in table.primary_key]
    for one in sorted(table.constraints, key=lambda one: str(one.name)):
        if isinstance(one, UniqueConstraint):
            yield [column.name for column in one.columns]
    for index in sorted(table.indexes, key=lambda one: str(one.name)):
        if index.unique:
            yield [column.name for column in index.columns]
