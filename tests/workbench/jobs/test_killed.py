"""Workers killed at 200 random points: nothing half done, nothing lost, nothing twice."""

import json
import multiprocessing
import multiprocessing.process
import random
import time
from multiprocessing.context import ForkServerContext
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import text
from sqlalchemy.orm import Session

from tests.workbench.jobs.machines import in_force, machine
from tests.workbench.jobs.worker import LEASE, one_pass, work
from workbench.registry.queue import Queue
from workbench.registry.store import Registry

MACHINES = ("a", "b", "c")
KILLS = 200
IN_HAND = 10  # kills, at least, that hit a worker with a log in hand
MOST = 4 * KILLS  # where starting takes long, few do: kills go on for so long
LONGEST = 0.16  # s that a worker lives at most
SEED = 20260301
PROMOTED = """SELECT l.machine, l.sha256 FROM outcome o JOIN log l ON l.id = o.log_id
WHERE o.verdict = 'promoted'"""
BROKEN_OFF = """SELECT count(*) FROM attempt a JOIN outcome o ON o.log_id = a.log_id
WHERE o.token <> a.token"""
DECIDED = """SELECT d.machine, l.sha256 FROM decision d JOIN log l ON l.id = d.log_id"""
IN_FORCE = """SELECT f.machine, v.number FROM in_force f JOIN version v ON v.id = f.version_id
JOIN decision d ON d.id = f.decision_id
WHERE d.id = (SELECT max(id) FROM decision x WHERE x.machine = f.machine)"""


def starter() -> ForkServerContext:
    """Processes that start in milliseconds, what they import being there already."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["tests.workbench.jobs.worker"])
    return context


def fill(root: Path, number: int) -> dict[str, int]:
    """New logs for every machine; how many there are of each kind."""
    kinds = ("quiet", "drift", "bad")
    count = dict.fromkeys(kinds, 0)
    for name in MACHINES:
        logs = {}
        for i in range(3):
            kind = kinds[(number + i) % 3]
            logs[f"{number:04d}_{i}.csv"] = f"{kind} {name} {number} {i}"
            count[kind] += 1
        machine(root, name, logs)
    return count


@pytest.mark.parametrize("where", ["sqlite", "postgresql"], indirect=True)
def test_killed_at_200_random_points(where: str, tmp_path: Path) -> None:
    root = tmp_path / "machines"
    rng = random.Random(SEED)
    with Registry(where) as registry:
        in_force(registry, *MACHINES)
    made = fill(root, MOST)  # a worker with no folder to look at would end by itself
    context = starter()
    running = [begin(context, where, root, i) for i in range(2)]
    try:
        for killed in range(MOST):
            if killed >= KILLS and broken_off(where) >= IN_HAND:
                break
            if killed % 2 == 0:
                for kind, count in fill(root, killed).items():
                    made[kind] += count
            time.sleep(rng.uniform(0.0, LONGEST))
            victim = rng.randrange(len(running))
            assert running[victim].is_alive()  # it died of nothing else before
            running[victim].kill()
            running[victim].join()
            running[victim] = begin(context, where, root, killed)
            if killed % 4 == 0:
                with Registry(where) as registry:
                    check(registry)
    finally:
        for worker in running:
            worker.kill()
            worker.join()
    time.sleep(2 * LEASE.total_seconds())
    while one_pass(where, str(root), "last").busy:
        time.sleep(0.1)
    with Registry(where) as registry:
        check(registry)
        complete(registry, made)
    assert broken_off(where) >= IN_HAND


def begin(
    context: ForkServerContext, where: str, root: Path, number: int
) -> multiprocessing.process.BaseProcess:
    """A worker that runs."""
    worker = context.Process(target=work, args=(where, str(root), f"w{number}"), daemon=True)
    worker.start()
    return worker


def check(registry: Registry) -> None:
    """Every result has all that belongs to it, and nothing is there without a result.

    Read in one transaction, since another worker goes on meanwhile.
    """
    with registry.database.reading() as session:
        promoted = rows(session, PROMOTED)
        assert rows(session, DECIDED) == promoted
        versions = rows(session, "SELECT machine, number, model_id FROM version")
        assert len(versions) == len(MACHINES) + len(promoted)
        last = [(name, max(n for m, n, _ in versions if m == name)) for name in MACHINES]
        assert rows(session, IN_FORCE) == sorted(last)
        documents = dict(rows(session, "SELECT id, document FROM record WHERE kind = 'model'"))
        by_log = {(name, digest) for name, digest in promoted}
        for name, number, model in versions:
            if number > 1:
                document = json.loads(documents[model])
                assert (name, document["by"]) in by_log
                assert document["after"] == number - 1  # judged against the one before


def rows(session: Session, query: str) -> list[Any]:
    """What a query gives, sorted."""
    return sorted(tuple(row) for row in session.execute(text(query)))


def complete(registry: Registry, made: dict[str, int]) -> None:
    """Every log has its result."""
    queue = Queue(registry.database)
    outcomes = [o for name in MACHINES for o in queue.outcomes(name)]
    found = dict.fromkeys(("none", "promoted", "set_aside"), 0)
    for outcome in outcomes:
        found[outcome.verdict] += 1
    expected = {"none": made["quiet"], "promoted": made["drift"], "set_aside": made["bad"]}
    assert found == expected, json.dumps(found)
    assert not any(queue.waiting(name) for name in MACHINES)


def broken_off(where: str) -> int:
    """Logs in the hand of a killed worker that another has brought to an end since."""
    with Registry(where) as registry, registry.database.reading() as session:
        return int(session.scalar(text(BROKEN_OFF)) or 0)
