"""Options that `reidentify` and `watch` share, and the worker that they make of them."""

import os
import secrets
import socket
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from workbench import options
from workbench.signature import argument, option

if TYPE_CHECKING:
    from workbench.jobs.alarms import Delivery, Webhook
    from workbench.jobs.lease import Clock
    from workbench.jobs.metrics import MachineFigures
    from workbench.jobs.passes import PassReport, Report
    from workbench.registry.store import Registry


def _suffix(ctx: click.Context, param: click.Parameter, value: str | None) -> str | None:
    if value is not None and (not value.strip() or "/" in value or "\0" in value):
        raise click.UsageError(
            f"--marker {value!r}: the end of a file's name needed, as .done.", ctx
        )
    return value


@dataclass(frozen=True)
class JobOptions:
    """What the command line says, each field as its option; times in s, margin relative."""

    root: Path = argument()
    where: str | None = options.REGISTRY_OPTION
    first: bool = option("Give a machine without a model its first from its first log.")
    settle: float = option(
        "Take a file that has not changed for this long.",
        type=options.SECONDS,
        default=10.0,
        metavar="S",
    )
    marker: str | None = option(
        "Take a file once one named <file>SUFFIX lies beside it, as .done; for writers that pause"
        " for longer than --settle.",
        metavar="SUFFIX", callback=_suffix,
    )  # fmt: skip
    order: Literal["time-or-name", "time"] = option(
        "What makes a log older than another, so that its model does not become active: the"
        " file's time, or also the numbers in its name.",
        default="time-or-name",
    )
    lease: float = option(
        "Take a silent worker's machine over after this long.",
        type=options.SECONDS_ABOVE_0, default=120.0, metavar="S",
    )  # fmt: skip
    patience: float = option(
        "Wait this long for a database that is away.",
        type=options.SECONDS,
        default=60.0,
        metavar="S",
    )
    margin: float = option(
        "Relative fall of a held-out error that wins.",
        type=options.Finite(0, 1, max_open=True), default=0.1,
    )  # fmt: skip
    webhook: str | None = option("Send alarms there, as JSON by POST.", metavar="URL")
    metrics: Path | None = option("Write Prometheus metrics there after each pass.", metavar="FILE")
    seed: int = options.SEED_OPTION
    effects: tuple[Path, ...] = options.EFFECTS_OPTION


@dataclass(frozen=True)
class Done:
    """What a pass did, and what became of the alarms; None without a webhook."""

    judged: "PassReport"
    alarms: "Delivery | None"


@dataclass(frozen=True)
class Worker:
    """One worker: `once` is a pass with its alarms and metrics."""

    options: JobOptions
    registry: "Registry"
    webhook: "Webhook | None"
    report: "Report"
    owner: str
    figures: "MachineFigures"
    stop: Callable[[], bool]

    def once(self) -> Done:
        """One pass; raises BadRoot, RegistryAway, and OSError where metrics cannot be written."""
        from workbench.cards.own_effects import library
        from workbench.jobs.challenge import Terms
        from workbench.jobs.judge import Chain
        from workbench.jobs.lease import Patience, shared_clock
        from workbench.jobs.metrics import write_metrics
        from workbench.jobs.passes import Pass, PassSettings

        given = self.options
        settings = PassSettings(
            owner=self.owner,
            lease=timedelta(seconds=given.lease),
            settle=timedelta(seconds=given.settle),
            first=given.first,
            order=given.order,
            marker=given.marker,
            patience=Patience(given.patience),
        )
        terms = Terms(held_out=given.margin)
        judge = Chain(terms=terms, seed=given.seed, library=library(given.effects))
        shared = settings.patience(shared_clock, self.registry.database, clock)
        work = Pass(self.registry, judge, settings, shared, self.report, self.stop, clock)
        done = work.run(given.root)
        alarms = self._alarms(shared)
        self.figures.passed(clock(), len(done.failed))
        if given.metrics is not None:
            write_metrics(given.metrics, self.figures)
        return Done(done, alarms)

    def _alarms(self, shared: "Clock") -> "Delivery | None":
        from workbench.jobs.alarms import send_alarms
        from workbench.registry.outbox import Outbox

        if self.webhook is None:
            return None
        outbox = Outbox(self.registry.database)
        return send_alarms(outbox, self.webhook, clock=shared, report=self.report, stop=self.stop)


@contextmanager
def worker(options: JobOptions, stop: Callable[[], bool] = lambda: False) -> Iterator[Worker]:
    """A worker on the registry of the options; raises BadRoot, BadRegistry, RegistryAway."""
    from workbench.jobs.alarms import Webhook
    from workbench.jobs.events import reporter
    from workbench.jobs.lease import Patience
    from workbench.jobs.metrics import MachineFigures
    from workbench.jobs.scan import machine_folders
    from workbench.registry.database import location
    from workbench.registry.store import Registry

    machine_folders(options.root)
    webhook = None if options.webhook is None else Webhook(options.webhook)
    name = worker_name()
    with Patience(options.patience)(Registry, location(options.where)) as registry:
        report = reporter(sys.stderr, name)
        yield Worker(options, registry, webhook, report, name, MachineFigures(registry), stop)


def worker_name() -> str:
    """This process by computer and number, as claims and events name it."""
    return f"{socket.gethostname()}:{os.getpid()}:{secrets.token_hex(2)}"


def clock() -> datetime:
    """The time now, in UTC."""
    return datetime.now(UTC)
