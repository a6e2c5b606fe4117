"""One pass over the machines that have new logs; safe to run at any time, in any number.

A pass looks for complete files, notes their fingerprints, and claims one machine after the other;
the claim is kept alive while a worker is busy. Whatever it dies of, a log either has its result,
with all that belongs to it, or waits for the next pass.
"""

import errno
import threading
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from tenacity import Retrying, retry_if_exception_type, stop_after_delay, wait_random_exponential

from design.judgement import Judgement
from identification.errors import BadCard, BadLog, BadModel, UserError
from workbench.jobs.options import JobOptions, is_gone
from workbench.jobs.scan import BadRoot, MachineFolder, Scan, machine_folders, scan, unchanged
from workbench.registry.database import Database
from workbench.registry.queue import Queue
from workbench.registry.store import Registry
from workbench.registry.values import Claim, LogOutcome, LostClaim, RegistryAway, SeenLog, Version

P = ParamSpec("P")
T = TypeVar("T")
Clock = Callable[[], datetime]
SHARE = 3.0  # renewals in one lease
LONGEST_PAUSE = 5.0  # s between two tries


@dataclass(frozen=True)
class Patience:
    """Tries again for `seconds` what fails because the database is away; then raises it."""

    seconds: float = 60.0

    def __call__(self, call: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
        """What the call gives; raises RegistryAway once patience has ended."""
        again = Retrying(
            retry=retry_if_exception_type(RegistryAway),
            stop=stop_after_delay(self.seconds),
            wait=wait_random_exponential(multiplier=0.1, max=LONGEST_PAUSE),
            reraise=True,
        )
        return again(call, *args, **kwargs)


def shared_clock(database: Database, here: Clock) -> Clock:
    """The database's clock, which all its workers share, read once and carried on by `here`.

    Raises RegistryAway.
    """
    ahead = database.now(here()) - here()
    return lambda: here() + ahead


@contextmanager
def renewed(
    renew: Callable[[], None], every: float, lost: Callable[[threading.Event], None] | None = None
) -> Iterator[None]:
    """Renews a claim from a thread, every so many seconds, until the block ends.

    What goes wrong there is not raised here: a result is recorded only where the claim holds.
    lost: called in the thread where the claim is lost, with the event of the block's end.
    """
    over = threading.Event()

    def beat() -> None:
        while not over.wait(every):
            try:
                renew()
            except RegistryAway:
                continue  # the next renewal comes before the lease ends, or the claim is lost
            except LostClaim:
                if lost is not None:
                    lost(over)
                return

    thread = threading.Thread(target=beat, name="lease", daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


MOST_ATTEMPTS = 20  # times that a log is begun without a result, after which it is excluded
OUT_OF_RESOURCES = (errno.ENOSPC, errno.EDQUOT, errno.EIO, errno.ENOMEM, errno.EMFILE, errno.ENFILE)


@dataclass(frozen=True)
class Task:
    """One log of one machine to be tested: where it lies, and the active model and design.

    model, design: documents, None where there is none. previous: what was found of the log before
    under the same active version (`Judgement.evidence`), for tests that look at several logs.
    """

    machine: str
    card: Path
    path: Path
    log: SeenLog
    version: Version | None
    model: Mapping[str, Any] | None
    design: Mapping[str, Any] | None
    previous: Mapping[str, Any] | None


# What a worker makes of a log; nothing is written. Raises BadLog where the file cannot be tested:
# it is excluded. BadCard and BadModel say that the machine is to be looked after: its logs wait.
Judge = Callable[[Task], Judgement]


@dataclass
class PassReport:
    """What a pass has done so far.

    busy: machines in another worker's hands, held: in whose, and until when unless it goes on;
    failed: machine and why it could not be handled; growing: files that are still being written;
    without_model: machines whose logs wait for one; no_logs: text files without a line of numbers,
    which are left out.
    """

    machines: int
    outcomes: tuple[LogOutcome, ...] = ()
    busy: tuple[str, ...] = ()
    held: dict[str, str] = field(default_factory=dict)
    failed: dict[str, str] = field(default_factory=dict)
    growing: int = 0
    without_model: tuple[str, ...] = ()
    no_logs: tuple[str, ...] = ()


Report = Callable[..., None]  # event, then what belongs to it by name


@dataclass(frozen=True)
class Pass:
    """One worker's way through the machines of a folder; owner: its name.

    clock: the one that all workers share, for claims and records; files: the one by which the ages
    of files are known, by default the same. attempts: at most, of a log without a result.
    """

    registry: Registry
    judge: Judge
    options: JobOptions
    owner: str
    clock: Clock
    report: Report
    stop: Callable[[], bool] = lambda: False
    files: Clock | None = None
    attempts: int = MOST_ATTEMPTS

    @property
    def queue(self) -> Queue:
        return Queue(self.registry.database)

    @property
    def patience(self) -> Patience:
        return Patience(self.options.patience)

    @property
    def lease(self) -> timedelta:
        return timedelta(seconds=self.options.lease)

    def run(self) -> PassReport:
        """What the pass did; raises BadRoot, and RegistryAway once its patience has ended."""
        folders = machine_folders(self.options.root)
        done = PassReport(len(folders))
        for folder in folders:
            if self.stop():
                break
            try:
                self._machine(folder, done)
            except RegistryAway:
                raise
            except (UserError, OSError, MemoryError) as error:
                line = " ".join(str(error).split()) or type(error).__name__
                self.report("machine_failed", machine=folder.name, reason=line)
                done.failed[folder.name] = line
            except Exception as error:  # a fault of ours on one machine must not stop the others
                shown = traceback.format_exc()
                self.report("fault_of_ours", machine=folder.name, traceback=shown)
                line = f"fault of ours: {type(error).__name__}: {' '.join(str(error).split())}"
                done.failed[folder.name] = line
        return done

    def _machine(self, folder: MachineFolder, done: PassReport) -> None:
        name, given, retry = folder.name, self.options, self.patience
        if folder.card.parent.name != name:
            raise BadRoot("the folder's name is not UTF-8; rename the folder")
        known = retry(self.queue.known, name)
        settle, now = timedelta(seconds=given.settle), (self.files or self.clock)()
        found = scan(folder, known, settle=settle, now=now, marker=given.marker)
        done.growing += found.growing
        done.no_logs += tuple(f"{name}/{file}" for file in found.no_logs)
        for file in found.later:
            self.report("log_from_the_future", machine=name, file=file)
        seen = set(known.values())
        logs = [log for _, log in found.complete.values() if log.sha256 not in seen]
        new = retry(self.queue.announce, name, logs, now=self.clock())
        if new:
            self.report("logs_found", machine=name, count=new)
        if not any(self._ready(log, found) for log, _ in retry(self.queue.waiting, name)):
            return
        if retry(self.registry.active_version, name) is None and not given.first:
            self.report("no_model_in_force", machine=name)
            done.without_model += (name,)
            return
        claim = retry(
            self.queue.claim, name, owner=self.owner, lease=self.lease, now=self.clock(),
            gone=is_gone,
        )  # fmt: skip
        if claim is None:
            done.busy += (name,)
            done.held[name] = retry(self.queue.holder, name) or "another worker has it"
            return

        def renew() -> None:
            self.queue.renew(claim, lease=self.lease, now=self.clock())

        try:
            with renewed(renew, given.lease / SHARE):
                for log, begun in retry(self.queue.waiting, name):  # again, now that it is ours
                    if self.stop():
                        break
                    if self._ready(log, found):
                        done.outcomes += self._log(folder, found, claim, log, begun)
        except LostClaim as error:
            self.report("claim_lost", machine=name, reason=str(error))
            done.busy += (name,)
            done.held[name] = "another worker has taken it over"
        except RegistryAway:
            raise  # no use to ask it to release: the lease ends by itself
        except BaseException:
            self.queue.release(claim)
            raise
        else:
            retry(self.queue.release, claim)

    def _ready(self, log: SeenLog, found: Scan) -> bool:
        """Whether a waiting log can be tested now: it is there, or something else in its place."""
        return log.sha256 in found.complete or _replaced(log, found)

    def _log(
        self, folder: MachineFolder, found: Scan, claim: Claim, log: SeenLog, begun: int
    ) -> tuple[LogOutcome, ...]:
        """The log's result; none where its file has changed in the meantime."""
        retry = self.patience
        if _replaced(log, found):
            said = "changed before it was tested; its present content counts"
            judgement = Judgement("set_aside", f"{log.file}: {said}")
        elif begun >= self.attempts:
            said = f"begun {begun} times, and no worker has come to its end"
            judgement = Judgement("set_aside", f"{log.file}: {said}")
        else:
            path, here = found.complete[log.sha256]
            retry(self.queue.begin, claim, log, now=self.clock())
            self.report("log_begun", machine=folder.name, file=log.file, sha256=log.sha256)
            judgement = self._judged(self._task(folder, path, here))
            if not unchanged(path, here):
                return ()
        outcome = retry(
            self.queue.finish, claim, log, judgement,
            by=self.owner, now=self.clock(), order=self.options.order,
        )  # fmt: skip
        self.report(
            "log_judged", machine=folder.name, file=log.file, sha256=log.sha256,
            verdict=outcome.verdict, reason=outcome.reason,
        )  # fmt: skip
        return (outcome,)

    def _judged(self, task: Task) -> Judgement:
        """The judgement; "set_aside" for a bad log, "not_judged" for one with too little
        information."""
        file = task.log.file
        try:
            return self.judge(task)
        except (BadCard, BadModel, RegistryAway, LostClaim, MemoryError):
            raise
        except BadLog as error:
            return Judgement("set_aside", str(error))
        except UserError as error:
            return Judgement("not_judged", str(error))
        except OSError as error:
            if error.errno in OUT_OF_RESOURCES:
                raise
            return Judgement("set_aside", f"{file}: {error.strerror or error}")
        except Exception as error:  # a fault of ours on one log must not stop the others
            shown = traceback.format_exc()
            self.report("fault_of_ours", machine=task.machine, file=file, traceback=shown)
            return Judgement("set_aside", f"{file}: fault of ours: {type(error).__name__}: {error}")

    def _task(self, folder: MachineFolder, path: Path, log: SeenLog) -> Task:
        retry, registry, queue = self.patience, self.registry, self.queue
        version = retry(registry.active_version, folder.name)
        documents = {} if version is None else retry(registry.documents, version)
        # What was found of the machine as it is now says nothing of a log from before.
        newer = retry(queue.newer_behind, folder.name, log, self.options.order)
        after = None if version is None or newer else retry(queue.last_evidence, version)
        model, design = documents.get("model"), documents.get("design")
        return Task(folder.name, folder.card, path, log, version, model, design, after)


def _replaced(log: SeenLog, found: Scan) -> bool:
    """Whether a complete file of the same name holds something else now."""
    if log.sha256 in found.complete:
        return False
    return any(here.file == log.file for _, here in found.complete.values())
