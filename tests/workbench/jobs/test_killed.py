"""Workers killed at random points: nothing half done, nothing lost, nothing twice.

30 of them, or as many as the variable KILLS says.

Among the logs are some that come late and some that are to be judged again: none of them puts an
older model active.
"""

import json
import multiprocessing
import multiprocessing.process
import os
import random
import time
from itertools import pairwise
from multiprocessing.context import ForkServerContext
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import text
from sqlalchemy.orm import Session

from tests.workbench.jobs.machines import activate, machine
from tests.workbench.jobs.worker import LEASE, clock, one_pass, work
from workbench.registry.queue import Queue
from workbench.registry.store import Registry

pytestmark = pytest.mark.slow

MACHINES = ("a", "b", "c")
KILLS = int(os.environ.get("KILLS", "30"))
IN_HAND = KILLS // 10  # kills, at least, that hit a worker with a log in hand
MOST = 4 * KILLS  # where starting takes long, few do: kills go on for so long
LONGEST = 0.16  # s that a worker lives at most
SEED = 20260301
KINDS = ("quiet", "drift", "bad")
EXPECTED_OUTCOMES = {"quiet": {"none"}, "drift": {"promoted", "refused"}, "bad": {"set_aside"}}
DECIDED = """SELECT d.kind, d.machine, l.sha256 FROM decision d JOIN log l ON l.id = d.log_id"""
OUTCOMES = """SELECT o.verdict, l.machine, l.sha256 FROM outcome o JOIN log l ON l.id = o.log_id
WHERE o.verdict IN ('promoted', 'refused')"""
BROKEN_OFF = """SELECT count(*) FROM attempt a JOIN outcome o ON o.log_id = a.log_id
WHERE o.token <> a.token"""
PROMOTED = """SELECT d.machine, d.id, v.number, l.mtime_ns, l.file, r.document FROM decision d
JOIN version v ON v.id = d.version_id JOIN record r ON r.id = v.model_id
LEFT JOIN log l ON l.id = d.log_id WHERE d.kind = 'promoted'"""
IN_FORCE = """SELECT f.machine, f.decision_id FROM in_force f"""
TURNS = """SELECT l.id, (SELECT count(*) FROM outcome o WHERE o.log_id = l.id),
(SELECT count(*) FROM reopening r WHERE r.log_id = l.id) FROM log l"""


def starter() -> ForkServerContext:
    """Processes that start in milliseconds, what they import being there already."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["tests.workbench.jobs.worker"])
    return context


def fill(root: Path, number: int, rng: random.Random) -> None:
    """New logs for every machine, and one that comes late: by its name, often by its time too."""
    later = rng.choice(MACHINES)
    for name in MACHINES:
        logs = {}
        for i in range(3):
            logs[f"{number:05d}_{i}.csv"] = f"{KINDS[(number + i) % 3]} {name} {number} {i}"
        folder = machine(root, name, logs)
        if number and name == later:
            earlier = 2 * rng.randrange(number // 2)
            beside = folder / f"{earlier:05d}_0.csv"
            late = folder / f"{earlier:05d}_{3 + number}.csv"
            written = folder / "_late"
            written.write_text(f"{rng.choice(KINDS)} {name} late {number}", encoding="utf-8")
            if rng.random() < 0.5:
                moment = beside.stat().st_mtime_ns + 1
                os.utime(written, ns=(moment, moment))
            written.rename(late)


def retry(registry: Registry, rng: random.Random) -> None:
    """Has some logs that were judged before judged again."""
    queue = Queue(registry.database)
    for name in MACHINES:
        waiting = {log.sha256 for log, _ in queue.waiting(name)}
        judged = sorted({o.log.file for o in queue.outcomes(name) if o.log.sha256 not in waiting})
        if judged:
            queue.reopen(name, [rng.choice(judged)], reason="r", by="t", now=clock())


@pytest.mark.parametrize("where", ["sqlite", "postgresql"], indirect=True)
def test_killed_at_random_points(where: str, tmp_path: Path) -> None:
    root = tmp_path / "machines"
    rng = random.Random(SEED)
    with Registry(where) as registry:
        activate(registry, *MACHINES)
    fill(root, 0, rng)  # a worker with no folder to look at would end by itself
    context = starter()
    running = [begin(context, where, root, i) for i in range(2)]
    try:
        for killed in range(1, MOST):
            if killed > KILLS and broken_off(where) >= IN_HAND:
                break
            if killed % 2 == 0:
                fill(root, killed, rng)
            time.sleep(rng.uniform(0.0, LONGEST))
            victim = rng.randrange(len(running))
            assert running[victim].is_alive()  # it died of nothing else before
            running[victim].kill()
            running[victim].join()
            running[victim] = begin(context, where, root, killed)
            if killed % 4 == 0:
                with Registry(where) as registry:
                    check(registry)
                    retry(registry, rng)
    finally:
        for worker in running:
            worker.kill()
            worker.join()
    time.sleep(2 * LEASE)
    while one_pass(where, str(root), "last").busy:
        time.sleep(0.1)
    with Registry(where) as registry:
        check(registry)
        complete(registry, root)
    assert broken_off(where) >= IN_HAND


def begin(
    context: ForkServerContext, where: str, root: Path, number: int
) -> multiprocessing.process.BaseProcess:
    """A worker that runs."""
    worker = context.Process(target=work, args=(where, str(root), f"w{number}"), daemon=True)
    worker.start()
    return worker


def check(registry: Registry) -> None:
    """Every result has all that belongs to it, and no older log has changed what is active.

    Read in one transaction, since another worker goes on meanwhile.
    """
    with registry.database.reading() as session:
        assert rows(session, DECIDED) == rows(session, OUTCOMES)
        promoted = rows(session, PROMOTED)
        last = {name: decision for name, decision, *_ in promoted}  # ordered by their ids
        assert rows(session, IN_FORCE) == sorted(last.items())
    for name in MACHINES:
        own = [row for row in promoted if row[0] == name]
        for before, after in pairwise(own):
            assert json.loads(after[5])["after"] == before[2]  # judged against the active one
            if before[3] is not None:
                assert (before[3], before[4]) <= (after[3], after[4])
                assert number_of(before[4]) <= number_of(after[4])


def number_of(file: str) -> tuple[int, ...]:
    """The numbers in a log's name, in whose order they were recorded."""
    return tuple(int(part) for part in file.removesuffix(".csv").split("_"))


def rows(session: Session, query: str) -> list[Any]:
    """What a query gives, sorted."""
    return sorted(tuple(row) for row in session.execute(text(query)))


def complete(registry: Registry, root: Path) -> None:
    """Every log has one result each time that it was to be judged, and the right one."""
    queue = Queue(registry.database)
    for name in MACHINES:
        assert not queue.waiting(name)
        outcomes_of: dict[str, set[str]] = {}
        for outcome in queue.outcomes(name):
            outcomes_of.setdefault(outcome.log.file, set()).add(outcome.verdict)
        files = {path.name: path for path in (root / name / "logs").glob("*.csv")}
        assert set(outcomes_of) == set(files)
        for file, verdicts in outcomes_of.items():
            kind = files[file].read_text(encoding="utf-8").split()[0]
            assert verdicts <= EXPECTED_OUTCOMES[kind], file
    with registry.database.reading() as session:
        turns = rows(session, TURNS)
    assert all(results == again + 1 for _, results, again in turns)
    assert any(again for *_, again in turns)


def broken_off(where: str) -> int:
    """Logs in the hand of a killed worker that another has brought to an end since."""
    with Registry(where) as registry, registry.database.reading() as session:
        return int(session.scalar(text(BROKEN_OFF)) or 0)
