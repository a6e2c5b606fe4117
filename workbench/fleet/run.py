"""A run over a fleet: few logs in the cluster's hands at a time, results recorded as they come.

In the registry each log counts once, by its fingerprint, whoever else writes.
"""

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from datetime import timedelta
from pathlib import PurePosixPath
from typing import Any

from workbench.addresses import shown
from workbench.fleet.cluster import Cluster, Work
from workbench.fleet.finding import card_text
from workbench.fleet.store import ResultStore
from workbench.fleet.values import GOOD, BadCluster, BadLogs, Item, LogFile, Result
from workbench.fleet.work import work as default_work
from workbench.jobs.passes import Clock, Patience
from workbench.registry.queue import Queue
from workbench.registry.store import Registry
from workbench.registry.values import LostClaim, SeenLog

LEASE = timedelta(minutes=2)
LONGEST_ALONE = timedelta(minutes=2)  # for which the cluster may be without any worker


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

    @property
    def queue(self) -> Queue:
        return Queue(self.registry.database)

    def item(self, url: str, log: LogFile, card: str, seed: int) -> Item:
        """The log as a worker takes it, with the active model and design of its machine."""
        retry = self.patience
        version = retry(self.registry.active_version, log.machine)
        if version is None:
            return Item(url, log, card, seed)
        own = retry(self.registry.documents, version)
        previous = retry(self.queue.last_evidence, version)
        return Item(url, log, card, seed, version, own["model"], own["design"], previous)

    def record(self, result: Result) -> bool:
        """Whether the registry holds a result of this log; the first one counts.

        False where another worker has the machine in hand, or has changed the active version there
        since the log was tested.
        """
        if not result.sha256:
            return True  # nothing was read, so there is no fingerprint to record it under
        retry, queue, log = self.patience, self.queue, result.log
        machine = log.machine
        seen = SeenLog(result.sha256, PurePosixPath(log.name).name, log.size, log.mtime_ns)
        retry(queue.announce, machine, [seen], now=self.clock())
        if not self._waits(machine, seen):
            return True
        claim = retry(queue.claim, machine, owner=self.owner, lease=LEASE, now=self.clock())
        if claim is None:
            return False
        try:
            if not self._waits(machine, seen):
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

    def _waits(self, machine: str, log: SeenLog) -> bool:
        waiting = self.patience(self.queue.waiting, machine)
        return any(one.sha256 == log.sha256 for one, _ in waiting)


FLEET_POLL = 1.0  # s between checks of the cluster
CARDS_CHECKED = 20  # logs whose card is searched before a run begins


@dataclass
class Report:
    """What a run has done so far: logs found, done by an earlier run, and results by verdict.

    bad: machine, log and reason of the results that somebody has to look at, the first of them;
    later: logs left to a later run, since the machine was in another's hands. seconds: wall time;
    busy: processor seconds of the workers; memory: largest of a worker [bytes].
    """

    logs: int
    before: int
    verdicts: dict[str, int] = field(default_factory=dict)
    bad: tuple[Result, ...] = ()
    later: int = 0
    seconds: float = 0.0
    busy: float = 0.0
    memory: int = 0


@dataclass(frozen=True)
class FleetRun:
    """A run over the logs of a fleet.

    recorder: None for Parquet alone; url of the logs; card: text of the one for all, None: one a
    machine beside its logs.
    """

    cluster: Cluster
    store: ResultStore
    recorder: InRegistry | None
    url: str
    clock: Clock
    card: str | None = None
    seed: int = 0
    advance: Callable[[float], None] = lambda _step: None
    work: Work = default_work
    listed: int = 1000

    def __call__(self, logs: Sequence[LogFile]) -> Report:
        """What the run did; raises BadLogs, BadCluster, RegistryAway, with all results kept."""
        begin = self.clock()
        for result in self.store.journalled():
            self._record(result)
        todo = [log for log in logs if log.key not in self.store.done]
        done = Report(len(logs), len(logs) - len(todo))
        self.advance(done.before)
        if self.card is None:
            self._refuse_cardless(todo)
        try:
            for result in self._results(todo):
                self._take(result, done)
                self.store.tick(now=self.clock())
        finally:
            self.store.flush()
        done.seconds = (self.clock() - begin).total_seconds()
        return done

    def _take(self, result: Result, done: Report) -> None:
        """Record a new result, and count it."""
        self.advance(1.0)
        done.busy += result.seconds
        done.memory = max(done.memory, result.memory)
        if result.verdict != "waits":
            self.store.note(result)
            if not self._record(result):
                done.later += 1
                return
        done.verdicts[result.verdict] = done.verdicts.get(result.verdict, 0) + 1
        if result.verdict not in GOOD and len(done.bad) < self.listed:
            done.bad += (replace(result, model=None, made=None, rival=None, evidence={}),)

    def _record(self, result: Result) -> bool:
        """The result into the registry and then into Parquet; False: left to a later run."""
        if self.recorder is not None and not self.recorder.record(result):
            return False
        self.store.add(result, now=self.clock())
        return True

    def _results(self, logs: Sequence[LogFile]) -> Iterator[Result]:
        """Results as they come; a machine's logs one after the other, as each may change what the
        next is tested against."""
        machines: dict[str, deque[LogFile]] = {}
        for log in logs:
            machines.setdefault(log.machine, deque()).append(log)
        ready = deque(machines)
        hands: dict[Any, LogFile] = {}
        seen = self.clock()
        while ready or hands:
            now, limit = self.clock(), self.cluster.limit()
            seen = now if limit else seen
            self._refuse_empty(now - seen)
            while ready and len(hands) < limit:
                log = machines[ready.popleft()].popleft()
                given = self._given(log)
                if isinstance(given, Result):
                    yield given
                    ready.extend([log.machine] if machines[log.machine] else [])
                else:
                    hands[given] = log
            for future in self.cluster.wait(list(hands), FLEET_POLL) if hands else ():
                found = self.cluster.result(future)
                if found is None:
                    continue
                log = hands.pop(future)
                future.release()
                if isinstance(found, str):
                    found = Result(log, "failed", f"{log.name}: {found}")
                yield found
                ready.extend([log.machine] if machines[log.machine] else [])

    def _given(self, log: LogFile) -> Any:
        """The future of a log handed over; a result where it cannot be."""
        try:
            card = self.card or card_text(self.url, log)
        except BadLogs as error:
            return Result(log, "waits", str(error))
        if card is None:
            return Result(log, "waits", f"{log.name}: no card.toml beside or above it")
        if self.recorder is None:
            return self.cluster.submit(self.work, Item(self.url, log, card, self.seed))
        item = self.recorder.item(self.url, log, card, self.seed)
        return self.cluster.submit(self.work, item)

    def _refuse_cardless(self, logs: Sequence[LogFile]) -> None:
        checked = logs[:CARDS_CHECKED]
        if checked and not any(card_text(self.url, log) for log in checked):
            raise BadLogs(
                f"{shown(self.url)}: no card.toml beside or above {checked[0].name!r} and the logs"
                " after it; put one there, or give --card for all"
            )

    def _refuse_empty(self, time: timedelta) -> None:
        if time > LONGEST_ALONE:
            raise BadCluster(
                f"the cluster has had no worker for {time.total_seconds():.0f} s; results so far"
                " are kept, start workers and run again"
            )
