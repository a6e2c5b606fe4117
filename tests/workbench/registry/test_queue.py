"""One result a log: claims, leases that end, results that come twice or too late."""

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest

from design.judgement import Candidate, Judgement
from workbench.registry.queue import OFTEN, OLDER, Queue
from workbench.registry.store import Registry
from workbench.registry.values import BadRegistry, Claim, LostClaim, SeenLog

NOW = datetime(2026, 3, 1, tzinfo=UTC)
LEASE = timedelta(minutes=1)
LOG = SeenLog("a" * 64, "a.csv", 10, 100)
OTHER = SeenLog("b" * 64, "b.csv", 20, 50)
DRIFT = Judgement("promoted", "moved", Candidate({"m": 2.0}, {"k": 2.0}, {"ok": True}), {"p": 0.01})


@pytest.fixture
def queue(registry: Registry) -> Queue:
    registry.add("m", Candidate({"m": 1.0}), reason="first", by="t", now=NOW)
    registry.promote("m", 1, reason="first", by="t", now=NOW)
    found = Queue(registry.database)
    assert found.announce("m", [LOG, OTHER], now=NOW) == 2
    return found


def claimed(queue: Queue, owner: str = "w", now: datetime = NOW) -> Claim:
    claim = queue.claim("m", owner=owner, lease=LEASE, now=now)
    assert claim is not None
    return claim


def test_a_log_is_announced_once_by_its_content(queue: Queue) -> None:
    renamed = SeenLog(LOG.sha256, "copy.csv", 10, 200)
    new = SeenLog("c" * 64, "c.csv", 1, 1)
    assert queue.announce("m", [LOG, renamed, new, new], now=NOW) == 1
    assert queue.known("m")["a.csv", 10, 100] == LOG.sha256
    assert [log for log, _ in queue.waiting("m")] == [new, OTHER, LOG]  # oldest first
    assert queue.announce("other", [LOG], now=NOW) == 1


def test_one_worker_at_a_time_until_its_lease_ends(queue: Queue) -> None:
    first = claimed(queue)
    assert queue.claim("m", owner="x", lease=LEASE, now=NOW + 0.9 * LEASE) is None
    queue.renew(first, lease=LEASE, now=NOW + 0.9 * LEASE)
    assert queue.claim("m", owner="x", lease=LEASE, now=NOW + 1.5 * LEASE) is None
    second = claimed(queue, "x", NOW + 2 * LEASE)
    for act in (
        lambda: queue.renew(first, lease=LEASE, now=NOW + 2 * LEASE),
        lambda: queue.begin(first, LOG, now=NOW + 2 * LEASE),
        lambda: queue.finish(first, LOG, DRIFT, by="w", now=NOW + 2 * LEASE),
    ):
        with pytest.raises(LostClaim, match="another worker has taken over"):
            act()
    queue.release(first)  # gives nothing back that is another's
    assert queue.claim("m", owner="y", lease=LEASE, now=NOW + 2 * LEASE) is None
    queue.release(second)
    assert claimed(queue, "y", NOW + 2 * LEASE).owner == "y"


def test_a_dead_workers_lease_ends_at_once(queue: Queue) -> None:
    claimed(queue, "dead")
    assert queue.holder("m") == "worker dead has it until 00:01:00Z"

    def taken(dead: str) -> Claim | None:
        return queue.claim("m", owner="x", lease=LEASE, now=NOW, gone=lambda one: one == dead)

    assert taken("another") is None
    claim = taken("dead")
    assert claim is not None and claim.owner == "x"


def test_a_result_has_all_that_belongs_to_it_or_nothing(queue: Queue, registry: Registry) -> None:
    claim = claimed(queue)
    late = claimed(queue, "x", NOW + 2 * LEASE)
    with pytest.raises(LostClaim):
        queue.finish(claim, LOG, DRIFT, by="w", now=NOW)
    assert len(registry.versions("m")) == 1 and len(registry.decisions("m")) == 2
    outcome = queue.finish(late, LOG, DRIFT, by="x", now=NOW)
    assert (outcome.verdict, outcome.number, outcome.evidence) == ("promoted", 1, {"p": 0.01})
    state = registry.machine("m")
    assert state.in_force is not None and state.in_force.number == 2
    assert state.since is not None
    assert (state.since.log, state.since.evidence) == (LOG.sha256, {"p": 0.01})
    assert (state.logs, state.waiting) == (2, 1)


def test_the_same_result_again_changes_nothing(queue: Queue, registry: Registry) -> None:
    claim = claimed(queue)
    first = queue.finish(claim, LOG, DRIFT, by="w", now=NOW)
    assert queue.finish(claim, LOG, DRIFT, by="w", now=NOW + LEASE) == first
    assert len(registry.versions("m")) == 2 and len(registry.decisions("m")) == 3


def test_a_refused_candidate_is_kept_with_its_reason(queue: Queue, registry: Registry) -> None:
    assert DRIFT.candidate is not None
    refusal = Judgement("refused", "no better", DRIFT.candidate)
    queue.finish(claimed(queue), LOG, refusal, by="w", now=NOW)
    state = registry.machine("m")
    assert state.in_force is not None and state.in_force.number == 1
    last = registry.decisions("m")[-1]
    assert (last.kind, last.number, last.reason) == ("refused", 2, "no better")


def test_a_rival_is_refused_beside_what_is_promoted(queue: Queue, registry: Registry) -> None:
    rival = Candidate({"m": 2.0}, {"k": 3.0})
    both = Judgement("promoted", "model alone", DRIFT.candidate, {}, (rival, "tracks worse"))
    queue.finish(claimed(queue), LOG, both, by="w", now=NOW)
    last = [(d.kind, d.number, d.reason) for d in registry.decisions("m")[-2:]]
    assert last == [("refused", 2, "tracks worse"), ("promoted", 3, "model alone")]
    state = registry.machine("m")
    assert state.in_force is not None and state.in_force.number == 3


def test_often_begun_logs_come_last(queue: Queue) -> None:
    claim = claimed(queue)
    for count in range(OFTEN):
        assert queue.waiting("m") == ((OTHER, count), (LOG, 0))
        queue.begin(claim, OTHER, now=NOW)
    assert queue.waiting("m") == ((LOG, 0), (OTHER, OFTEN))


def test_evidence_of_the_last_log_goes_to_the_next(queue: Queue, registry: Registry) -> None:
    version = registry.version("m", 1)
    assert queue.last_evidence(version) is None
    claim = claimed(queue)
    queue.finish(claim, LOG, Judgement("none", "", evidence={"n": 1}), by="w", now=NOW)
    queue.finish(claim, OTHER, Judgement("set_aside", "bad"), by="w", now=NOW + LEASE)
    assert queue.last_evidence(version) == {"n": 1}


@pytest.mark.slow
def test_a_log_reopened_is_judged_once_more(queue: Queue, registry: Registry) -> None:
    claim = claimed(queue)
    queue.begin(claim, LOG, now=NOW)
    queue.finish(claim, LOG, Judgement("set_aside", "bad card"), by="w", now=NOW)
    queue.finish(claim, OTHER, Judgement("none", "quiet"), by="w", now=NOW)
    assert registry.machine("m").set_aside == 1
    assert queue.reopen("m", [], reason="card corrected", by="t", now=NOW) == ("a.csv",)
    assert queue.waiting("m") == ((LOG, 0),)
    assert (registry.machine("m").waiting, registry.machine("m").set_aside) == (1, 0)
    queue.finish(claim, LOG, Judgement("none", "quiet"), by="w", now=NOW)
    assert queue.waiting("m") == ()
    assert [(o.log, o.turn, o.verdict) for o in queue.outcomes("m")] == [
        (OTHER, 0, "none"),
        (LOG, 0, "set_aside"),
        (LOG, 1, "none"),
    ]
    assert queue.reopen("m", ["bbbb"], reason="r", by="t", now=NOW) == ("b.csv",)
    with pytest.raises(BadRegistry, match=r"no log 'b\.csv' with a result"):
        queue.reopen("m", ["b.csv"], reason="r", by="t", now=NOW)


NEWER = SeenLog("c" * 64, "run7.csv", 30, 500)
LATE = SeenLog("d" * 64, "run3.csv", 40, 400)
COPIED = SeenLog("e" * 64, "run4.csv", 40, 900)


@pytest.mark.slow
def test_an_older_log_changes_nothing_active(queue: Queue, registry: Registry) -> None:
    claim = claimed(queue)
    queue.announce("m", [NEWER, LATE, COPIED], now=NOW)
    assert queue.finish(claim, NEWER, DRIFT, by="w", now=NOW).verdict == "promoted"
    for number, late in enumerate((LATE, COPIED), 3):
        assert queue.newer_behind("m", late) == NEWER
        other = Candidate({"m": float(number)})
        done = queue.finish(claim, late, replace(DRIFT, candidate=other), by="w", now=NOW)
        assert done.verdict == "refused"
        assert f"{late.file} is older than run7.csv" in done.reason
        assert done.evidence == {"p": 0.01, OLDER: {"file": "run7.csv", "sha256": NEWER.sha256}}
        last = registry.decisions("m")[-1]
        assert (last.kind, last.number) == ("refused", number)
    assert registry.machine("m").in_force == registry.version("m", 2)
    quiet = queue.finish(claim, LOG, Judgement("none", "quiet"), by="w", now=NOW)
    assert (quiet.verdict, quiet.number) == ("none", 2)
    assert quiet.reason.startswith("quiet; a.csv is older than run7.csv")
    assert queue.last_evidence(registry.version("m", 2)) is None  # they tell of another machine


def test_by_time_alone_where_numbers_begin_again(queue: Queue, registry: Registry) -> None:
    claim = claimed(queue)
    queue.announce("m", [NEWER, COPIED], now=NOW)
    queue.finish(claim, NEWER, DRIFT, by="w", now=NOW)
    assert queue.newer_behind("m", COPIED, "time") is None
    done = queue.finish(claim, COPIED, DRIFT, by="w", now=NOW, order="time")
    assert done.verdict == "promoted"


def test_a_name_used_again_tells_no_order(queue: Queue) -> None:
    claim = claimed(queue)
    before = SeenLog("f" * 64, "run4.csv", 1, 10)
    queue.announce("m", [before, NEWER, COPIED], now=NOW)
    queue.finish(claim, NEWER, DRIFT, by="w", now=NOW)
    assert queue.newer_behind("m", COPIED) is None
    assert queue.finish(claim, COPIED, DRIFT, by="w", now=NOW).verdict == "promoted"


def test_a_log_older_than_those_of_a_model_added_by_hand(queue: Queue, registry: Registry) -> None:
    queue.announce("m", [NEWER, LATE], now=NOW)
    made = Candidate({"m": 3.0, "log": [{"sha256": NEWER.sha256}]})
    number = registry.add("m", made, reason="by hand", by="t", now=NOW).number
    assert queue.finish(claimed(queue), LATE, DRIFT, by="w", now=NOW).verdict == "promoted"
    registry.promote("m", number, reason="by hand", by="t", now=NOW)
    claim = claimed(queue, "x", NOW + 2 * LEASE)
    assert queue.finish(claim, LOG, DRIFT, by="w", now=NOW).verdict == "refused"
    assert queue.newer_behind("m", LATE) == NEWER


def test_what_was_promoted_counts_after_a_rollback_too(queue: Queue, registry: Registry) -> None:
    claim = claimed(queue)
    queue.announce("m", [NEWER, LATE], now=NOW)
    queue.finish(claim, NEWER, DRIFT, by="w", now=NOW)
    registry.rollback("m", reason="it hunts", by="t", now=NOW)
    assert queue.finish(claim, LATE, DRIFT, by="w", now=NOW).verdict == "refused"
    current = registry.active_version("m")
    assert current is not None and current.number == 1


def test_a_claim_by_a_fast_clock_locks_nothing(queue: Queue) -> None:
    fast = claimed(queue, "fast", NOW + timedelta(hours=3))
    assert queue.claim("m", owner="x", lease=3 * LEASE, now=NOW + timedelta(hours=3)) is None
    assert claimed(queue, "x", NOW).owner == "x"
    with pytest.raises(LostClaim):
        queue.finish(fast, LOG, DRIFT, by="fast", now=NOW)


def test_reasons_with_characters_that_no_database_takes(queue: Queue) -> None:
    odd = Judgement("set_aside", "caf\udce9.csv: \0 found")
    assert queue.finish(claimed(queue), LOG, odd, by="w", now=NOW).reason == (
        "caf\\udce9.csv: \\0 found"
    )


def test_logs_to_be_judged_again_are_named_one_by_one(queue: Queue) -> None:
    claim = claimed(queue)
    twin = SeenLog("aaaa" + "b" * 60, "twin.csv", 1, 1)
    queue.announce("m", [twin], now=NOW)
    for log in (LOG, OTHER, twin):
        queue.finish(claim, log, Judgement("none", "quiet"), by="w", now=NOW)
    for name, said in (("", "no log ''"), ("b", "no log 'b'"), ("aaaa", "2 logs have")):
        with pytest.raises(BadRegistry, match=said):
            queue.reopen("m", [name], reason="r", by="t", now=NOW)
    assert queue.waiting("m") == ()
    assert queue.reopen("m", ["aaaab"], reason="r", by="t", now=NOW) == ("twin.csv",)


def test_verdicts_are_counted(queue: Queue) -> None:
    claim = claimed(queue)
    queue.finish(claim, LOG, Judgement("set_aside", "bad"), by="w", now=NOW)
    queue.finish(claim, OTHER, Judgement("none", "quiet"), by="w", now=NOW)
    assert queue.verdicts() == {("m", "set_aside"): 1, ("m", "none"): 1}
