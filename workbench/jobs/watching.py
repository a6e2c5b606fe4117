"""Pass after pass: by a cron expression, and soon after a log file has appeared or changed."""

import threading
from collections.abc import Callable
from datetime import timedelta
from functools import partial
from itertools import count
from pathlib import Path

from apscheduler.executors.pool import ThreadPoolExecutor
from apscheduler.schedulers.background import BackgroundScheduler
from apscheduler.triggers.cron import CronTrigger
from apscheduler.triggers.date import DateTrigger
from watchfiles import Change, watch

from identification.errors import UserError
from workbench.files import LOGS
from workbench.jobs.passes import Clock, Report
from workbench.jobs.scan import SUFFIXES

SOON = "soon"
PATIENCE = timedelta(hours=1)  # a pass that is late by less is made up for
AGAIN, LONGEST_WAIT = 0.5, 60.0  # s until a watcher of files that died is begun anew


class BadSchedule(UserError):
    """A cron expression that cannot be read."""


def watch_machines(
    root: Path,
    once: Callable[[], bool],
    *,
    cron: str,
    settle: timedelta,
    clock: Clock,
    stop: threading.Event,
    report: Report,
    marker: str | None = None,
) -> None:
    """Passes until `stop` is set, one at a time, the first at once.

    once: one pass; says whether files are still being written, so that it has to come again soon.
    marker: ending of the files beside finished logs. What the watcher of files dies of is
    reported; it is begun anew, and the passes by schedule go on. Raises BadSchedule.
    """
    try:
        trigger = CronTrigger.from_crontab(cron)
    except ValueError as error:
        raise BadSchedule(
            f"--cron {cron!r}: {error}; five fields needed, as in '*/5 * * * *'"
        ) from None
    scheduler = BackgroundScheduler(
        executors={"default": ThreadPoolExecutor(1)},
        job_defaults={"coalesce": True, "max_instances": 1},
    )
    gap = max(settle, timedelta(seconds=0.2))

    def soon() -> None:
        # One that waits already is left: a file that changes all the time must not put it off.
        if scheduler.get_job(SOON) is None:
            scheduler.add_job(
                run, DateTrigger(clock() + gap), id=SOON, misfire_grace_time=None,
                replace_existing=True,
            )  # fmt: skip

    def run() -> None:
        if not stop.is_set() and once():
            soon()

    grace = round(PATIENCE.total_seconds())
    scheduler.add_job(run, trigger, id="cron", misfire_grace_time=grace)
    scheduler.add_job(run, DateTrigger(clock()), id="first", misfire_grace_time=None)
    scheduler.start()
    try:
        _follow_files(root, soon, stop, report, partial(of_log, marker=marker or ""))
    finally:
        stop.set()
        scheduler.shutdown(wait=True)


def _follow_files(
    root: Path,
    soon: Callable[[], None],
    stop: threading.Event,
    report: Report,
    of_machine: Callable[[Change, str], bool],
) -> None:
    """Calls `soon` with each change of a log or card until `stop` is set."""
    for again in count():
        wait = min(AGAIN * 2 ** min(again, 16), LONGEST_WAIT)
        try:
            for _ in watch(root, watch_filter=of_machine, stop_event=stop, raise_interrupt=False):
                soon()
            return  # stopped
        except Exception as error:  # it raises all kinds on names and folders that it dislikes
            said = " ".join(str(error).split()) or type(error).__name__
            report("watcher_failed", reason=said, again_in_s=wait)
        soon()  # for what came meanwhile
        if stop.wait(wait):
            return


def of_log(_change: Change, path: str, marker: str = "") -> bool:
    """Whether a change is one of a log file, of a marker beside one, or of a card."""
    file = Path(path.removesuffix(marker))
    return (file.parent.name == LOGS and file.suffix.lower() in SUFFIXES) or file.suffix == ".toml"
