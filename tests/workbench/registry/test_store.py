"""What is added stays, the pointer moves by decisions only, and others' questions are refused."""

from datetime import UTC, datetime, timedelta

import pytest
from sqlalchemy import text
from sqlalchemy.exc import DBAPIError

from design.judgement import Candidate, Judgement
from workbench.registry.outbox import Outbox
from workbench.registry.queue import Queue
from workbench.registry.store import Registry
from workbench.registry.tables import APPEND_ONLY, Base
from workbench.registry.values import BadRegistry, SeenLog

NOW = datetime(2026, 3, 1, 12, tzinfo=UTC)
WHO = {"reason": "a test", "by": "tester"}


def candidate(mass: float = 1.0) -> Candidate:
    return Candidate({"m": mass}, {"k": mass}, {"passed": True})


def add(registry: Registry, machine: str, *masses: float) -> None:
    for mass in masses:
        registry.add(machine, candidate(mass), now=NOW, **WHO)


def test_a_version_is_what_was_added(registry: Registry) -> None:
    version = registry.add("a", candidate(2.0), now=NOW, **WHO)
    assert (version.machine, version.number, version.made_at) == ("a", 1, NOW)
    assert registry.document(version, "model") == {"m": 2.0}
    assert registry.document(version, "design") == {"k": 2.0}
    assert registry.document(version, "validation") == {"passed": True}
    assert registry.active_version("a") is None
    (decision,) = registry.decisions("a")
    assert (decision.kind, decision.number, decision.reason) == ("added", 1, "a test")


def test_numbers_count_by_machine_and_the_same_again_adds_nothing(registry: Registry) -> None:
    add(registry, "a", 1.0, 2.0)
    add(registry, "b", 1.0)
    assert registry.add("a", candidate(1.0), now=NOW, **WHO).number == 1
    assert [v.number for v in registry.versions("a")] == [1, 2]
    assert [v.number for v in registry.versions("b")] == [1]
    assert len(registry.decisions()) == 3


def test_documents_may_be_missing(registry: Registry) -> None:
    version = registry.add("a", Candidate({"m": 1}), now=NOW, **WHO)
    assert version.design is None
    with pytest.raises(BadRegistry, match="version 1: has no design"):
        registry.document(version, "design")
    assert registry.add("a", Candidate({"m": 1}), now=NOW, **WHO) == version


def test_rollback_goes_back_one_by_one(registry: Registry) -> None:
    add(registry, "a", 1.0, 2.0, 3.0)
    for number in (1, 2, 3):
        registry.promote("a", number, now=NOW + timedelta(hours=number), **WHO)
    assert registry.rollback("a", now=NOW, **WHO).number == 2
    made = registry.rollback("a", now=NOW, reason="it hunts", by="night shift")
    assert (made.kind, made.number, made.reason) == ("rolled_back", 1, "it hunts")
    state = registry.machine("a")
    assert state.in_force is not None and state.in_force.number == 1
    assert state.since == made
    with pytest.raises(BadRegistry, match="version 1 is the first that was active"):
        registry.rollback("a", now=NOW, **WHO)
    registry.promote("a", 3, now=NOW, **WHO)
    assert registry.rollback("a", now=NOW, **WHO).number == 1


def test_what_a_worker_has_activated_is_accepted_by_promoting_it(registry: Registry) -> None:
    add(registry, "a", 1.0)
    registry.promote("a", 1, now=NOW, **WHO)
    queue, log = Queue(registry.database), SeenLog("f" * 64, "f.csv", 1, 1)
    queue.announce("a", [log], now=NOW)
    claim = queue.claim("a", owner="w", lease=timedelta(minutes=1), now=NOW)
    assert claim is not None
    queue.finish(claim, log, Judgement("promoted", "r", Candidate({"m": 2.0})), by="w", now=NOW)
    active, accepted = registry.active_version("a"), registry.accepted_version("a")
    assert active is not None and accepted is not None
    assert (active.number, accepted.number) == (2, 1)
    assert registry.promote("a", 2, now=NOW, **WHO).kind == "promoted"
    assert registry.accepted_version("a") == active
    with pytest.raises(BadRegistry, match="version 2 is active already"):
        registry.promote("a", 2, now=NOW, **WHO)
    assert registry.rollback("a", now=NOW, **WHO).number == 1


def test_what_is_not_there_is_refused(registry: Registry) -> None:
    with pytest.raises(BadRegistry, match="no machine 'a'; it holds no machine yet"):
        registry.machine("a")
    add(registry, "bench-a", 1.0)
    with pytest.raises(BadRegistry, match="no machine 'bench-b'"):
        registry.promote("bench-b", 1, now=NOW, **WHO)
    with pytest.raises(BadRegistry, match="no version 2; it has 1 to 1"):
        registry.promote("bench-a", 2, now=NOW, **WHO)
    with pytest.raises(BadRegistry, match="no version has been active"):
        registry.rollback("bench-a", now=NOW, **WHO)
    registry.promote("bench-a", 1, now=NOW, **WHO)
    with pytest.raises(BadRegistry, match="version 1 is active already"):
        registry.promote("bench-a", 1, now=NOW, **WHO)
    assert len(registry.decisions()) == 2


@pytest.mark.slow
@pytest.mark.parametrize("name", ["", "a/b", ".hidden", "two\nlines"])
def test_a_name_that_no_folder_can_have_is_refused(registry: Registry, name: str) -> None:
    with pytest.raises(BadRegistry, match="can be a folder's"):
        add(registry, name, 1.0)
    assert registry.machines() == ()


def filled(registry: Registry) -> None:
    """A row in every table."""
    add(registry, "a", 1.0, 2.0)
    registry.promote("a", 1, now=NOW, **WHO)
    registry.promote("a", 2, now=NOW, **WHO)
    queue = Queue(registry.database)
    log = SeenLog("0" * 64, "a.csv", 10, 5)
    queue.announce("a", [log], now=NOW)
    claim = queue.claim("a", owner="w", lease=timedelta(minutes=1), now=NOW)
    assert claim is not None
    queue.begin(claim, log, now=NOW)
    queue.finish(claim, log, Judgement("none", "quiet"), by="w", now=NOW)
    outbox = Outbox(registry.database)
    outbox.fill(["none"], since=NOW, now=NOW)
    (alarm,) = outbox.due(NOW)
    outbox.sent(alarm, now=NOW)
    queue.reopen("a", [log.file], reason="again", by="w", now=NOW)


KEY = {"machine": "name", "outcome": "log_id", "notice": "log_id"}


@pytest.mark.slow
@pytest.mark.parametrize("table", APPEND_ONLY)
def test_the_database_itself_keeps_rows(registry: Registry, table: str) -> None:
    filled(registry)
    key = KEY.get(table, "id")
    columns = ", ".join(c.name for c in Base.metadata.tables[table].columns)
    wanted = [
        f"UPDATE {table} SET {key} = {key}",
        f"DELETE FROM {table}",
    ]
    if registry.database.dialect == "sqlite":
        wanted.append(f"INSERT OR REPLACE INTO {table} SELECT {columns} FROM {table}")
    else:
        wanted.append(f"TRUNCATE {table} CASCADE")
    for statement in wanted:
        with pytest.raises(DBAPIError, match="append-only"), registry.database.writing() as session:
            session.execute(text(statement))


def test_the_pointer_moves_by_a_new_decision_of_the_same_version_only(registry: Registry) -> None:
    filled(registry)
    old, added = (min(d.id for d in registry.decisions() if d.number == n) for n in (1, 2))
    newest = max(d.id for d in registry.decisions())
    wrong = [
        "DELETE FROM in_force",
        "UPDATE in_force SET version_id = 1",
        f"UPDATE in_force SET version_id = 1, decision_id = {old}",
        f"UPDATE in_force SET decision_id = {added}",
        f"UPDATE in_force SET decision_id = {newest + 1}",
    ]
    for statement in wrong:
        with pytest.raises(DBAPIError), registry.database.writing() as session:
            session.execute(text(statement))
    state = registry.machine("a")
    assert state.in_force is not None and state.in_force.number == 2
