"""Triggers that keep tables append-only, and the pointer to the active version moving forward."""

from collections.abc import Iterable, Iterator

from sqlalchemy import Connection, Table, UniqueConstraint, text

from workbench.registry.tables import Base

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
POINTER_MOVES = "BEGIN SELECT RAISE(ABORT, 'in_force moves by a new decision only'); END"
SQLITE_POINTER = (
    "CREATE TRIGGER in_force_delete BEFORE DELETE ON in_force"
    " BEGIN SELECT RAISE(ABORT, 'in_force is never empty again'); END",
    "CREATE TRIGGER in_force_update BEFORE UPDATE ON in_force"
    f" WHEN NEW.machine <> OLD.machine OR NEW.decision_id <= OLD.decision_id {POINTER_MOVES}",
    "CREATE TRIGGER in_force_replace BEFORE INSERT ON in_force"
    f" WHEN EXISTS (SELECT 1 FROM in_force AS o WHERE o.machine = NEW.machine) {POINTER_MOVES}",
)


def keep_pointer(connection: Connection) -> None:
    """From now on the pointer to the active version moves by a new decision only.

    Before `keep_append_only`, whose triggers call one of these functions on PostgreSQL.
    """
    postgres = connection.dialect.name == "postgresql"
    for statement in POSTGRES_FUNCTIONS if postgres else SQLITE_POINTER:
        connection.execute(text(statement))


def keep_append_only(connection: Connection, names: Iterable[str]) -> None:
    """From now on rows of these tables are neither changed, replaced nor taken away."""
    postgres = connection.dialect.name == "postgresql"
    for name in names:
        for statement in _postgres(name) if postgres else _sqlite(Base.metadata.tables[name]):
            connection.execute(text(statement))


def _postgres(name: str) -> Iterator[str]:
    yield (
        f"CREATE TRIGGER {name}_append_only BEFORE UPDATE OR DELETE OR TRUNCATE ON {name}"
        " FOR EACH STATEMENT EXECUTE FUNCTION registry_append_only()"
    )


def _sqlite(table: Table) -> Iterator[str]:
    """SQLite's REPLACE calls no DELETE trigger: what it would collide with is looked for."""
    name, said = table.name, f"SELECT RAISE(ABORT, '{table.name} is append-only')"
    for event in ("UPDATE", "DELETE"):
        yield f"CREATE TRIGGER {name}_{event.lower()} BEFORE {event} ON {name} BEGIN {said}; END"
    taken = " OR ".join(
        f"({' AND '.join(f'o.{column} = NEW.{column}' for column in key)})" for key in _keys(table)
    )
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
