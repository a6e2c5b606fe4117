"""A worker with a fast judge, for tests that kill it: run as `worker.work` in its own process."""

import time
from datetime import UTC, datetime, timedelta
from pathlib import Path

from identification.errors import BadLog
from workbench.jobs.lease import Patience
from workbench.jobs.passes import Pass, PassReport, PassSettings, Task
from workbench.registry.store import Registry
from workbench.registry.values import Candidate, Judgement

LEASE = timedelta(seconds=0.4)


def settings(owner: str, **changes: object) -> PassSettings:
    """Settings for short tests; a log is never given up."""
    given = {
        "lease": LEASE,
        "settle": timedelta(0),
        "attempts": 10_000,
        "patience": Patience(5.0, 0.1),
    }
    return PassSettings(owner, **{**given, **changes})  # type: ignore[arg-type]


def clock() -> datetime:
    """The time now."""
    return datetime.now(UTC)


def judge(task: Task) -> Judgement:
    """By the file's text: "bad" is set aside, "drift" makes a new version, others are quiet."""
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
        return Pass(registry, judge, settings(owner), clock, ignore).run(Path(root))


def work(where: str, root: str, owner: str) -> None:
    """Pass after pass until it is killed."""
    while True:
        one_pass(where, root, owner)
        time.sleep(0.005)
