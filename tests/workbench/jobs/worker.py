"""A worker with a fast judge, for tests that kill it: run as `worker.work` in its own process."""

import time
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from design.judgement import Candidate, Judgement
from identification.errors import BadLog
from workbench.jobs.options import JobOptions
from workbench.jobs.passes import Judge, Pass, PassReport, Report, Task
from workbench.registry.store import Registry

LEASE = 0.4  # s


def short_pass(
    registry: Registry, judge: Judge, root: Path, owner: str, report: Report | None = None,
    attempts: int = 10_000, **changes: Any,
) -> Pass:  # fmt: skip
    """A pass with the times of short tests; a log is never given up."""
    given = {"lease": LEASE, "settle": 0.0, "patience": 5.0, **changes}
    wanted = JobOptions(root, None, seed=0, effects=(), **given)
    return Pass(registry, judge, wanted, owner, clock, report or ignore, attempts=attempts)


def clock() -> datetime:
    """The time now."""
    return datetime.now(UTC)


def judge(task: Task) -> Judgement:
    """By the file's text: "bad" is excluded, "drift" makes a new version, others are quiet."""
    text = task.path.read_text(encoding="utf-8")
    time.sleep(0.002)
    if "bad" in text:
        raise BadLog(f"{task.path.name}: is bad")
    if "drift" not in text:
        return Judgement("none", "quiet", evidence={"count": _count(task) + 1})
    model = {"by": task.log.sha256, "after": None if task.version is None else task.version.number}
    candidate = Candidate(model, {"k": task.log.sha256}, {"passed": True})
    return Judgement("promoted", "drift", candidate, {"count": 0})


def _count(task: Task) -> int:
    return int((task.previous or {}).get("count", 0))


def ignore(event: str, **details: object) -> None:
    """A report that nobody reads."""


def one_pass(where: str, root: str, owner: str) -> PassReport:
    """One pass in this process."""
    with Registry(where) as registry:
        return short_pass(registry, judge, Path(root), owner).run()


def work(where: str, root: str, owner: str) -> None:
    """Pass after pass until it is killed."""
    while True:
        one_pass(where, root, owner)
        time.sleep(0.005)
