"""A worker of the page: takes the next task, does it, and stops where it is cancelled.

It may be killed at any moment: its lease ends, and another begins the task anew.
"""

import os
import signal
import threading
import time
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import timedelta
from types import FrameType

from identification.errors import UserError
from workbench.jobs.lease import Patience, renewed
from workbench.jobs.options import clock, worker_name
from workbench.jobs.passes import Report
from workbench.page.dropped import LOG_FOLDER, Drop, without_path
from workbench.page.settings import PageSettings
from workbench.page.task_work import Work, course_of, done
from workbench.registry.bench import Bench, EndState
from workbench.registry.store import Registry
from workbench.registry.tables import TaskRow
from workbench.registry.values import LostClaim, RegistryAway

TASK_LEASE = timedelta(seconds=30)
QUEUE_POLL = 0.5  # s between two looks at the queue, and at whether the task is still ours
STUBBORN = 10.0  # s after which a computation that does not end is ended with its process
STUBBORN_STATUS = 75


@dataclass
class _Progress:
    """How far the task in hand is, and what goes on."""

    share: float = 0.0
    stage: str = ""

    def advance(self, step: float) -> None:
        self.share = min(self.share + step, 1.0)

    def describe(self, words: str) -> None:
        self.stage = words


class NotOurs(BaseException):
    """The task in hand was cancelled, or another has taken it over."""


def run_worker(settings: PageSettings, report: Report, *, once: bool = False) -> None:
    """Do tasks until SIGTERM or Ctrl-C, which give the one in hand back; once: until none waits.

    Runs in the main thread, as its task is ended by a signal.
    """
    owner = worker_name()
    signal.signal(signal.SIGUSR1, _raise)  # which only a beat sends
    patience = Patience()
    with patience(Registry, settings.where) as registry:
        bench = Bench(registry.database)
        report("worker_ready", owner=owner)
        while True:
            try:
                claim = bench.claim(owner, lease=TASK_LEASE, now=clock())
            except RegistryAway as error:
                report("registry_away", reason=str(error))
                time.sleep(10 * QUEUE_POLL)
                continue
            if claim is not None:
                _one(bench, claim, settings, report)
            elif once:
                return
            else:
                time.sleep(QUEUE_POLL)


def _one(bench: Bench, task: TaskRow, settings: PageSettings, report: Report) -> None:
    """Do one task; its end is written, unless it is no longer ours."""
    report("task_begun", task=task.id, kind=task.kind, upload=task.upload)
    try:
        state, said = _made(bench, task, settings, report)
        Patience()(bench.finish, task, state, said, now=clock())
        report("task_over", task=task.id, state=state, said=said)
    except (NotOurs, LostClaim):
        report("task_lost", task=task.id)
    except BaseException:  # asked to end: another begins it anew
        bench.give_back(task)
        raise


def _made(
    bench: Bench, task: TaskRow, settings: PageSettings, report: Report
) -> tuple[EndState, str]:
    """What came of the task: its last state, and a line."""
    files = Drop(settings.machines, task.upload)
    try:
        work = Work(task.kind, files.log, files.card, files.results(task.id))
        with _beating(bench, task) as state:
            return "done", done(work, course_of(task.kind, state.advance, state.describe))
    except UserError as error:
        return "failed", without_path(str(error), [files.folder / LOG_FOLDER / "log", files.card])
    except (OSError, MemoryError) as error:
        return "failed", f"{type(error).__name__}: {getattr(error, 'strerror', None) or error}"
    except Exception as error:  # a fault of ours in one task must not stop the others
        report("fault_of_ours", task=task.id, traceback=traceback.format_exc())
        return "failed", f"fault of ours: {type(error).__name__}: {error}"


@contextmanager
def _beating(bench: Bench, task: TaskRow) -> Iterator[_Progress]:
    """Within the block the task's progress is written, and NotOurs raised once it is not ours."""
    state = _Progress()

    def beat() -> None:
        bench.progress(task, state.stage, state.share, lease=TASK_LEASE, now=clock())

    def stop(over: threading.Event) -> None:
        os.kill(os.getpid(), signal.SIGUSR1)
        if not over.wait(STUBBORN):
            os._exit(STUBBORN_STATUS)

    with renewed(beat, QUEUE_POLL, stop):
        yield state


def _raise(_number: int, _frame: FrameType | None) -> None:
    raise NotOurs
