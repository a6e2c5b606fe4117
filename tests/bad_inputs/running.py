"""A bad input run through the command line, and what was wrong with the way it ended."""

import os
import resource
import signal
import tempfile
import time
import traceback
from collections.abc import Callable
from multiprocessing import get_context
from multiprocessing.context import ForkServerContext
from pathlib import Path
from typing import NamedTuple

from tests.bad_inputs.cases import Case
from tests.bad_inputs.shop import Shop

MEMORY = 6_000_000_000
"""Bytes of address space beyond which a run is ended: nothing here needs a quarter of that."""

HEAVY = (
    "workbench.cli",
    "design.identified.identify_logs",
    "workbench.steps.trace",
    "tests.bad_inputs.cases",
)


class Ended(NamedTuple):
    """How a case ended: exit status, standard error, seconds; status None: it did not end."""

    status: int | None
    stderr: str
    seconds: float
    left: tuple[str, ...]

    @property
    def faults(self) -> tuple[str, ...]:
        """What a user must not meet."""
        if self.status is None:
            return ("does not end",)
        found = []
        if self.status not in (0, 1, 2):
            found.append(f"exit status {self.status}")
        lines = self.stderr.splitlines()
        if self.status == 1 and lines and lines[-1].startswith("next ("):
            lines.pop()
        if len(lines) > 1:
            found.append("more than one line")
        if "Traceback" in self.stderr:
            found.append("traceback")
        if self.status == 2 and not self.stderr:
            found.append("no word")
        return (*found, *(f"left over: {name}" for name in self.left))


def ended(case: Case, shop: Shop, run: Callable[[list[str]], tuple[int | None, str]]) -> Ended:
    """How the case ended, run in a folder of its own by `run`: arguments to status and stderr."""
    before = Path.cwd()
    with tempfile.TemporaryDirectory() as name:
        os.chdir(name)
        try:
            arguments = case.make(shop, Path(name))
            if "--out" not in arguments and arguments[0] not in ("registry", "reidentify"):
                arguments += ["--out", "out"]
            begun = time.monotonic()
            status, stderr = run(arguments)
            took = time.monotonic() - begun
            left = tuple(str(p.relative_to(name)) for p in Path(name).rglob("*.part"))
            if status == 2 and Path("out").exists():
                left = (*left, "out")
            return Ended(status, stderr, took, left)
        finally:
            os.chdir(before)


def in_process_of_its_own(seconds: float) -> Callable[[list[str]], tuple[int | None, str]]:
    """A `run` for `ended` that forks a process and ends it after so many seconds.

    They are of two processors; a process that waits is ended after six times as many of the clock.
    """
    context = get_context("forkserver")
    context.set_forkserver_preload(list(HEAVY))

    def run(arguments: list[str]) -> tuple[int | None, str]:
        return _run(context, arguments, seconds)

    return run


def _run(
    context: ForkServerContext, arguments: list[str], seconds: float
) -> tuple[int | None, str]:
    with tempfile.TemporaryDirectory() as name:
        said = Path(name) / "stderr"
        process = context.Process(
            target=_child, args=(arguments, str(said), str(Path.cwd()), seconds)
        )
        process.start()
        process.join(6 * seconds)
        if process.is_alive():
            process.kill()
            process.join()
            return None, ""
        if process.exitcode in (-signal.SIGXCPU, -signal.SIGKILL):
            return None, ""
        return process.exitcode, said.read_text("utf-8", "replace") if said.exists() else ""


def _child(arguments: list[str], said: str, folder: str, seconds: float) -> None:
    """The command line with its streams in files, as a shell would start it."""
    os.chdir(folder)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CPU, (int(2 * seconds), int(2 * seconds) + 5))
    for number, path in ((0, os.devnull), (1, os.devnull), (2, said)):
        os.dup2(os.open(path, os.O_RDWR | os.O_CREAT), number)
    from workbench.cli import main

    try:
        status = main(arguments)
    except BaseException:
        traceback.print_exc()
        status = 99
    os._exit(status)
