"""Fleets of light logs for tests, and workers' functions that die or answer at once."""

import hashlib
import os
import signal
import time
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from pathlib import Path

from design.judgement import Candidate
from tests.chain import CARD
from workbench.fleet.values import Item, LogFile, Result

NOW = datetime(2026, 5, 1, tzinfo=UTC)
DEADLY = "deadly"


def clock() -> datetime:
    """A time that stands still."""
    return NOW


def log_of(machine: str, number: int = 1) -> LogFile:
    """A log that need not be there."""
    name = f"{machine}/{number}.parquet"
    return LogFile(machine, name, f"/nowhere/{name}", 100 + number, number)


def result_of(log: LogFile, m: float = 1.0) -> Result:
    """A first model of the log's machine, as far as the store and the registry look."""
    number = {"value": m, "unit": "kg", "sd": 0.1, "low": m - 0.2, "high": m + 0.2}
    model = {"schema": "model/1", "friction": {"m": number}, "log": [{"duration": 2.0}]}
    sha256 = hashlib.sha256(log.name.encode()).hexdigest()
    made = Candidate(model)
    return Result(log, "identified", "a test", sha256, model, made, seconds=0.5, memory=10)


def answer(item: Item) -> Result:
    """A result at once; it tells the active model that it was given."""
    return result_of(item.log) if item.version is None else judged(item)


def judged(item: Item) -> Result:
    """No drift, against the active version."""
    assert item.version is not None
    digest = hashlib.sha256(item.log.name.encode()).hexdigest()
    return Result(item.log, "none", "same", digest, against=item.version.number)


def die_of_some(item: Item) -> Result:
    """Kills its worker where the machine is `DEADLY`."""
    if item.log.machine == DEADLY:
        os.kill(os.getpid(), signal.SIGKILL)
    return answer(item)


def die_once(item: Item) -> Result:
    """Kills the worker that has the log of `DEADLY` first; the file named by the card tells."""
    if item.log.machine == DEADLY:
        mark = Path(item.card)
        if not mark.exists():
            mark.touch()
            os.kill(os.getpid(), signal.SIGKILL)
    return answer(item)


def slow(item: Item) -> Result:
    """A result after a while."""
    time.sleep(0.2)
    return answer(item)


def fault(item: Item) -> Result:
    """What no worker's function should do."""
    raise ZeroDivisionError(item.log.name)


def card_text(duration: float = 8.0) -> str:
    """The card of the simulated machines."""
    return CARD.replace("duration_s = 6.0", f"duration_s = {duration}")


def other_versions() -> dict[str, str]:
    """Versions that are another in every process."""
    return {"servo-workbench": f"9.9+{os.getpid()}"}


def core_of(_number: int) -> tuple[int, set[int]]:
    """The process, and the cores that a thread started by its task may use."""
    time.sleep(0.05)
    with ThreadPoolExecutor(1) as pool:
        return os.getpid(), pool.submit(os.sched_getaffinity, 0).result()
