"""A worker of the page whose tasks take no fit, for tests that cancel and kill it."""

import signal
import time
from datetime import timedelta
from pathlib import Path
from typing import Any

from identification.errors import BadLog
from workbench.course import Course
from workbench.page import worker
from workbench.page.settings import PageSettings
from workbench.page.worker import Work
from workbench.registry.bench import Bench

LEASE = timedelta(seconds=1.0)
POLL_PERIOD = 0.05  # s


def quick(work: Work, course: Course) -> str:
    """As long as the log's text says [s]; a file's name and time tell when it began and ended."""
    text = work.log.read_text(encoding="utf-8")
    if "bad" in text:
        raise BadLog(f"{work.log}: is bad")
    folder = work.card.parent
    note = folder / f"notes-{time.time_ns()}"
    end = time.monotonic() + float(text)
    while time.monotonic() < end:
        course.report("refining", 0.5)
        note.touch()
        time.sleep(0.01)
    (folder / "done").write_text("done")
    return "made"


def work(where: str, root: str, *, once: bool = False) -> None:
    """Run a worker with `quick` in place of the fits, which Ctrl-C ends however it was started."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    patched: Any = worker
    patched.done, patched.TASK_LEASE, patched.QUEUE_POLL = quick, LEASE, POLL_PERIOD
    settings = PageSettings(where, Path(root))
    worker.run_worker(settings, lambda event, **details: None, once=once)


def put(bench: Bench, root: Path, upload: Any, text: str) -> None:
    """An upload as the page keeps it, with a card."""
    folder = root / ".drops" / upload.id
    (folder / "log").mkdir(parents=True)
    (folder / "log" / "a.csv").write_text(text, encoding="utf-8")
    (folder / "card.toml").write_text("", encoding="utf-8")
    bench.add(upload)
