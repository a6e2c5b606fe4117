"""Runs on real worker processes with light work: order, restart, lost workers, the registry."""

import os
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import ClassVar

import pyarrow.parquet as pq
import pytest
from distributed import LocalCluster

from tests.workbench.fleet.values import (
    DEADLY,
    answer,
    clock,
    core_of,
    die_of_some,
    die_once,
    fault,
    log_of,
    other_versions,
    result_of,
    slow,
)
from workbench.fleet.cluster import Cluster, Work, cluster_at, local_cluster
from workbench.fleet.run import (
    LEASE,
    FleetRun,
    InRegistry,
    Report,
)
from workbench.fleet.store import RESULTS_FOLDER, ResultStore
from workbench.fleet.values import BadCluster, BadLogs, LogFile, Result
from workbench.jobs.passes import Patience
from workbench.registry.queue import Queue
from workbench.registry.store import Registry
from workbench.registry.values import RegistryAway

LOGS = [log_of(f"m{number}") for number in range(6)]


@pytest.fixture(scope="module")
def cluster() -> Iterator[Cluster]:
    """Two worker processes, of which a log may cost two."""
    with local_cluster(2, 2) as made:
        yield made


@pytest.fixture
def registry(tmp_path: Path) -> Iterator[Registry]:
    """An empty registry."""
    with Registry(str(tmp_path / "registry.db")) as made:
        yield made


def run(
    cluster: Cluster,
    folder: Path,
    work: Work = answer,
    logs: list[LogFile] = LOGS,
    recorder: InRegistry | None = None,
    card: str = "card",
) -> Report:
    with ResultStore(folder) as store:
        return FleetRun(cluster, store, recorder, "/nowhere", clock, card, work=work)(logs)


def verdicts(folder: Path) -> dict[str, str]:
    """Verdicts by machine; no machine may have two rows."""
    rows = pq.read_table(folder / RESULTS_FOLDER).to_pylist()
    found = {row["log"]: row["verdict"] for row in rows}
    assert len(found) == len(rows)
    return {name.partition("/")[0]: verdict for name, verdict in found.items()}


@pytest.mark.slow
def test_a_worker_has_one_core(cluster: Cluster) -> None:
    futures = cluster.client.map(core_of, range(8), pure=False)
    found = {pid: cores for pid, cores in cluster.client.gather(futures)}
    assert all(len(cores) == 1 for cores in found.values())
    if len(os.sched_getaffinity(0)) > 1 and len(found) == 2:
        assert len({min(cores) for cores in found.values()}) == 2


def test_a_run_a_second_run_and_new_logs(cluster: Cluster, tmp_path: Path) -> None:
    first = run(cluster, tmp_path, logs=LOGS[:4])
    assert (first.logs, first.before, first.verdicts) == (4, 0, {"identified": 4})
    assert (first.busy, first.memory) == (2.0, 10)
    again = run(cluster, tmp_path)
    assert (again.logs, again.before, again.verdicts) == (6, 4, {"identified": 2})
    assert verdicts(tmp_path) == {log.machine: "identified" for log in LOGS}


def test_what_a_killed_run_had_noted_is_not_done_again(cluster: Cluster, tmp_path: Path) -> None:
    with ResultStore(tmp_path) as store:
        store.note(result_of(LOGS[0]))
        store.note(result_of(LOGS[1]))
    done = run(cluster, tmp_path)
    assert (done.before, done.verdicts) == (2, {"identified": 4})
    assert len(verdicts(tmp_path)) == 6


@pytest.mark.slow
def test_a_log_that_kills_its_workers_fails_alone(cluster: Cluster, tmp_path: Path) -> None:
    logs = [*LOGS[:3], log_of(DEADLY), *LOGS[3:]]
    done = run(cluster, tmp_path, die_of_some, logs)
    assert done.verdicts == {"identified": 6, "failed": 1}
    (bad,) = done.bad
    assert bad.log.machine == DEADLY
    assert "2 workers died of it" in bad.reason
    assert verdicts(tmp_path)[DEADLY] == "failed"


@pytest.mark.slow
def test_a_lost_worker_costs_nothing(cluster: Cluster, tmp_path: Path) -> None:
    mark = tmp_path / "mark"
    done = run(cluster, tmp_path / "out", die_once, [log_of(DEADLY), *LOGS], card=str(mark))
    assert mark.exists()
    assert done.verdicts == {"identified": 7}


@pytest.mark.slow
def test_a_worker_killed_from_outside(cluster: Cluster, tmp_path: Path) -> None:
    pids = list(cluster.client.run(os.getpid).values())
    killed: list[int] = []

    def advance(_step: float) -> None:
        if not killed and pids:
            killed.append(pids[0])
            os.kill(pids[0], signal.SIGKILL)

    with ResultStore(tmp_path) as store:
        found = FleetRun(
            cluster, store, None, "/nowhere", clock, "card", work=slow, advance=advance
        )
        done = found([*LOGS, *(log_of(f"n{number}") for number in range(6))])
    assert killed
    assert done.verdicts == {"identified": 12}


def test_what_a_worker_raises_is_reported(cluster: Cluster, tmp_path: Path) -> None:
    done = run(cluster, tmp_path, fault, LOGS[:1])
    assert done.verdicts == {"failed": 1}
    assert "ZeroDivisionError" in done.bad[0].reason


def test_the_registry_gets_each_log_once(
    cluster: Cluster, tmp_path: Path, registry: Registry
) -> None:
    recorder = InRegistry(registry, "tester", clock, Patience(1.0))
    logs = [log_of("a", 1), log_of("a", 2), log_of("b", 1)]
    done = run(cluster, tmp_path / "1", logs=logs, recorder=recorder)
    # The second log of a machine is judged against the model that the first has led to.
    assert done.verdicts == {"identified": 2, "none": 1}
    run(cluster, tmp_path / "2", logs=logs, recorder=recorder)
    for name, count in (("a", 2), ("b", 1)):
        state = registry.machine(name)
        assert (state.versions, state.logs, state.waiting) == (1, count, 0)
        assert state.in_force is not None
        assert len(registry.decisions(name)) == 1
    assert [one.verdict for one in Queue(registry.database).outcomes("a")] == ["promoted", "none"]


def test_a_machine_in_anothers_hands_is_left(
    cluster: Cluster, tmp_path: Path, registry: Registry
) -> None:
    queue = Queue(registry.database)
    claim = queue.claim("m1", owner="other", lease=LEASE, now=clock())
    assert claim is not None
    recorder = InRegistry(registry, "tester", clock, Patience(1.0))
    done = run(cluster, tmp_path, recorder=recorder, logs=LOGS[:3])
    assert (done.later, done.verdicts) == (1, {"identified": 2})
    assert set(verdicts(tmp_path)) == {"m0", "m2"}
    queue.release(claim)
    again = run(cluster, tmp_path, recorder=recorder, logs=LOGS[:3])
    assert (again.before, again.later) == (3, 0)  # its result was noted, and is recorded now
    assert registry.active_version("m1") is not None
    assert len(verdicts(tmp_path)) == 3


class Away(InRegistry):
    """A recorder whose database goes away after two results."""

    recorded: ClassVar[list[Result]] = []

    def record(self, result: Result) -> bool:
        if len(self.recorded) == 2:
            raise RegistryAway("away")
        self.recorded.append(result)
        return True


def test_a_database_that_goes_away_loses_nothing(
    cluster: Cluster, registry: Registry, tmp_path: Path
) -> None:
    with pytest.raises(RegistryAway):
        run(cluster, tmp_path, recorder=Away(registry, "tester", clock))
    assert len(verdicts(tmp_path)) == 2
    again = run(cluster, tmp_path)
    # The third result was noted as the database went away, so it is not made again.
    assert (again.before, again.verdicts) == (3, {"identified": 3})
    assert len(verdicts(tmp_path)) == 6


def test_a_result_against_a_version_that_is_gone_is_left(registry: Registry) -> None:
    recorder = InRegistry(registry, "tester", clock, Patience(1.0))
    assert recorder.record(result_of(log_of("a", 1)))
    assert not recorder.record(result_of(log_of("a", 2)))  # judged without an active model
    assert recorder.record(result_of(log_of("a", 1)))


def test_logs_without_any_card_are_refused(cluster: Cluster, tmp_path: Path) -> None:
    with ResultStore(tmp_path / "out") as store:
        found = FleetRun(cluster, store, None, str(tmp_path), clock, work=answer)
        with pytest.raises(BadLogs, match=r"no card.toml .* --card"):
            found(LOGS)


def test_a_cluster_by_its_address(cluster: Cluster, tmp_path: Path) -> None:
    address = cluster.client.scheduler.address
    with cluster_at(address, 10.0) as found:
        assert found.threads() == 2
        assert run(found, tmp_path).verdicts == {"identified": 6}


def test_a_cluster_of_another_version_is_refused(
    cluster: Cluster, monkeypatch: pytest.MonkeyPatch
) -> None:
    address = cluster.client.scheduler.address
    monkeypatch.setattr("workbench.fleet.cluster.versions", other_versions)
    with (
        pytest.raises(BadCluster, match=r"servo-workbench 9.9.* here; install the same"),
        cluster_at(address, 10.0),
    ):
        pass


@pytest.mark.slow
def test_a_scheduler_without_workers_is_refused() -> None:
    with (
        LocalCluster(
            n_workers=0, processes=False, dashboard_address="127.0.0.1:0", protocol="tcp://"
        ) as empty,
        pytest.raises(BadCluster, match=r"has no workers after 0\.5 s"),
        cluster_at(empty.scheduler_address, 0.5),
    ):
        pass


@pytest.mark.slow
@pytest.mark.parametrize(
    "address",
    ["", "tcp://", "tcp://host:port", "tcp://[::1", "nonsense://h:1", "tcp://h:99999",
     f"tcp://{'a' * 300}:1", "tls://me:geheim@127.0.0.1:9", "http://me:geheim@h:9/?token=geheim"],
)  # fmt: skip
def test_an_address_that_is_none(address: str) -> None:
    with pytest.raises(BadCluster, match="no address of a scheduler") as caught:
        cluster_at(address, 0.1).__enter__()
    assert "geheim" not in str(caught.value)
