"""Servers and workers that are killed, cancelled or asked to end: nothing is lost or done twice."""

import multiprocessing
import os
import signal
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from tests.workbench.page.quick_worker import put, work
from tests.workbench.page.served import serving
from tests.workbench.registry.postgres import Server
from workbench.registry import bench as bench_module
from workbench.registry.access import Access
from workbench.registry.bench import Bench
from workbench.registry.store import Registry
from workbench.registry.tables import UploadRow

pytestmark = pytest.mark.slow

SPAWN = multiprocessing.get_context("spawn")
TASKS, WORKERS, KILLS = 12, 2, 5
ROWS = "t,y\n" + "".join(f"{k * 1e-3:.3f},{k % 7}\n" for k in range(300))


def upload(number: int) -> UploadRow:
    now = datetime.now(UTC)
    return UploadRow(
        id=f"{number:016x}", file="a.csv", size=3, sha256="f" * 64, made_by="anna", at=now
    )


def started(where: str, root: Path, **options: bool) -> Any:
    found = SPAWN.Process(target=work, args=(where, str(root)), kwargs=options)
    found.start()
    return found


def until(true: Callable[[], Any], seconds: float = 120.0) -> None:
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end, "it does not come"
        time.sleep(0.02)


def test_killed_workers_lose_nothing_and_do_nothing_twice(
    where: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng = np.random.default_rng(1)
    with Registry(where) as registry:
        bench = Bench(registry.database)
        for k in range(TASKS):
            put(bench, tmp_path, upload(k), "0.3")
            bench.ask(upload(k).id, "identify", by="anna", now=datetime.now(UTC))
        workers = [started(where, tmp_path) for _ in range(WORKERS)]
        until(lambda: bench.counts().get("running"))
        for _ in range(KILLS):
            time.sleep(float(rng.uniform(0.1, 0.5)))
            victim = int(rng.integers(WORKERS))
            workers[victim].kill()
            workers[victim].join()
            workers[victim] = started(where, tmp_path)
        until(lambda: not {"waiting", "running"} & set(bench.counts()))
        for one in workers:
            one.terminate()
            one.join()
        # One that was killed three times is given up; all others are done.
        ended = [bench.tasks(upload(k).id)[0] for k in range(TASKS)]
        assert {one.state for one in ended} <= {"done", "failed"}
        assert sum(one.state == "failed" for one in ended) <= KILLS // bench_module.MOST_BEGUN
        for one in ended:
            runs = sorted((tmp_path / ".drops" / one.upload).glob("notes-*"))
            spans = [(int(p.name[6:]), p.stat().st_mtime_ns) for p in runs]
            later = spans[1:]
            assert all(a[1] <= b[0] for a, b in zip(spans, later, strict=False)), spans


def test_a_worker_drops_what_is_cancelled_and_gives_back_what_it_must(
    where: str, tmp_path: Path
) -> None:
    with Registry(where) as registry:
        bench = Bench(registry.database)
        for k, text in enumerate(("60", "bad", "0.05", "60")):
            put(bench, tmp_path, upload(k), text)
        long = bench.ask(upload(0).id, "trace", by="anna", now=datetime.now(UTC))
        worker = started(where, tmp_path)
        until(lambda: bench.task(long.id).stage == "refining")
        bench.cancel(long.id, by="anna", now=datetime.now(UTC))
        bad = bench.ask(upload(1).id, "trace", by="anna", now=datetime.now(UTC))
        good = bench.ask(upload(2).id, "trace", by="anna", now=datetime.now(UTC))
        until(lambda: bench.task(good.id).state == "done")  # by the same worker
        assert worker.is_alive()
        assert bench.task(bad.id).said == "a.csv: is bad"
        assert bench.task(long.id).state == "cancelled"
        last = bench.ask(upload(3).id, "identify", by="anna", now=datetime.now(UTC))
        until(lambda: bench.task(last.id).stage == "refining")
        os.kill(worker.pid, signal.SIGINT)
        worker.join()
        assert bench.task(last.id).state == "waiting"
        assert not (tmp_path / ".drops" / upload(3).id / "done").exists()


def children(pid: int) -> list[int]:
    """Processes that the process has started."""
    found = []
    for entry in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = entry.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[1]) == pid:
            found.append(int(entry.parent.name))
    return found


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="no /proc to find servers in")
def test_killed_servers_are_started_again_and_nothing_is_lost(
    postgres: Server, tmp_path: Path
) -> None:
    where, root = postgres.database(), tmp_path / "machines"
    with Registry(where) as registry:
        token = Access(registry.database).add("a", "change", by="t", now=datetime.now(UTC))
    head = {"Authorization": f"Bearer {token}"}
    with serving(where, root, "--servers", "2", "--workers", "0") as served:
        given = httpx.post(f"{served.address}/drop", headers=head, timeout=120.0,
                           files={"log": ("a.csv", ROWS)})  # fmt: skip
        assert given.status_code == 303
        place = given.headers["location"]

        def answers() -> bool:
            try:
                return httpx.get(served.address + place, timeout=10.0).status_code == 200
            except httpx.TransportError:
                return False

        killed = [pid for pid in children(served.process.pid) if _serves(pid)]
        assert len(killed) == 2
        for pid in killed:
            os.kill(pid, signal.SIGKILL)
        until(answers)
        now = [pid for pid in children(served.process.pid) if _serves(pid)]
        assert not set(now) & set(killed)
        served.process.kill()
        served.process.wait()
        for pid in now:
            os.kill(pid, signal.SIGKILL)
    with Registry(where) as registry:
        assert Bench(registry.database).upload(place.rpartition("/")[2]).file == "a.csv"
    assert (root / ".drops" / place.rpartition("/")[2] / "log" / "a.csv").read_text() == ROWS


def _serves(pid: int) -> bool:
    """Whether the process is a server, and not what multiprocessing needs beside it."""
    command = Path(f"/proc/{pid}/cmdline").read_bytes().decode("utf-8", "replace")
    return "spawn_main" in command
