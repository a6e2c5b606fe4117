"""One pass: which files it takes, what it does with bad ones, and what it leaves for the next."""

import os
import socket
import subprocess
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest

from design.judgement import Judgement
from identification.errors import BadCard, BadLog, NotIdentifiable
from tests.workbench.jobs.machines import activate, machine
from tests.workbench.jobs.worker import clock, ignore, judge, short_pass
from tests.workbench.registry.postgres import Server
from workbench.jobs.options import is_gone
from workbench.jobs.passes import Judge, PassReport, Task, shared_clock
from workbench.jobs.scan import BadRoot, open_for_writing
from workbench.registry.queue import OFTEN, Queue
from workbench.registry.store import Registry
from workbench.registry.values import RegistryAway

Run = Callable[..., PassReport]


@pytest.fixture
def root(tmp_path: Path) -> Path:
    return tmp_path / "machines"


@pytest.fixture
def run(registry: Registry, root: Path) -> Run:
    """Runs a pass with a judge and changed settings."""

    def once(judge: Judge = judge, report: Any = ignore, **changes: Any) -> PassReport:
        return short_pass(registry, judge, root, "w", report, **changes).run()

    return once


def verdicts(done: PassReport) -> dict[str, str]:
    return {one.log.file: one.verdict for one in done.outcomes}


def test_each_log_once_a_bad_one_excluded(run: Run, registry: Registry, root: Path) -> None:
    activate(registry, "a", "b")
    machine(root, "a", {"1.csv": "quiet", "2.csv": "bad", "3.csv": "drift", "4.csv": "quiet too"})
    logs = machine(root, "b", {"1.csv": "quiet"})
    (logs / "notes.md").write_text("no log", encoding="utf-8")
    (logs / ".2.csv").write_text("hidden", encoding="utf-8")
    (root / "no_machine").mkdir()
    done = run()
    found = {(one.machine, one.log.file): one.verdict for one in done.outcomes}
    assert found == {
        ("a", "1.csv"): "none",
        ("a", "2.csv"): "set_aside",
        ("a", "3.csv"): "promoted",
        ("a", "4.csv"): "none",
        ("b", "1.csv"): "none",
    }
    assert done.machines == 2
    (bad,) = (one for one in done.outcomes if one.verdict == "set_aside")
    assert bad.reason == "2.csv: is bad"
    assert (root / "a" / "logs" / "2.csv").read_text(encoding="utf-8") == "bad"
    assert run().outcomes == ()
    machine(root, "a", {"copy_of_1.csv": "quiet", "5.csv": "new"})
    assert verdicts(run()) == {"5.csv": "none"}


@pytest.mark.slow
def test_logs_of_a_machine_come_in_order_and_evidence_goes_on(
    run: Run, registry: Registry, root: Path
) -> None:
    activate(registry, "a")
    logs = machine(root, "a", {f"{i}.csv": f"quiet {i}" for i in range(4)})
    for i in range(4):
        os.utime(logs / f"{i}.csv", (1000.0 - i, 1000.0 - i))
    done = run()
    assert [(o.log.file, o.evidence["count"]) for o in done.outcomes] == [
        ("3.csv", 1),
        ("2.csv", 2),
        ("1.csv", 3),
        ("0.csv", 4),
    ]


@pytest.mark.slow
def test_a_file_still_being_written_is_left(run: Run, registry: Registry, root: Path) -> None:
    activate(registry, "a")
    logs = machine(root, "a", {"old.csv": "quiet", "new.csv": "quiet 2", "late.csv": "quiet 3"})
    os.utime(logs / "old.csv", (1000.0, 1000.0))
    future = datetime.now(UTC).timestamp() + 3600
    os.utime(logs / "late.csv", (future, future))
    reports: list[tuple[str, Any]] = []
    done = run(settle=30.0, report=lambda e, **d: reports.append((e, d.get("file"))))
    assert verdicts(done) == {"old.csv": "none"}
    assert done.growing == 2
    assert ("log_from_the_future", "late.csv") in reports
    assert verdicts(run()) == {"new.csv": "none"}


@pytest.mark.slow
def test_a_file_open_for_writing_is_left(run: Run, registry: Registry, root: Path) -> None:
    activate(registry, "a")
    logs = machine(root, "a", {})
    with (logs / "1.csv").open("w", encoding="utf-8") as file:
        file.write("quiet")
        file.flush()
        os.utime(logs / "1.csv", (1000.0, 1000.0))
        assert open_for_writing(logs / "1.csv")
        done = run()
        assert (done.growing, done.outcomes) == (1, ())
        assert registry.machines()[0].logs == 0
    assert not open_for_writing(logs / "1.csv")
    assert verdicts(run()) == {"1.csv": "none"}


@pytest.mark.slow
def test_a_file_that_changes_while_it_is_judged_has_no_result(
    run: Run, registry: Registry, root: Path
) -> None:
    activate(registry, "a")
    logs = machine(root, "a", {"1.csv": "quiet"})

    def slow(task: Task) -> Judgement:
        if task.path.read_text(encoding="utf-8") == "quiet":
            (logs / "1.csv").write_text("quiet and more", encoding="utf-8")
        return judge(task)

    assert run(slow).outcomes == ()
    done = run(slow)
    # Of the earlier content nothing can be reported any more; the later one has its own result.
    assert [(o.verdict, "changed before" in o.reason) for o in done.outcomes] == [
        ("set_aside", True),
        ("none", False),
    ]


@pytest.mark.slow
def test_a_log_taken_away_waits(run: Run, registry: Registry, root: Path) -> None:
    activate(registry, "a")
    logs = machine(root, "a", {"1.csv": "quiet", "2.csv": "drift"})
    run(stopping_judge)
    (logs / "2.csv").rename(root / "elsewhere.csv")
    assert verdicts(run()) == {"1.csv": "none"}
    assert registry.machine("a").waiting == 1
    (root / "elsewhere.csv").rename(logs / "renamed.csv")
    (outcome,) = run().outcomes
    assert outcome.verdict == "promoted"


def stopping_judge(task: Task) -> Judgement:
    raise MemoryError("none left")


def stopping_judge_after(file: str) -> Judge:
    """Judges that file and dies of every other."""

    def dying(task: Task) -> Judgement:
        if task.log.file != file:
            raise MemoryError("none left")
        return judge(task)

    return dying


@pytest.mark.slow
def test_one_machine_that_fails_does_not_stop_others(
    run: Run, registry: Registry, root: Path
) -> None:
    activate(registry, "a", "b", "c")
    for name in "abc":
        machine(root, name, {"1.csv": f"quiet {name}"})

    def failing(task: Task) -> Judgement:
        if task.machine == "a":
            raise BadCard("card.toml: is wrong")
        if task.machine == "b":
            raise OSError(28, "No space left on device")
        return judge(task)

    done = run(failing)
    assert dict(done.failed) == {
        "a": "card.toml: is wrong",
        "b": "[Errno 28] No space left on device",
    }
    assert [o.machine for o in done.outcomes] == ["c"]
    assert [o.machine for o in run().outcomes] == ["a", "b"]  # nothing was lost


@pytest.mark.slow
def test_a_fault_of_ours_on_one_machine_does_not_stop_others(
    run: Run, registry: Registry, root: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    activate(registry, "a", "b")
    for name in "ab":
        machine(root, name, {"1.csv": f"quiet {name}"})
    announce = Queue.announce

    def failing(queue: Queue, name: str, *given: Any, **more: Any) -> int:
        if name == "a":
            raise ZeroDivisionError("of ours")
        return announce(queue, name, *given, **more)

    monkeypatch.setattr(Queue, "announce", failing)
    reports: list[tuple[str, Any]] = []
    done = run(report=lambda event, **more: reports.append((event, more.get("traceback"))))
    assert dict(done.failed) == {"a": "fault of ours: ZeroDivisionError: of ours"}
    assert [o.machine for o in done.outcomes] == ["b"]
    (trace,) = (shown for event, shown in reports if event == "fault_of_ours")
    assert "Traceback" in trace and "of ours" in trace


def odd(folder: Path) -> Path:
    """A file name in the folder that is not UTF-8."""
    return Path(os.fsdecode(os.fsencode(folder) + b"/caf\xe9.csv"))


@pytest.mark.slow
def test_names_that_are_not_utf8_stop_nothing(run: Run, registry: Registry, root: Path) -> None:
    activate(registry, "a", "z")
    logs = machine(root, "a", {"1.csv": "quiet", "2.csv": "quiet 2"})
    odd(logs).write_text("bad", encoding="utf-8")
    machine(root, os.fsdecode(b"caf\xe9"), {"1.csv": "drift"})
    machine(root, "z", {"1.csv": "drift"})
    done = run()
    assert [(o.machine, o.log.file, o.verdict) for o in done.outcomes] == [
        ("a", "1.csv", "none"),
        ("a", "2.csv", "none"),
        ("a", "caf\\xe9.csv", "set_aside"),
        ("z", "1.csv", "promoted"),
    ]
    assert dict(done.failed) == {"caf\\xe9": "the folder's name is not UTF-8; rename the folder"}
    assert run().outcomes == ()


@pytest.mark.slow
def test_a_marker_tells_that_a_writer_has_finished(
    run: Run, registry: Registry, root: Path
) -> None:
    activate(registry, "a")
    logs = machine(root, "a", {"1.csv": "quiet", "2.csv": "quiet 2"})
    (logs / "2.csv.done").touch()
    done = run(marker=".done")
    assert (verdicts(done), done.growing) == ({"2.csv": "none"}, 1)
    (logs / "1.csv").write_text("quiet, and all of it", encoding="utf-8")
    (logs / "1.csv.done").touch()
    assert verdicts(run(marker=".done")) == {"1.csv": "none"}


@pytest.mark.slow
def test_a_log_copied_late_makes_nothing_active(run: Run, registry: Registry, root: Path) -> None:
    activate(registry, "a")
    machine(root, "a", {"log5.csv": "drift 5"})
    assert verdicts(run()) == {"log5.csv": "promoted"}
    machine(root, "a", {"log0.csv": "drift 0"})
    seen: list[Any] = []

    def judging(task: Task) -> Judgement:
        seen.append(task.previous)
        return judge(task)

    (outcome,) = run(judging).outcomes
    assert (outcome.verdict, seen) == ("refused", [None])
    assert "not made active: log0.csv is older than log5.csv" in outcome.reason
    current = registry.active_version("a")
    assert current is not None and current.number == 2
    machine(root, "a", {"log6.csv": "drift 6"})
    assert verdicts(run()) == {"log6.csv": "promoted"}


def test_the_clock_is_the_databases_where_it_has_one(registry: Registry) -> None:
    def fast() -> datetime:
        return clock() + timedelta(hours=3)

    ahead = shared_clock(registry.database, fast)() - clock()
    if registry.database.dialect == "postgresql":
        assert abs(ahead) < timedelta(minutes=5)
    else:
        assert ahead > timedelta(hours=2)


@pytest.mark.slow
def test_what_a_log_raises_is_its_result(run: Run, registry: Registry, root: Path) -> None:
    activate(registry, "a")
    raises = {
        "1.csv": (BadLog("1.csv: gap"), "set_aside", "1.csv: gap"),
        "2.csv": (NotIdentifiable("nothing moves"), "not_judged", "nothing moves"),
        "3.csv": (
            PermissionError(13, "Permission denied"),
            "set_aside",
            "3.csv: Permission denied",
        ),
        "4.csv": (KeyError("oops"), "set_aside", "4.csv: fault of ours: KeyError: 'oops'"),
    }
    machine(root, "a", {name: name for name in raises})
    reports: list[str] = []

    def failing(task: Task) -> Judgement:
        raise raises[task.log.file][0]

    done = run(failing, report=lambda event, **_: reports.append(event))
    found = {o.log.file: (o.verdict, o.reason) for o in done.outcomes}
    assert found == {name: (verdict, reason) for name, (_, verdict, reason) in raises.items()}
    assert reports.count("fault_of_ours") == 1


@pytest.mark.slow
def test_a_log_that_ends_its_workers_is_excluded(run: Run, registry: Registry, root: Path) -> None:
    activate(registry, "a")
    machine(root, "a", {"1.csv": "quiet", "2.csv": "drift"})
    for _ in range(3):
        assert run(stopping_judge).outcomes == ()
    for _ in range(OFTEN - 3):
        run(stopping_judge)
    assert run(stopping_judge_after("2.csv")).outcomes != ()  # the other one no longer waits
    assert verdicts(run(attempts=OFTEN)) == {"1.csv": "set_aside"}
    assert registry.machine("a").waiting == 0


def test_a_machine_without_a_model_waits(run: Run, registry: Registry, root: Path) -> None:
    machine(root, "a", {"1.csv": "drift"})
    done = run()
    assert (done.without_model, done.outcomes) == (("a",), ())
    (outcome,) = run(first=True).outcomes
    assert (outcome.verdict, outcome.number) == ("promoted", None)
    assert registry.active_version("a") is not None


@pytest.mark.slow
def test_many_workers_at_once_judge_every_log_once(registry: Registry, root: Path) -> None:
    names = [f"m{i}" for i in range(4)]
    activate(registry, *names)
    for name in names:
        machine(root, name, {f"{i}.csv": f"{'drift' if i % 3 else 'quiet'} {i}" for i in range(6)})
    where = registry.database.where

    def work(who: int) -> int:
        with Registry(str(where)) as own:
            total = 0
            while not all(own.machine(n).logs == 6 and own.machine(n).waiting == 0 for n in names):
                done = short_pass(own, judge, root, f"w{who}").run()
                total += len(done.outcomes)
            return total

    with ThreadPoolExecutor(5) as pool:
        counts = list(pool.map(work, range(5)))
    assert sum(counts) == 24
    assert [len(registry.versions(name)) for name in names] == [5] * 4


@pytest.mark.slow
def test_a_database_away_in_the_middle(postgres: Server, tmp_path: Path) -> None:
    root = tmp_path / "machines"
    url = postgres.database()
    with Registry(url) as registry:
        activate(registry, "a")
        machine(root, "a", {"1.csv": "drift"})

        def outage(task: Task) -> Judgement:
            postgres.stop()
            return judge(task)

        quick = short_pass(registry, outage, root, "w", patience=0.3)
        try:
            with pytest.raises(RegistryAway, match="nothing is lost"):
                quick.run()
        finally:
            postgres.start()
        assert registry.machine("a").waiting == 1

        def short_outage(task: Task) -> Judgement:
            postgres.stop()
            postgres.start()
            return judge(task)

        patient = short_pass(registry, short_outage, root, "x", patience=20.0)
        while not (done := patient.run()).outcomes:
            assert done.busy == ("a",)  # until the lease of the first has ended
        assert [o.verdict for o in done.outcomes] == ["promoted"]
        assert len(registry.versions("a")) == 2
        assert not Queue(registry.database).waiting("a")


def test_a_root_that_is_none(run: Run, root: Path) -> None:
    with pytest.raises(BadRoot, match="no such folder"):
        run()
    root.mkdir()
    assert run().machines == 0


def test_notes_beside_the_logs_are_no_alarm(run: Run, registry: Registry, root: Path) -> None:
    activate(registry, "a")
    logs = {"1.csv": "bad", "empty.txt": "", "notes.txt": "28.11.2026 changed the belt of axis 2\n",
            "2.txt": "t y u\n0.0 1.0 2.0\n0.1 1.1 2.0\n"}  # fmt: skip
    machine(root, "a", logs)
    done = run()
    assert verdicts(done) == {"1.csv": "set_aside", "2.txt": "none"}
    assert done.no_logs == ("a/empty.txt", "a/notes.txt")
    assert registry.machine("a").waiting == 0


def test_a_machine_in_other_hands_is_said_and_a_dead_workers_is_taken(
    run: Run, registry: Registry, root: Path
) -> None:
    activate(registry, "a")
    machine(root, "a", {"1.csv": "quiet"})
    queue, here = Queue(registry.database), f"{socket.gethostname()}:"
    living, minute = f"{here}{os.getpid()}:abcd", timedelta(minutes=1)
    claim = queue.claim("a", owner=living, lease=minute, now=clock())
    assert claim is not None
    done = run()
    assert (done.busy, done.outcomes) == (("a",), ())
    assert done.held["a"].startswith(f"worker {living} has it until ")
    queue.release(claim)
    with subprocess.Popen(["true"]) as ended:
        ended.wait()
    assert queue.claim("a", owner=f"{here}{ended.pid}:abcd", lease=minute, now=clock())
    assert verdicts(run()) == {"1.csv": "none"}
    assert not is_gone("w") and not is_gone(f"other:{ended.pid}:abcd") and not is_gone(living)
