"""The worker that `reidentify` and `watch` make of their options: passes, alarms and metrics."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from design.challenge import Terms
from workbench.cards.own_effects import library
from workbench.jobs.alarms import Delivery, Webhook, send_alarms
from workbench.jobs.events import reporter
from workbench.jobs.judge import Chain
from workbench.jobs.metrics import MachineFigures, write_metrics
from workbench.jobs.options import JobOptions, clock, worker_name
from workbench.jobs.passes import Pass, PassReport, Patience, Report, shared_clock
from workbench.jobs.scan import machine_folders
from workbench.registry.database import location
from workbench.registry.outbox import Outbox
from workbench.registry.store import Registry


@dataclass(frozen=True)
class Worker:
    """One worker: `once` is a pass with its alarms and metrics."""

    options: JobOptions
    registry: Registry
    webhook: Webhook | None
    report: Report
    owner: str
    figures: MachineFigures
    stop: Callable[[], bool]

    def once(self) -> tuple[PassReport, Delivery | None]:
        """One pass, and what became of the alarms, None without a webhook; raises BadRoot,
        RegistryAway, and OSError where metrics cannot be written."""
        given, database = self.options, self.registry.database
        terms = Terms(held_out=given.margin)
        judge = Chain(terms=terms, seed=given.seed, library=library(given.effects))
        shared = Patience(given.patience)(shared_clock, database, clock)
        work = Pass(self.registry, judge, given, self.owner, shared, self.report, self.stop, clock)
        done = work.run()
        alarms = None
        if self.webhook is not None:
            alarms = send_alarms(Outbox(database), self.webhook, clock=shared,
                                 report=self.report, stop=self.stop)  # fmt: skip
        self.figures.passed(clock(), len(done.failed))
        if given.metrics is not None:
            write_metrics(given.metrics, self.figures)
        return done, alarms


@contextmanager
def worker(options: JobOptions, stop: Callable[[], bool] = lambda: False) -> Iterator[Worker]:
    """A worker on the registry of the options; raises BadRoot, BadRegistry, RegistryAway."""
    machine_folders(options.root)
    webhook = None if options.webhook is None else Webhook(options.webhook)
    name = worker_name()
    with Patience(options.patience)(Registry, location(options.where)) as registry:
        report = reporter(sys.stderr, name)
        yield Worker(options, registry, webhook, report, name, MachineFigures(registry), stop)
