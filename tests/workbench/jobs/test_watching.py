"""Watching: a first pass at once, then by schedule and by files, one at a time, until stopped."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
from watchfiles import Change

from tests.workbench.jobs.machines import activate, machine
from tests.workbench.jobs.worker import clock, ignore
from workbench.jobs.passes import Report
from workbench.jobs.watching import BadSchedule, of_log, watch_machines
from workbench.registry.store import Registry

NEVER = "0 0 29 2 *"
LONG = 60.0  # s; a wait that a loaded machine does not reach


def until(reached: Callable[[], bool]) -> None:
    """Wait until something is reached."""
    end = time.monotonic() + LONG
    while not reached():
        assert time.monotonic() < end
        time.sleep(0.02)


@contextmanager
def watching(
    root: Path, once: Callable[[], bool], report: Report = ignore, **changes: object
) -> Iterator[None]:
    """Watching in a thread; the block may change files."""
    stop = threading.Event()
    how = {"cron": NEVER, "settle": timedelta(0), "clock": clock, "stop": stop, "report": report}
    how |= changes
    thread = threading.Thread(target=watch_machines, args=(root, once), kwargs=how)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join(LONG)
        assert not thread.is_alive()


@pytest.mark.slow
def test_a_pass_at_once_and_with_every_new_log(tmp_path: Path) -> None:
    logs = machine(tmp_path, "a", {})
    passes: list[int] = []

    def once() -> bool:
        passes.append(len(list(logs.iterdir())))
        return False

    def written() -> bool:
        (logs / f"{time.monotonic_ns()}.csv").write_text("quiet", encoding="utf-8")
        return len(passes) >= 3

    with watching(tmp_path, once):
        until(lambda: len(passes) == 1)
        until(written)
    assert passes[0] == 0 and passes[-1] > 0


def test_only_logs_and_cards_bring_a_pass(tmp_path: Path) -> None:
    for name, counts in (
        ("a/logs/1.csv", True),
        ("a/logs/1.parquet", True),
        ("a/card.toml", True),
        ("a/logs/notes.md", False),
        ("registry.db-wal", False),
        ("a/1.csv", False),
    ):
        assert of_log(Change.modified, str(tmp_path / name)) is counts


def test_files_still_being_written_bring_another_pass(tmp_path: Path) -> None:
    machine(tmp_path, "a", {})
    growing = [True, True, False]
    passes: list[bool] = []

    def once() -> bool:
        passes.append(growing[len(passes)])
        return passes[-1]

    with watching(tmp_path, once):
        until(lambda: len(passes) == 3)
    assert passes == growing


@pytest.mark.slow
def test_passes_never_overlap(tmp_path: Path) -> None:
    logs = machine(tmp_path, "a", {})
    running, most, count = 0, 0, 0

    def once() -> bool:
        nonlocal running, most, count
        running += 1
        most = max(most, running)
        time.sleep(0.1)
        running -= 1
        count += 1
        return False

    with watching(tmp_path, once):
        for i in range(100):
            (logs / f"{i % 3}.csv").write_text(str(i), encoding="utf-8")
            time.sleep(0.01)
        until(lambda: count >= 3)
    assert most == 1


@pytest.mark.slow
def test_what_the_watcher_dies_of_is_reported_and_it_goes_on(tmp_path: Path) -> None:
    logs = machine(tmp_path, "a", {})
    passes: list[int] = []
    reports: list[str] = []

    def once() -> bool:
        passes.append(len(list(logs.iterdir())))
        return False

    def one_more() -> bool:
        (logs / f"{time.monotonic_ns()}.csv").write_text("quiet", encoding="utf-8")
        return len(passes) >= 4

    with watching(tmp_path, once, lambda event, **_: reports.append(event)):
        until(lambda: len(passes) == 1)
        until(lambda: "watcher_failed" in reports or not write_odd(logs))
        until(one_more)
    assert set(reports) == {"watcher_failed"}


def write_odd(logs: Path) -> bool:
    """Writes files whose names are not UTF-8, on which the watcher's library fails."""
    odd = os.fsencode(logs) + b"/%d\xe9.csv" % time.monotonic_ns()
    Path(os.fsdecode(odd)).write_text("quiet", encoding="utf-8")
    return True


@pytest.mark.slow
def test_a_marker_brings_a_pass(tmp_path: Path) -> None:
    logs = machine(tmp_path, "a", {"1.csv": "quiet"})
    passes: list[int] = []

    def once() -> bool:
        passes.append(1)
        return False

    def marked() -> bool:
        (logs / f"{time.monotonic_ns()}.csv.done").touch()
        return len(passes) >= 2

    with watching(tmp_path, once, marker=".done"):
        until(lambda: len(passes) == 1)
        until(marked)


def test_a_schedule_that_is_none(tmp_path: Path) -> None:
    with pytest.raises(BadSchedule, match="five fields needed"):
        watch_machines(
            tmp_path, lambda: False, cron="every day", settle=timedelta(0),
            clock=lambda: datetime.now(UTC), stop=threading.Event(), report=ignore,
        )  # fmt: skip


def test_the_command_serves_metrics_and_ends_on_a_signal(tmp_path: Path) -> None:
    where, root = tmp_path / "r.db", tmp_path / "machines"
    with Registry(str(where)) as registry:
        activate(registry, "a")
    machine(root, "a", {"1.csv": "t,y\n0,0\n"})
    (root / "a" / "card.toml").write_text(
        '[card]\nname = "a"\n[rig]\nkind = "force"\n[signals]\nt = { column = "t", unit = "s" }\n'
        'y = { column = "y", unit = "m" }\nF = { column = "F", unit = "N" }\n',
        encoding="utf-8",
    )
    port = str(free_port())
    command = [sys.executable, "-m", "workbench", "watch", str(root), "--registry", str(where),
               "--settle", "0", "--cron", NEVER, "--port", port]  # fmt: skip
    running = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    assert running.stderr is not None
    try:
        events: list[dict[str, Any]] = []
        while not events or events[-1]["event"] != "pass_done":
            events.append(json.loads(running.stderr.readline()))
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/metrics", timeout=LONG) as answer:
            text = answer.read().decode()
        running.send_signal(signal.SIGTERM)
        _, rest = running.communicate(timeout=LONG)
    finally:
        running.kill()
        running.wait()
    assert running.returncode == 0
    assert json.loads(rest.splitlines()[-1])["event"] == "stopped"
    assert 'servo_workbench_logs_judged{machine="a",verdict="set_aside"} 1.0' in text
    (judged,) = (e for e in events if e["event"] == "log_judged")
    assert "no column 'F'" in judged["reason"]


def free_port() -> int:
    """A port that nobody listened on a moment ago."""
    import socket

    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        number: int = found.getsockname()[1]
        return number
