"""Tasks of the page: each done once, whoever claims, is silent, cancels or dies meanwhile."""

import threading
from datetime import timedelta
from pathlib import Path

import pytest

from tests.workbench.page.conftest import NOW, Page
from workbench.registry.access import Access
from workbench.registry.bench import MOST_BEGUN, Bench
from workbench.registry.store import Registry
from workbench.registry.tables import TaskRow, UploadRow
from workbench.registry.values import BadRegistry, LostClaim

LEASE = timedelta(seconds=30)
UPLOAD = "0" * 16


def upload(name: str) -> UploadRow:
    return UploadRow(id=name, file="a.csv", size=3, sha256="f" * 64, made_by="anna", at=NOW)


def bench_of(registry: Registry) -> Bench:
    bench = Bench(registry.database)
    bench.add(upload(UPLOAD))
    return bench


def claimed(bench: Bench, owner: str, seconds: float = 0.0) -> TaskRow:
    claim = bench.claim(owner, lease=LEASE, now=NOW + timedelta(seconds=seconds))
    assert claim is not None
    return claim


@pytest.mark.slow
def test_a_task_has_one_worker_until_its_lease_ends(where: str) -> None:
    with Registry(where) as registry:
        bench = bench_of(registry)
        task = bench.ask(UPLOAD, "identify", by="anna", now=NOW)
        assert bench.ask(UPLOAD, "identify", by="bob", now=NOW).id == task.id
        other = bench.ask(UPLOAD, "trace", by="anna", now=NOW)
        first, second = claimed(bench, "w"), claimed(bench, "x")
        assert (first.id, second.id) == (task.id, other.id)
        assert bench.claim("y", lease=LEASE, now=NOW) is None
        bench.progress(first, "refining", 0.4, lease=LEASE, now=NOW + 0.9 * LEASE)
        assert bench.task(task.id).stage == "refining"
        taken = claimed(bench, "y", 40.0)
        assert taken.id == other.id  # the first is still renewed
        with pytest.raises(LostClaim):
            bench.finish(second, "done", "late", now=NOW)
        bench.finish(taken, "done", "model", now=NOW)
        bench.finish(first, "failed", "bad", now=NOW)
        assert [one.state for one in bench.tasks(UPLOAD)] == ["failed", "done"]
        assert bench.counts() == {"failed": 1, "done": 1}
        assert bench.ask(UPLOAD, "identify", by="anna", now=NOW).id not in (task.id, other.id)


def test_a_cancelled_task_is_no_longer_its_workers(where: str) -> None:
    with Registry(where) as registry:
        bench = bench_of(registry)
        task = bench.ask(UPLOAD, "identify", by="anna", now=NOW)
        claim = claimed(bench, "w")
        assert bench.cancel(task.id, by="bob", now=NOW).state == "cancelled"
        with pytest.raises(LostClaim):
            bench.progress(claim, "s", 0.5, lease=LEASE, now=NOW)
        with pytest.raises(LostClaim):
            bench.finish(claim, "done", "s", now=NOW)
        bench.give_back(claim)
        assert bench.cancel(task.id, by="bob", now=NOW).said == "cancelled by bob"
        assert bench.claim("x", lease=LEASE, now=NOW + 9 * LEASE) is None
        kinds = [one.kind for one in Access(registry.database).audited(9)]
        assert kinds == ["identify_cancelled", "identify_asked", "log_dropped"]


def test_what_is_given_back_waits_and_what_kills_is_given_up(where: str) -> None:
    with Registry(where) as registry:
        bench = bench_of(registry)
        task = bench.ask(UPLOAD, "trace", by="anna", now=NOW)
        for _ in range(2 * MOST_BEGUN):  # asked to end is not the task's fault
            bench.give_back(claimed(bench, "w"))
        for k in range(MOST_BEGUN):
            claimed(bench, "w", 60.0 * k)
        assert bench.claim("w", lease=LEASE, now=NOW + timedelta(hours=1)) is None
        ended = bench.task(task.id)
        assert ended.state == "failed" and "no worker has come to its end" in ended.said
        with pytest.raises(BadRegistry):
            bench.task(99)
        with pytest.raises(BadRegistry):
            bench.ask("none", "trace", by="anna", now=NOW)


@pytest.mark.slow
def test_many_workers_share_the_tasks(where: str) -> None:
    taken: list[int] = []
    with Registry(where) as registry:
        bench = Bench(registry.database)
        for k in range(24):
            bench.add(upload(f"{k:016x}"))
            bench.ask(f"{k:016x}", "identify", by="anna", now=NOW)

        def work(owner: str) -> None:
            while (claim := bench.claim(owner, lease=LEASE, now=NOW)) is not None:
                taken.append(claim.id)
                bench.finish(claim, "done", owner, now=NOW)

        workers = [threading.Thread(target=work, args=(f"w{k}",)) for k in range(4)]
        for one in workers:
            one.start()
        for one in workers:
            one.join()
        assert len(taken) == len(set(taken))
        for k in range(24):  # a claim that found all rows locked has come back empty
            assert bench.tasks(f"{k:016x}")[0].state == "done"


def test_work_is_asked_for_with_a_card_alone(page: Page, tmp_path: Path) -> None:
    changer = page.token("anna", "change")
    lines = "".join(f"{k * 1e-3:.3f},{k % 7}\n" for k in range(300))
    given = page.client.post("/drop", headers=changer, files={"log": ("a.csv", f"t,y\n{lines}")})
    place = given.headers["location"]
    assert page.client.post(f"{place}/work", headers=changer, data={"kind": "x"}).status_code == 400
    answer = page.client.post(f"{place}/work", headers=changer, data={"kind": "identify"})
    assert answer.status_code == 400 and "correct it first" in answer.text
    assert "no column moves" in page.client.get(f"{place}/card").text
    assert page.client.get(f"{place}/card.toml").status_code == 404
    assert page.client.get("/work/1/report").status_code == 404
