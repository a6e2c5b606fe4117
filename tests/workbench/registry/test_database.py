"""Layout, migration, several processes at once, and databases that are not there."""

import multiprocessing
import os
import sqlite3
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import text

from design.judgement import Candidate, Judgement
from tests.workbench.registry.postgres import Server
from workbench.registry.database import location
from workbench.registry.migrate import HEAD, config
from workbench.registry.overview import FleetAsked, fleet_page
from workbench.registry.queue import Queue
from workbench.registry.store import Registry
from workbench.registry.tables import Base
from workbench.registry.values import BadRegistry, RegistryAway, SeenLog

NOW = datetime(2026, 3, 1, tzinfo=UTC)
PROCESSES, EACH = 6, 15
PAGE_TABLES = (  # those that refer to others first
    *("access_token_end", "access_token", "task", "upload", "audit"),
    *("machine_now", "machine_trend"),
)


def test_steps_and_tables_agree(registry: Registry) -> None:
    with registry.database.writing() as session:
        context = MigrationContext.configure(session.connection(), opts={"compare_type": True})
        assert compare_metadata(context, Base.metadata) == []
        assert context.get_current_revision() == HEAD


def test_the_last_step_is_the_one_that_is_expected() -> None:
    assert ScriptDirectory.from_config(config()).get_current_head() == HEAD


@pytest.mark.slow
@pytest.mark.parametrize("layout", ["0001", "0002"])
def test_a_registry_from_before_the_outbox_is_brought_up_to_date(where: str, layout: str) -> None:
    log = SeenLog("f" * 64, "a.csv", 1, 1)
    moved = {"name": "F_cp", "before": 10.0, "after": 12.0}
    found = Judgement("structure", "r", evidence={"drift": {"moved": [moved]}})
    with Registry(where) as registry:
        registry.add("a", Candidate({"m": 1}), reason="r", by="t", now=NOW)
        queue = Queue(registry.database)
        queue.announce("a", [log], now=NOW)
        claim = queue.claim("a", owner="w", lease=timedelta(hours=1), now=NOW)
        assert claim is not None
        queue.finish(claim, log, found, by="w", now=NOW)
        before = fleet_page(registry.database, FleetAsked(NOW))
        with registry.database.writing() as session:
            for table in ("outbox", *PAGE_TABLES):
                session.execute(text(f"DROP TABLE {table}"))
            if layout == "0001":
                session.execute(text("ALTER TABLE claim DROP COLUMN lease_ms"))
            session.execute(text(f"UPDATE alembic_version SET version_num = '{layout}'"))
    with Registry(where) as registry:
        test_steps_and_tables_agree(registry)
        assert [v.number for v in registry.versions("a")] == [1]
        after = fleet_page(registry.database, FleetAsked(NOW))
    assert after == before
    (line,) = after.lines
    assert (line.state, line.moved, line.logs, line.heard_at) == ("structure", "F_cp", 1, NOW)
    assert list(line.trend) == [12.0]


def test_a_newer_layout_is_refused(where: str) -> None:
    with Registry(where) as registry, registry.database.writing() as session:
        session.execute(text("UPDATE alembic_version SET version_num = '9999'"))
    with pytest.raises(BadRegistry, match="layout '9999', this workbench knows up to"):
        Registry(where)


def test_a_table_of_something_else_is_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "other.db"
    with sqlite3.connect(path) as other:
        other.execute("CREATE TABLE log (line TEXT)")
    other.close()
    with pytest.raises(BadRegistry, match="holds a table 'log' of something else"):
        Registry(str(path))


def test_an_empty_file_is_no_new_registry(tmp_path: Path) -> None:
    path = tmp_path / "r.db"
    path.touch()
    for create in (True, False):
        with pytest.raises(BadRegistry, match=r"is empty \(0 bytes\).*restore it"):
            Registry(str(path), create=create)
    assert path.stat().st_size == 0
    path.unlink()
    Registry(str(path)).close()
    assert [one.name for one in tmp_path.iterdir()] == ["r.db"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("INSERT INTO alembic_version VALUES ('0001')", "names 2 layouts"),
        ("DROP TABLE notice", "its table 'notice' is gone"),
        ("DROP TRIGGER {outcome}", "nothing keeps its table 'outcome'"),
    ],
)
def test_a_database_changed_by_hand_is_refused(where: str, change: str, said: str) -> None:
    with Registry(where) as registry, registry.database.writing() as session:
        if "TRIGGER" not in change:
            session.execute(text(change))
        elif registry.database.dialect == "sqlite":
            for event in ("update", "delete", "replace"):
                session.execute(text(change.format(outcome=f"outcome_{event}")))
        else:
            session.execute(text(change.format(outcome="outcome_append_only ON outcome")))
    with pytest.raises(BadRegistry, match=said):
        Registry(where)


def many(where: str, who: int) -> None:
    """What each of several processes does: add versions of one machine and promote them."""
    with Registry(where) as registry:
        for i in range(EACH):
            version = registry.add(
                "a", Candidate({"who": who, "i": i}), reason="r", by=str(who), now=NOW
            )
            registry.promote("a", version.number, reason="r", by=str(who), now=NOW)


@pytest.mark.slow
def test_several_processes_make_it_and_write_it_at_once(where: str) -> None:
    context = multiprocessing.get_context("spawn")
    workers = [context.Process(target=many, args=(where, who)) for who in range(PROCESSES)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    assert [worker.exitcode for worker in workers] == [0] * PROCESSES
    with Registry(where) as registry:
        count = PROCESSES * EACH
        assert [v.number for v in registry.versions("a")] == list(range(1, count + 1))
        decisions = registry.decisions("a")
        state = registry.machine("a")
    assert len(decisions) == 2 * count
    moved = [d for d in decisions if d.kind == "promoted"]
    assert state.since == moved[-1]
    assert state.in_force is not None and state.in_force.number == moved[-1].number


@pytest.mark.slow
def test_a_server_that_is_away_says_so_and_is_used_when_back(postgres: Server) -> None:
    url = postgres.database()
    with Registry(url) as registry:
        registry.add("a", Candidate({"m": 1}), reason="r", by="t", now=NOW)
        postgres.stop()
        try:
            with pytest.raises(RegistryAway, match="nothing is lost"):
                registry.machines()
            with pytest.raises(RegistryAway, match="nothing is lost"):
                Registry(url)
        finally:
            postgres.start()
        assert [m.name for m in registry.machines()] == ["a"]


def test_passwords_are_not_shown() -> None:
    with pytest.raises(RegistryAway) as caught:
        Registry("postgresql://me:secret@127.0.0.1:9/none?password=secret&sslkey=secret")
    assert "secret" not in str(caught.value)
    assert "127.0.0.1" in str(caught.value)


@pytest.mark.parametrize(
    "url",
    [
        "postgresql://me:secret@host:port/x",
        "postgresql://[::1",
        "postgresql://me:secret@h:99999/x",
        "postgresql://me:secret@h:-1/x",
        f"postgresql://me:secret@{300 * 'a'}/x",
        f"postgresql://me:secret@/x?host={300 * 'a'}",
        "postgresql://me:secret@a..b/x",
        "postgresql://me:secret@h\u00f6 st/x",
        "postgresql://me:secret@h\0/x",
        "postgresql://me:secret%00@h/x",
        "postgresql://me:p@secret@127.0.0.1:9/x",
        "postgresql://me:secret@h/x?port=abc",
        "postgresql://me:secret@h/x?host=a&host=b&port=1",
        "postgresql://me:a@127.0.0.1:9/x?nonsense=secret",
        "postgresql:/me:secret@h/x",
        "host=h password=secret",
        "mysql://me:secret@h/x",
    ],
)
def test_a_url_that_is_none_is_one_line_without_its_password(url: str) -> None:
    with pytest.raises(BadRegistry, match="registry") as caught:
        Registry(url)
    said = str(caught.value)
    assert "secret" not in said and "\n" not in said and len(said) < 200


def test_places_that_cannot_be_are_refused(tmp_path: Path) -> None:
    text_file = tmp_path / "notes.txt"
    text_file.write_text("no database at all, but text\n" * 40, encoding="utf-8")
    for place, said in (
        (str(tmp_path), "is a folder"),
        (str(tmp_path / "no" / "r.db"), "no folder"),
        (str(text_file), "not a database"),
        ("mysql://a/b", "a URL of 'mysql'"),
        ("://", "cannot be read"),
    ):
        with pytest.raises(BadRegistry, match=said):
            Registry(place)
    with pytest.raises(BadRegistry, match="no such file; 'workbench registry add' makes one"):
        Registry(str(tmp_path / "r.db"), create=False)
    assert not (tmp_path / "r.db").exists()


def test_a_full_disk_is_said_and_leaves_what_was(tmp_path: Path) -> None:
    place = str(tmp_path / "r.db")
    with Registry(place) as registry:
        registry.add("a", Candidate({"m": 1}), reason="r", by="t", now=NOW)
        with registry.database.writing() as session:
            pages = session.execute(text("PRAGMA page_count")).scalar()
            session.execute(text(f"PRAGMA max_page_count = {pages}"))
        with pytest.raises(RegistryAway, match=r"full.*free some space on its disk"):
            registry.add("a", Candidate({"m": "x" * 100_000}), reason="r", by="t", now=NOW)
        assert [v.number for v in registry.versions("a")] == [1]


def test_location_is_the_option_the_variable_or_the_default(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delenv("WORKBENCH_REGISTRY", raising=False)
    assert location(None) == "registry.db"
    monkeypatch.setitem(os.environ, "WORKBENCH_REGISTRY", "x.db")
    assert location(None) == "x.db"
    assert location("y.db") == "y.db"
