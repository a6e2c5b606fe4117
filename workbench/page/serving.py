"""The processes of the page: servers that uvicorn watches, and workers that are watched here."""

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import uvicorn

from workbench.page.settings import PageSettings, hand_over
from workbench.registry.database import REGISTRY_VARIABLE
from workbench.registry.store import Registry

if TYPE_CHECKING:
    from workbench.jobs.passes import Report

AGAIN_AFTER = 2.0  # s before a worker that has died is started again
ENDS_WITHIN = 20.0  # s that a worker may take to give its task back
APPLICATION = "workbench.page.app:served"


def serve(settings: PageSettings, report: "Report") -> int:
    """Serve until Ctrl-C or SIGTERM; the exit status. Raises BadRegistry and RegistryAway first."""
    with Registry(settings.where):
        pass  # its layout is brought up to date once, and what is wrong is reported before all else
    settings.machines.mkdir(parents=True, exist_ok=True)
    hand_over(settings)
    shown = f"http://{settings.host}:{settings.port}{settings.prefix}/"
    report("serving", address=shown, reading="open" if settings.open_reading else "by token",
           servers=settings.servers, workers=settings.workers)  # fmt: skip
    with _workers(settings, report):
        uvicorn.run(
            APPLICATION, factory=True, host=settings.host, port=settings.port,
            workers=settings.servers, log_level="warning", access_log=False, server_header=False,
            proxy_headers=True, timeout_graceful_shutdown=5,
        )  # fmt: skip
    return 0


@contextmanager
def _workers(settings: PageSettings, report: "Report") -> Iterator[None]:
    """Within the block the workers run, each started again should it die."""
    over = threading.Event()
    keepers = [
        threading.Thread(target=_restarted, args=(settings, report, over), daemon=True)
        for _ in range(settings.workers)
    ]
    for one in keepers:
        one.start()
    try:
        yield
    finally:
        over.set()
        for one in keepers:
            one.join()


def _restarted(settings: PageSettings, report: "Report", over: threading.Event) -> None:
    """One worker after the other; the registry's address is not on its command line."""
    command = [sys.executable, "-m", "workbench", "work", "--machines", str(settings.machines)]
    environment = {**os.environ, REGISTRY_VARIABLE: settings.where}
    while not over.is_set():
        worker = subprocess.Popen(command, env=environment)
        while worker.poll() is None and not over.wait(0.2):
            pass
        if over.is_set():
            worker.send_signal(signal.SIGTERM)
            try:
                worker.wait(ENDS_WITHIN)
            except subprocess.TimeoutExpired:
                worker.kill()
                worker.wait()
            return
        report("worker_died", status=worker.returncode)
        over.wait(AGAIN_AFTER)
