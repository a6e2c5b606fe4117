"""A fleet's results in the registry: each log once, by its fingerprint, whoever else writes."""

from dataclasses import dataclass, field
from datetime import timedelta
from pathlib import PurePosixPath
from typing import Protocol

from workbench.fleet.values import Item, LogFile, Result
from workbench.jobs.lease import Clock, Patience
from workbench.registry.errors import LostClaim
from workbench.registry.queue import Queue
from workbench.registry.store import Registry
from workbench.registry.values import SeenLog

LEASE = timedelta(minutes=2)


class Recorder(Protocol):
    """Where results are recorded beside Parquet, and the active version on a machine."""

    def item(self, url: str, log: LogFile, card: str, seed: int) -> Item:
        """The log as a worker takes it."""
        ...

    def record(self, result: Result) -> bool:
        """Whether the result is recorded, by this call or before; False: a later run has to."""
        ...


class NoRegistry:
    """A recorder that records nothing: Parquet alone."""

    def item(self, url: str, log: LogFile, card: str, seed: int) -> Item:
        """The log as a worker takes it, without an active model."""
        return Item(url, log, card, seed)

    def record(self, result: Result) -> bool:
        """True: there is nothing to record."""
        return True


@dataclass(frozen=True)
class InRegistry:
    """A recorder into the registry; raises RegistryAway once its patience has ended.

    A machine is claimed only while a result is recorded, so that a run that is killed leaves none
    in its hands.
    """

    registry: Registry
    owner: str
    clock: Clock
    patience: Patience = field(default_factory=Patience)

    def item(self, url: str, log: LogFile, card: str, seed: int) -> Item:
        """The log as a worker takes it, with the active model and design of its machine."""
        retry, registry = self.patience, self.registry
        version = retry(registry.active_version, log.machine)
        if version is None:
            return Item(url, log, card, seed)
        documents = retry(registry.documents, version)
        previous = retry(Queue(registry.database).last_evidence, version)
        return Item(
            url, log, card, seed, version, documents["model"], documents["design"], previous
        )

    def record(self, result: Result) -> bool:
        """Whether the registry holds a result of this log; the first one counts.

        False where another worker has the machine in hand, or has changed the active version there
        since the log was tested.
        """
        if not result.sha256:
            return True  # nothing was read, so there is no fingerprint to record it under
        retry, queue, machine = self.patience, Queue(self.registry.database), result.log.machine
        log = result.log
        seen = SeenLog(result.sha256, PurePosixPath(log.name).name, log.size, log.mtime_ns)
        retry(queue.announce, machine, [seen], now=self.clock())
        if not self._waits(queue, machine, seen):
            return True
        claim = retry(queue.claim, machine, owner=self.owner, lease=LEASE, now=self.clock())
        if claim is None:
            return False
        try:
            if not self._waits(queue, machine, seen):
                return True
            version = retry(self.registry.active_version, machine)
            if (None if version is None else version.number) != result.against:
                return False
            retry(queue.finish, claim, seen, result.judgement(), by=self.owner, now=self.clock())
        except LostClaim:
            return False
        finally:
            retry(queue.release, claim)
        return True

    def _waits(self, queue: Queue, machine: str, log: SeenLog) -> bool:
        waiting = self.patience(queue.waiting, machine)
        return any(one.sha256 == log.sha256 for one, _ in waiting)
