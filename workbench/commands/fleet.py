"""`workbench fleet`: the logs of many machines on a Dask cluster."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from workbench import options
from workbench.jobs.options import clock, worker_name
from workbench.output import Step, dumps, emit, progress, step
from workbench.signature import argument, option

if TYPE_CHECKING:
    from workbench.fleet.run import InRegistry, Report
    from workbench.screen import Screen

MOST_BAD = 20  # results to look at on one screen; --verbose and --json have the first 1000


@dataclass(frozen=True)
class FleetOptions:
    """What the command line says of a fleet."""

    logs: str = argument("LOGS")
    card: str | None = option(
        "Card of all machines: a path, or the name of a shipped one.  [default: the nearest"
        " card.toml at or above each log]"
    )
    address: str | None = option(
        "Scheduler of a Dask cluster, as tcp://host:8786.  [default: processes of this computer]",
        "--cluster", metavar="ADDRESS",
    )  # fmt: skip
    workers: int | None = option(
        "Processes of this computer.  [default: one a core]",
        type=click.IntRange(min=1), metavar="N",
    )  # fmt: skip
    attempts: int = option(
        "Workers that may die of a log before it has failed; a cluster at an ADDRESS has a setting"
        " of its own.",
        type=click.IntRange(min=1), default=3,
    )  # fmt: skip
    timeout: float = option(
        "Wait this long for a cluster's answer.", type=options.POSITIVE, default=30.0, metavar="S"
    )
    where: str | None = options.REGISTRY_OPTION
    no_registry: bool = option("Write Parquet only.")
    seed: int = options.SEED_OPTION
    out: Path = option(
        "Folder of the results; the same again goes on there.",
        default=Path("fleet"), metavar="DIR",
    )  # fmt: skip


@options.command(
    refusal="some logs were refused, failed, give an alarm or are left to a later run",
    epilog="Example: workbench fleet logs --card card.toml --out fleet --workers 2",
)
def command(given: FleetOptions) -> int:
    """Identify the logs of many machines, or test them against the active models.

    LOGS is a folder, a file, a pattern or any fsspec URL of Parquet logs, <machine>/*.parquet or
    <machine>.parquet. A machine without an active model gets its first (without a design) where it
    leaves only noise; else the log is tested as by 'workbench reidentify'. Results go into the
    registry and DIR/results/*.parquet while the run goes on. A run that was killed goes on where it
    was; logs that are done are skipped.
    """
    from workbench.cards.card import load_card
    from workbench.fleet.finding import find_logs
    from workbench.fleet.run import FleetRun
    from workbench.fleet.store import ResultStore
    from workbench.logs.sources import card_path

    if given.address is not None and given.workers is not None:
        raise click.UsageError(
            "--workers is for processes of this computer; leave one of both out."
        )
    logs, out, where = given.logs, given.out, None if given.no_registry else (given.where or "")
    text = None
    if given.card is not None:
        path = card_path(given.card)
        load_card(path, with_recipe=False)  # raises BadCard where it is not sound
        text = path.read_text(encoding="utf-8-sig")
    found = find_logs(logs, leave_out=out)
    with ExitStack() as stack:
        store = stack.enter_context(ResultStore(out))
        recorder = stack.enter_context(_recorder(where))
        cluster = stack.enter_context(_cluster(given))
        advance = stack.enter_context(progress("fleet", float(len(found))))
        run = FleetRun(cluster, store, recorder, logs, clock, text, given.seed, advance)
        done = run(found)
    bad = [
        {"machine": one.log.machine, "log": one.log.name, "verdict": one.verdict,
         "reason": one.reason}
        for one in done.bad
    ]  # fmt: skip
    result = {**asdict(done), "bad": bad, "out": out}
    (out / "summary.json").write_text(dumps(result) + "\n", encoding="utf-8")
    then = after_fleet(done, logs, given.card, where, in_registry=not given.no_registry)
    emit(result, lambda: fleet_screen(done, out), then)
    return 0 if then is None else 1


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


def fleet_screen(done: "Report", out: Path) -> "Screen":
    """What a run did, for a terminal."""
    from workbench.screen import screen, tabled
    from workbench.verdicts import counted, in_words

    verdicts = ", ".join(
        f"{count} {in_words(name)}" for name, count in sorted(done.verdicts.items())
    )
    left = f"{counted(done.later, 'log')} left, of machines in another worker's hands"
    rows = [(one.log.machine, in_words(one.verdict), one.reason) for one in done.bad]
    new, used = sum(done.verdicts.values()), f"at most {done.memory / 2**20:.0f} MiB a worker"
    return screen(
        f"{counted(done.logs, 'log')}: {verdicts or 'none new'}, {done.before} done before",
        *([left] if done.later else []),
        tabled(("machine", "verdict", "reason"), rows, (), most=MOST_BAD),
        *([f"{done.seconds:.1f} s, {done.busy / new:.2f} processor seconds a log, {used}"]
          if new else []),
        f"results: {out / 'results'}",
    )  # fmt: skip


@contextmanager
def _recorder(where: str | None) -> "Iterator[InRegistry | None]":
    """The registry at `where`, "": the default one, None: none."""
    from workbench.fleet.run import InRegistry
    from workbench.jobs.passes import Patience
    from workbench.registry.database import location
    from workbench.registry.store import Registry

    if where is None:
        yield None
        return
    owner = f"fleet:{worker_name()}"
    with Patience()(Registry, location(where or None)) as registry:
        yield InRegistry(registry, owner, clock)


def _cluster(given: FleetOptions) -> Any:
    from workbench.fleet.cluster import cluster_at, cores, local_cluster

    if given.address is not None:
        return cluster_at(given.address, given.timeout)
    return local_cluster(given.workers or len(cores()), given.attempts)
