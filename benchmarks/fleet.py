"""A fleet of simulated machines on this computer: scaling, memory, and what a day would need.

    python benchmarks/fleet.py [--machines 1000] [--pair 60] [--seconds 10] [--folder DIR]

Each machine has parameters of its own, 25 % around table 1's, and a log of --seconds at 500 Hz in
Parquet. First the same --pair logs go to one worker and to two, in turn, twice; then all machines
to two workers, registry included; then a log forty times as long, for the workers' memory. A worker
has one core for all its threads.

The computer may be shared, so each run tells beside the wall time the share of it that the workers
had a processor; `1 to 2` is the wall time of one worker over that of two, and `shared out` the same
after dividing by that share: what two workers gain where nobody else wants the cores.
"""

import argparse
import shutil
import statistics
import tempfile
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from design.simulated.record import record
from identification.model.karnopp import NAMES, Karnopp
from workbench.cards.card import Card, load_card
from workbench.fleet.cluster import local_cluster
from workbench.fleet.finding import find_logs
from workbench.fleet.run import FleetRun, InRegistry, Report
from workbench.fleet.store import ResultStore
from workbench.fleet.values import Item
from workbench.logs.sources import card_path
from workbench.registry.store import Registry
from workbench.steps.simulate import as_columns

CARD = "paper_table1_rich"
H = 2e-3  # s
SPREAD = 0.25
DAY = 86400.0
FLEET = 100_000
LONG = 40


def machine(number: int, seconds: float, card: Card) -> tuple[Karnopp, pa.Table]:
    """The truth and the log of a machine."""
    assert card.recipe is not None
    rng = np.random.default_rng([7, number])
    old = card.recipe.plant.friction
    scales = 1.0 + SPREAD * rng.uniform(-1.0, 1.0, len(NAMES))
    p = Karnopp.from_array(old.array * scales)
    p = replace(p, F_sp=max(p.F_sp, 1.1 * p.F_cp), F_sn=min(p.F_sn, -1.1 * p.F_cn))
    plant = replace(card.recipe.plant, friction=p)
    recipe = replace(card.recipe, plant=plant, duration=seconds, h=H)
    columns = as_columns(record(f"m{number}", recipe, number, card.rig()), card)
    return p, pa.table(columns)


def made(folder: Path, machines: range, seconds: float, card: Card) -> dict[str, Karnopp]:
    """The machines' logs in the folder, and the truths by machine."""
    truths = {}
    for number in machines:
        name = f"m{number:06d}"
        (folder / name).mkdir(parents=True)
        truths[name], table = machine(number, seconds, card)
        pq.write_table(table, folder / name / "run.parquet")
    return truths


def run(folder: Path, workers: int, card: Card, out: Path, registry: Path | None = None) -> Report:
    """One run over the logs in the folder, by workers that have compiled before."""
    text = card.path.read_text(encoding="utf-8")
    url = str(folder)
    logs = find_logs(url)
    with local_cluster(workers, 3) as cluster:
        warm(cluster, logs[:1], url, text)
        with ResultStore(out) as store:
            if registry is None:
                return FleetRun(cluster, store, None, url, clock, text)(logs)
            with Registry(str(registry)) as there:
                recorder = InRegistry(there, "benchmark", clock)
                return FleetRun(cluster, store, recorder, url, clock, text)(logs)


def warm(cluster, logs, url: str, card: str) -> None:  # type: ignore[no-untyped-def]
    """Every worker has loaded its libraries and kernels, which a long run does once."""
    from workbench.fleet.work import work

    item = Item(url, logs[0], card, 0)
    cluster.client.run(work, item)


def clock() -> datetime:
    """The time now, in UTC."""
    return datetime.now(UTC)


def shown(name: str, report: Report, workers: int) -> float:
    """Print a run's line; the share of the wall time in which its workers had a processor."""
    count = sum(report.verdicts.values())
    share = report.busy / (workers * report.seconds)
    print(
        f"{name}: {count} logs in {report.seconds:.1f} s, {report.seconds / count:.3f} s a log;"
        f" {report.busy / count:.3f} processor seconds a log, workers on a processor for"
        f" {100 * share:.0f} %; {report.memory / 2**20:.0f} MiB a worker; {report.verdicts}",
        flush=True,
    )
    return share


def scaling(folder: Path, work: Path, card: Card) -> None:
    """The same logs by one worker and by two, in turn."""
    plain, fair = [], []
    for turn in range(2):
        found = {n: run(folder, n, card, work / f"pair{turn}-{n}") for n in (1, 2)}
        shares = {n: shown(f"{n} worker(s)", found[n], n) for n in (1, 2)}
        plain.append(found[1].seconds / found[2].seconds)
        fair.append(found[1].seconds * shares[1] / (found[2].seconds * shares[2]))
    print(f"1 to 2: {statistics.mean(plain):.2f}; shared out: {statistics.mean(fair):.2f}")


def errors(out: Path, truths: dict[str, Karnopp]) -> None:
    """Print the errors of the reported parameters of all machines against the truths."""
    rows = pq.read_table(out / "results").to_pylist()
    off: list[float] = []
    reported = 0
    for row in rows:
        truth = truths[row["machine"]]
        for name in NAMES:
            if row["verdict"] == "identified" and row[name] is not None:
                reported += 1
                off.append(abs(row[name] / getattr(truth, name) - 1.0))
    high, worst = np.quantile(off, 0.99), max(off)
    print(
        f"errors of {reported} reported parameters of {len(rows)} machines: median"
        f" {100 * statistics.median(off):.4f} %, 99 % within {100 * high:.3f} %, worst"
        f" {100 * worst:.2f} %"
    )


def memory(work: Path, seconds: float, card: Card) -> None:
    """Print the workers' memory for short logs and for one that is `LONG` times as long."""
    for name, length in (("short", seconds), ("long", LONG * seconds)):
        folder = work / f"memory-{name}"
        made(folder, range(1), length, card)
        size = sum(path.stat().st_size for path in folder.rglob("*.parquet"))
        report = run(folder, 1, card, work / f"memory-{name}-out")
        print(f"{name} log, {size / 2**20:.2f} MiB: {report.memory / 2**20:.0f} MiB of the worker")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--machines", type=int, default=1000)
    parser.add_argument("--pair", type=int, default=60)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--folder", type=Path)
    asked = parser.parse_args()
    work = Path(tempfile.mkdtemp(prefix="fleet-", dir=asked.folder))
    card = load_card(card_path(CARD))
    try:
        if asked.pair:
            made(work / "pair", range(asked.pair), asked.seconds, card)
            scaling(work / "pair", work, card)
        if asked.machines:
            truths = made(work / "all", range(asked.machines), asked.seconds, card)
            report = run(work / "all", 2, card, work / "all-out", work / "fleet.db")
            shown(f"{asked.machines} machines, 2 workers, registry", report, 2)
            errors(work / "all-out", truths)
            each = report.busy / sum(report.verdicts.values())
            print(
                f"{FLEET} machines a day: {FLEET} x {each:.2f} processor seconds / {DAY:.0f} s ="
                f" {FLEET * each / DAY:.1f} cores"
            )
            memory(work, asked.seconds, card)
    finally:
        shutil.rmtree(work)


if __name__ == "__main__":
    main()
