"""The registry's database: SQLite by path or PostgreSQL by URL, the same for all that use it."""

import os
import re
import secrets
import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from datetime import datetime
from pathlib import Path
from typing import Any

from sqlalchemy import (
    URL,
    ColumnElement,
    Connection,
    Engine,
    Row,
    Select,
    create_engine,
    event,
    exc,
    func,
    make_url,
    select,
    update,
)
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import DeclarativeBase, Session, sessionmaker

from workbench.files import broken_link
from workbench.registry.migrate import upgrade
from workbench.registry.values import BadRegistry, RegistryAway

REGISTRY_VARIABLE = "WORKBENCH_REGISTRY"
DEFAULT = "registry.db"
BUSY_TIMEOUT = 30.0  # s that SQLite waits for another process to end its transaction
CONNECT = 10  # s that a PostgreSQL server may take to answer
READING = "registry_reading"
EXAMPLE = "postgresql://user:password@host:5432/name"
_LIKE_A_URL = re.compile(r"postgres\w*(\+\w+)?:|.*\bpassword=", re.I)  # mistyped, no file's name


class Database:
    """Sessions on the registry's database, its layout up to date.

    where: a file, or a URL such as postgresql://user:password@host/name. create: make what is not
    there. Raises BadRegistry where it is none of ours, RegistryAway where it does not answer.
    """

    def __init__(self, where: str, *, create: bool = True) -> None:
        url = _url(where)
        self.where = str(url.database) if url.drivername == "sqlite" else _shown(url)
        if url.drivername == "sqlite":
            _refuse_place(Path(self.where), create)
            if not Path(self.where).exists():
                _make_whole(Path(self.where))
        self._engine = _engine(url, self.where)
        try:
            with _guarded(self.where), self._engine.begin() as connection:
                upgrade(connection, self.where)
        except BaseException:
            self.close()
            raise

    @property
    def dialect(self) -> str:
        """ "sqlite" or "postgresql"."""
        return self._engine.dialect.name

    @contextmanager
    def reading(self) -> Iterator[Session]:
        """A session that reads one state of the database and writes nothing."""
        options: dict[str, Any] = {READING: True}
        if self._engine.dialect.name == "postgresql":
            options["isolation_level"] = "REPEATABLE READ"
        made = sessionmaker(self._engine.execution_options(**options), expire_on_commit=False)
        with _guarded(self.where), made.begin() as session:
            yield session

    def rows(self, query: Select[*tuple[Any, ...]]) -> Sequence[Row[*tuple[Any, ...]]]:
        """All rows of one query, in a session of its own."""
        with self.reading() as session:
            return session.execute(query).all()

    @contextmanager
    def writing(self) -> Iterator[Session]:
        """A session whose changes are all kept when the block ends, or none."""
        made = sessionmaker(self._engine, expire_on_commit=False)
        with _guarded(self.where), made.begin() as session:
            yield session

    def close(self) -> None:
        """Give every connection back."""
        self._engine.dispose()

    def now(self, here: datetime) -> datetime:
        """The time by the database's clock, `here` where it has none of its own (SQLite)."""
        if self.dialect == "sqlite":
            return here
        with self.reading() as session:
            found: datetime = session.execute(select(func.clock_timestamp())).scalar_one()
        return found


def changed(
    session: Session, table: type[DeclarativeBase], where: ColumnElement[bool], **values: Any
) -> int:
    """Change these rows; how many there were."""
    done: Any = session.execute(update(table).where(where).values(**values))
    count: int = done.rowcount
    return count


def insert_missing(session: Session, table: type[DeclarativeBase]) -> Any:
    """A statement that inserts into the table what is not there yet."""
    of_postgres = session.get_bind().dialect.name == "postgresql"
    insert = postgresql.insert if of_postgres else sqlite.insert
    return insert(table).on_conflict_do_nothing()


@contextmanager
def _guarded(where: str) -> Iterator[None]:
    """What the driver says of a database away or full, as RegistryAway in one line."""
    try:
        yield
    except exc.IntegrityError:
        raise
    except (exc.OperationalError, exc.InterfaceError, exc.InternalError, exc.TimeoutError) as error:
        raise RegistryAway(_away(where, error)) from error
    except exc.DatabaseError as error:
        if isinstance(error.orig, sqlite3.DatabaseError):
            raise BadRegistry(
                f"registry {where}: {error.orig}; name a registry's file, or a new one"
            ) from None
        # Without a statement it is of an option in the URL that the driver does not know.
        if isinstance(error, exc.ProgrammingError) and error.statement is None:
            said = " ".join(str(error.orig).split())
            raise BadRegistry(f"registry {where}: {said}; correct the URL") from None
        raise


def location(given: str | None) -> str:
    """Where the registry is: what was given, else WORKBENCH_REGISTRY, else registry.db here."""
    return given or os.environ.get(REGISTRY_VARIABLE) or DEFAULT


def _url(where: str) -> URL:
    if "\0" in where:
        raise BadRegistry("registry: its name holds a NUL byte; name a file or a URL")
    if "://" not in where:
        if _LIKE_A_URL.match(where):
            raise _unreadable("it has no '://'")
        return URL.create("sqlite", database=str(Path(where)))
    try:
        url = make_url(where)
    except exc.ArgumentError:
        raise _unreadable("its parts are not found") from None
    except ValueError:  # of what stands where the port should be
        raise _unreadable("its port is no number") from None
    if "%00" in where:
        raise _unreadable("it holds a NUL byte")
    backend = url.get_backend_name()
    if backend == "sqlite" and url.database:
        return URL.create("sqlite", database=url.database)
    if backend in ("postgresql", "postgres"):
        _check_host(url)
        return url.set(drivername="postgresql+psycopg")
    raise BadRegistry(f"registry: a URL of {backend!r}, a file or {EXAMPLE} needed")


def _check_host(url: URL) -> None:
    """Raises BadRegistry where host or port can be none; whether they are there is asked later."""
    if url.port is not None and not 0 < url.port < 65536:
        raise _unreadable(f"its port is {url.port}, 1 to 65535 needed")
    for host in (url.host or "", *url.normalized_query.get("host", ())):
        if "@" in host or not host.isprintable() or " " in host:
            raise _unreadable("its host is none; write @ as %40 and / as %2F in a password")
        try:
            host.encode("idna")
        except UnicodeError as error:
            if host.startswith("/"):
                continue  # the folder of a socket
            raise _unreadable(f"its host is none: {error.__cause__ or error}") from None


def _unreadable(why: str) -> BadRegistry:
    """The URL itself is not shown: where it is mistyped, its password may stand anywhere."""
    return BadRegistry(f"registry: the URL cannot be read ({why}); as in {EXAMPLE}")


def _shown(url: URL) -> str:
    """The URL without its password and what else its query may hold."""
    query = {key: value for key, value in url.query.items() if key in ("host", "port")}
    return url.set(drivername="postgresql", query=query).render_as_string(hide_password=True)


def _refuse_place(path: Path, create: bool) -> None:
    """Raises BadRegistry where no registry can be at `path`, or none is and none is to be made."""
    if path.is_dir():
        raise BadRegistry(f"registry {path}: is a folder; name a file in it")
    broken = None if create else broken_link(path)
    if broken:
        raise BadRegistry(f"registry {path}: {broken}")
    if not path.exists() and not create:
        raise BadRegistry(
            f"registry {path}: no such file; 'workbench registry add' makes one, or name it by"
            f" --registry or {REGISTRY_VARIABLE}"
        )
    if not path.absolute().parent.is_dir():
        raise BadRegistry(f"registry {path}: no folder {path.parent}; make it first")
    if path.exists() and path.stat().st_size == 0:
        raise BadRegistry(
            f"registry {path}: is empty (0 bytes), which no registry ever is; restore it from a"
            " copy, or remove the file to begin a new one"
        )


def _make_whole(path: Path) -> None:
    """A new registry's file, laid out before it has its name, so that none is ever empty."""
    part = path.with_name(f".{path.name}.{secrets.token_hex(4)}.part")
    try:
        engine = _engine(URL.create("sqlite", database=str(part)), str(path))
        try:
            with _guarded(str(path)), engine.begin() as connection:
                upgrade(connection, str(path))
        finally:
            engine.dispose()  # the last connection brings the log of writes into the file
        with suppress(FileExistsError):  # another process was faster; its file counts
            os.link(part, path)
    finally:
        for rest in ("", "-wal", "-shm", "-journal"):
            part.with_name(part.name + rest).unlink(missing_ok=True)


def _engine(url: URL, where: str) -> Engine:
    if url.drivername == "sqlite":
        engine = create_engine(url, connect_args={"timeout": BUSY_TIMEOUT})
        event.listen(engine, "connect", _prepare_sqlite)
        event.listen(engine, "begin", _begin_sqlite)
        return engine
    try:
        return create_engine(
            url,
            pool_pre_ping=True,
            connect_args={"connect_timeout": CONNECT, "application_name": "workbench"},
        )
    except exc.ArgumentError:
        raise _unreadable("its hosts and ports do not fit") from None
    except (ImportError, exc.NoSuchModuleError):
        raise BadRegistry(
            f"registry {where}: PostgreSQL needs a driver that is not installed; install"
            " 'servo-workbench[postgres]'"
        ) from None


def _prepare_sqlite(connection: Any, _record: object) -> None:
    """A write-ahead log, so that readers and the one writer do not wait for each other.

    isolation_level None leaves BEGIN to us: the driver's own comes too late to hold a lock.
    """
    connection.isolation_level = None
    for setting in ("journal_mode = WAL", "synchronous = FULL", "foreign_keys = ON"):
        connection.execute(f"PRAGMA {setting}").close()


def _begin_sqlite(connection: Connection) -> None:
    """A writer takes its lock at once: a reader that would write later meets "locked" at once."""
    reading = connection.get_execution_options().get(READING, False)
    connection.exec_driver_sql("BEGIN" if reading else "BEGIN IMMEDIATE")


def _away(where: str, error: Exception) -> str:
    said = error.orig if isinstance(error, exc.DBAPIError) else error
    line = " ".join(str(said).split())
    advice = "nothing is lost; check the database and run again"
    if "full" in line or "I/O" in line:
        advice = "nothing is lost; free some space on its disk and run again"
    elif "locked" in line:
        advice = "another process holds it; run again"
    elif "readonly" in line or "unable to open" in line:
        advice = "check the rights of the file and of its folder"
    return f"registry {where}: {line}; {advice}"
