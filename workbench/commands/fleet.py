"""`workbench fleet`: the logs of many machines on a Dask cluster."""

import os
import secrets
import socket
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from workbench.ending import StatusCommand, Step, step
from workbench.options import POSITIVE, registry_option
from workbench.output import dumps, emit, progress, verbose_option

if TYPE_CHECKING:
    from workbench.fleet.recording import Recorder
    from workbench.fleet.run import Report
    from workbench.screen import Screen

Command = TypeVar("Command", bound=Callable[..., Any])
MOST_BAD = 20  # results to look at on one screen; --verbose and --json have the first 1000


def fleet_options(command: Command) -> Command:
    """The options of the command, by the names of its arguments."""
    options = (
        click.option("--card", help="Card of all machines: a path, or the name of a shipped one.  "
                     "[default: the nearest card.toml at or above each log]"),
        click.option("--cluster", "address", metavar="ADDRESS", help="Scheduler of a Dask cluster, "
                     "as tcp://host:8786.  [default: processes of this computer]"),
        click.option("--workers", type=click.IntRange(min=1), metavar="N",
                     help="Processes of this computer.  [default: one a core]"),
        click.option("--attempts", type=click.IntRange(min=1), default=3, show_default=True,
                     help="Workers that may die of a log before it has failed; a cluster at an "
                     "ADDRESS has a setting of its own."),
        click.option("--timeout", type=POSITIVE, default=30.0, show_default=True, metavar="S",
                     help="Wait this long for a cluster's answer."),
        registry_option,
        click.option("--no-registry", is_flag=True, help="Write Parquet only."),
        click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True),
        click.option("--out", type=click.Path(path_type=Path), metavar="DIR",
                     default=Path("fleet"), show_default=True,
                     help="Folder of the results; the same again goes on there."),
        click.option("--json", "as_json", is_flag=True, help="Print the result as JSON."),
        verbose_option,
        click.option("--debug", is_flag=True, expose_value=False, hidden=True),
    )  # fmt: skip
    for option in reversed(options):
        command = option(command)
    return command


@click.command(
    cls=StatusCommand,
    refusal="some logs were refused, failed, give an alarm or are left to a later run",
    epilog="Example: workbench fleet logs --card card.toml --out fleet --workers 2",
)
@click.argument("logs", metavar="LOGS")
@fleet_options
def command(
    logs: str,
    card: str | None,
    address: str | None,
    workers: int | None,
    attempts: int,
    timeout: float,
    where: str | None,
    no_registry: bool,
    seed: int,
    out: Path,
    as_json: bool,
) -> int:
    """Identify the logs of many machines, or test them against the active models.

    LOGS is a folder, a file, a pattern or any fsspec URL of Parquet logs, <machine>/*.parquet or
    <machine>.parquet. A machine without an active model gets its first (without a design) where it
    leaves only noise; else the log is tested as by 'workbench reidentify'. Results go into the
    registry and DIR/results/*.parquet while the run goes on. A run that was killed goes on where it
    was; logs that are done are skipped.
    """
    from workbench.fleet.finding import find_logs
    from workbench.fleet.run import FleetRun, FleetSettings
    from workbench.fleet.store import ResultStore

    if address is not None and workers is not None:
        raise click.UsageError(
            "--workers is for processes of this computer; leave one of both out."
        )
    text = None if card is None else _card_text(card)
    found = find_logs(logs, leave_out=out)
    with ExitStack() as held:
        store = held.enter_context(ResultStore(out))
        recorder = held.enter_context(_recorder(None if no_registry else (where or "")))
        cluster = held.enter_context(_cluster(address, workers, attempts, timeout))
        advance = held.enter_context(progress("fleet", float(len(found)), as_json=as_json))
        settings = FleetSettings(logs, text, seed)
        done = FleetRun(cluster, store, recorder, settings, clock, advance=advance)(found)
    result = {**asdict(done), "bad": [_bad(one) for one in done.bad], "out": out}
    (out / "summary.json").write_text(dumps(result) + "\n", encoding="utf-8")
    registry = None if no_registry else where
    then = after_fleet(done, logs, card, registry, in_registry=not no_registry)
    emit(result, as_json, lambda: fleet_view(done, out), then)
    return 0 if then is None else 1


def clock() -> datetime:
    """The time now, in UTC."""
    return datetime.now(UTC)


def after_fleet(
    done: "Report", logs: str, card: str | None, where: str | None, *, in_registry: bool
) -> Step | None:
    """Check the first machine or log that somebody has to check; else run again."""
    from workbench.addresses import shown

    if not (done.bad or done.later):
        return None
    registry = ("--registry", shown(where)) if where else ()
    if not done.bad:
        cards = ("--card", card) if card else ()
        return step("what is left", "fleet", shown(logs), *cards, *registry)
    first = done.bad[0]
    if in_registry and first.verdict in ("structure", "promoted", "refused"):
        return step("what was found, and why", "registry", "show", first.log.machine, *registry)
    beside = str(Path(first.log.path).with_name("card.toml"))
    return step("what the log identifies", "doctor", first.log.path, "--card", card or beside)


def fleet_view(done: "Report", out: Path) -> "Screen":
    """What a run did, for a terminal."""
    from workbench.fleet.run import per_core
    from workbench.screen import Part, screen, tabled

    counted = ", ".join(f"{count} {name}" for name, count in sorted(done.verdicts.items()))
    parts: list[Part | str] = [
        f"{done.logs} log(s): {counted or 'none new'}, {done.before} done before"
    ]
    if done.later:
        parts.append(f"{done.later} log(s) left: their machines are in another worker's hands")
    if done.bad:
        rows = [(one.log.machine, one.verdict, one.reason) for one in done.bad]
        parts.append(tabled(("machine", "verdict", "reason"), rows, (), most=MOST_BAD))
    each = per_core(done)
    if each is not None:
        parts.append(
            f"{done.seconds:.1f} s, {each:.2f} processor seconds a log,"
            f" at most {done.memory / 2**20:.0f} MiB a worker"
        )
    parts.append(f"results: {out / 'results'}")
    return screen(*parts)


def _bad(one: Any) -> dict[str, Any]:
    """A result to check, as JSON has it."""
    return {"machine": one.log.machine, "log": one.log.name, "verdict": one.verdict,
            "reason": one.reason}  # fmt: skip


def _card_text(name: str) -> str:
    """The text of a card that is sound; raises BadCard."""
    from workbench.cards.card import load_card
    from workbench.logs.fetch import card_path

    path = card_path(name)
    load_card(path, with_recipe=False)
    return path.read_text(encoding="utf-8-sig")


@contextmanager
def _recorder(where: str | None) -> "Iterator[Recorder]":
    """The registry at `where`, "": the default one, None: none."""
    from workbench.fleet.recording import InRegistry, NoRegistry
    from workbench.jobs.lease import Patience
    from workbench.registry.database import location
    from workbench.registry.store import Registry

    if where is None:
        yield NoRegistry()
        return
    owner = f"fleet:{socket.gethostname()}:{os.getpid()}:{secrets.token_hex(2)}"
    with Patience()(Registry, location(where or None)) as registry:
        yield InRegistry(registry, owner, clock)


def _cluster(address: str | None, workers: int | None, attempts: int, timeout: float) -> Any:
    from workbench.fleet.cluster import cluster_at, local_cluster

    if address is not None:
        return cluster_at(address, timeout)
    return local_cluster(workers or _cores(), attempts)


def _cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
