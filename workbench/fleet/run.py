"""A run over a fleet: few logs in the cluster's hands at a time, results recorded as they come.

In the registry each log counts once, by its fingerprint, whoever else writes.
"""

from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from datetime import timedelta
from pathlib import PurePosixPath
from typing import Any, Protocol

from workbench.addresses import shown
from workbench.fleet.cluster import Cluster, Work
from workbench.fleet.finding import card_text
from workbench.fleet.store import ResultStore
from workbench.fleet.values import GOOD, BadCluster, BadLogs, Item, LogFile, Result
from workbench.fleet.work import work as default_work
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


FLEET_POLL = 1.0  # s between looks at the cluster
CARDS_CHECKED = 20  # logs whose card is searched before a run begins


@dataclass(frozen=True)
class FleetSettings:
    """url of the logs; card: text of the one for all, None: one a machine beside its logs.

    alone: how long the cluster may be without any worker.
    """

    url: str
    card: str | None = None
    seed: int = 0
    alone: timedelta = timedelta(minutes=2)


@dataclass(frozen=True)
class Report:
    """What a run did: logs found, done by an earlier run, and results by verdict.

    bad: machine, log and reason of the results that somebody has to look at, the first of them;
    later: logs left to a later run, since the machine was in another's hands. seconds: wall time;
    busy: processor seconds of the workers; memory: largest of a worker [bytes].
    """

    logs: int
    before: int
    verdicts: dict[str, int]
    bad: tuple[Result, ...]
    later: int
    seconds: float
    busy: float
    memory: int


class FleetRun:
    """One run over the logs of a fleet."""

    def __init__(
        self,
        cluster: Cluster,
        store: ResultStore,
        recorder: Recorder,
        settings: FleetSettings,
        clock: Clock,
        *,
        advance: Callable[[float], None] = lambda _step: None,
        work: Work = default_work,
        listed: int = 1000,
    ) -> None:
        self._cluster = cluster
        self._store = store
        self._recorder = recorder
        self._settings = settings
        self._clock = clock
        self._advance = advance
        self._work = work
        self._listed = listed
        self._verdicts: Counter[str] = Counter()
        self._bad: list[Result] = []
        self._later = 0
        self._busy = 0.0
        self._memory = 0

    def __call__(self, logs: Sequence[LogFile]) -> Report:
        """What the run did; raises BadLogs, BadCluster, RegistryAway, with all results kept."""
        begin = self._clock()
        for result in self._store.journalled():
            self._record(result)
        todo = [log for log in logs if log.key not in self._store.done]
        before = len(logs) - len(todo)
        self._advance(before)
        if self._settings.card is None:
            self._refuse_cardless(todo)
        try:
            for result in self._results(todo):
                self._take(result)
                self._store.tick(now=self._clock())
        finally:
            self._store.flush()
        return Report(
            logs=len(logs),
            before=before,
            verdicts=dict(self._verdicts),
            bad=tuple(self._bad),
            later=self._later,
            seconds=(self._clock() - begin).total_seconds(),
            busy=self._busy,
            memory=self._memory,
        )

    def _take(self, result: Result) -> None:
        """Record a new result, and count it."""
        self._advance(1.0)
        self._busy += result.seconds
        self._memory = max(self._memory, result.memory)
        if result.verdict != "waits":
            self._store.note(result)
            if not self._record(result):
                self._later += 1
                return
        self._verdicts[result.verdict] += 1
        if result.verdict not in GOOD and len(self._bad) < self._listed:
            self._bad.append(replace(result, model=None, made=None, rival=None, evidence={}))

    def _record(self, result: Result) -> bool:
        """The result into the registry and then into Parquet; False: left to a later run."""
        if not self._recorder.record(result):
            return False
        self._store.add(result, now=self._clock())
        return True

    def _results(self, logs: Sequence[LogFile]) -> Iterator[Result]:
        """Results as they come; a machine's logs one after the other, as each may change what the
        next is tested against."""
        machines: dict[str, deque[LogFile]] = {}
        for log in logs:
            machines.setdefault(log.machine, deque()).append(log)
        ready = deque(machines)
        hands: dict[Any, LogFile] = {}
        seen = self._clock()
        while ready or hands:
            now = self._clock()
            limit = self._cluster.limit()
            if limit:
                seen = now
            self._refuse_empty(now - seen)
            while ready and len(hands) < limit:
                log = machines[ready.popleft()].popleft()
                given = self._given(log)
                if isinstance(given, Result):
                    yield given
                    self._next(log, machines, ready)
                else:
                    hands[given] = log
            for future in self._cluster.wait(list(hands), FLEET_POLL) if hands else ():
                found = self._cluster.result(future)
                if found is None:
                    continue
                log = hands.pop(future)
                future.release()
                if isinstance(found, str):
                    found = Result(log, "failed", f"{log.name}: {found}")
                yield found
                self._next(log, machines, ready)

    def _next(self, log: LogFile, machines: dict[str, deque[LogFile]], ready: deque[str]) -> None:
        """The next log of the machine has its turn once this one's result is recorded."""
        if machines[log.machine]:
            ready.append(log.machine)

    def _given(self, log: LogFile) -> Any:
        """The future of a log handed over; a result where it cannot be."""
        settings = self._settings
        try:
            card = settings.card or card_text(settings.url, log)
        except BadLogs as error:
            return Result(log, "waits", str(error))
        if card is None:
            return Result(log, "waits", f"{log.name}: no card.toml beside or above it")
        item = self._recorder.item(settings.url, log, card, settings.seed)
        return self._cluster.submit(self._work, item)

    def _refuse_cardless(self, logs: Sequence[LogFile]) -> None:
        url = self._settings.url
        looked = logs[:CARDS_CHECKED]
        if looked and not any(card_text(url, log) for log in looked):
            raise BadLogs(
                f"{shown(url)}: no card.toml beside or above {looked[0].name!r} and the logs after"
                " it; put one there, or give --card for all"
            )

    def _refuse_empty(self, time: timedelta) -> None:
        if time > self._settings.alone:
            raise BadCluster(
                f"the cluster has had no worker for {time.total_seconds():.0f} s; results so far"
                " are kept, start workers and run again"
            )


def per_core(report: Report) -> float | None:
    """Processor seconds of one log; None where nothing was done."""
    done = sum(report.verdicts.values())
    return report.busy / done if done else None
