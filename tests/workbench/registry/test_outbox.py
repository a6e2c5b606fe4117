"""Alarms are kept until they are taken, and one worker at a time has each in hand."""

from datetime import UTC, datetime, timedelta

import pytest

from design.judgement import Candidate, Judgement
from workbench.registry.outbox import FIRST_DELAY, LONGEST_DELAY, Outbox, wait
from workbench.registry.queue import Queue
from workbench.registry.store import Registry
from workbench.registry.values import SeenLog

NOW = datetime(2026, 3, 1, tzinfo=UTC)
MINUTE = timedelta(minutes=1)
LOG = SeenLog("a" * 64, "a.csv", 10, 100)
OTHER = SeenLog("b" * 64, "b.csv", 20, 50)


@pytest.fixture
def outbox(registry: Registry) -> Outbox:
    """With one alarm, of a log that was excluded; the other log was quiet."""
    registry.add("m", Candidate({"m": 1.0}), reason="first", by="t", now=NOW)
    registry.promote("m", 1, reason="first", by="t", now=NOW)
    queue = Queue(registry.database)
    queue.announce("m", [LOG, OTHER], now=NOW)
    claim = queue.claim("m", owner="w", lease=MINUTE, now=NOW)
    assert claim is not None
    queue.finish(claim, LOG, Judgement("set_aside", "bad"), by="w", now=NOW)
    queue.finish(claim, OTHER, Judgement("none", "quiet"), by="w", now=NOW)
    found = Outbox(registry.database)
    found.fill(["set_aside", "promoted"], since=NOW, now=NOW)
    return found


@pytest.mark.slow
def test_an_alarm_is_kept_until_it_is_taken(outbox: Outbox) -> None:
    outbox.fill(["set_aside"], since=NOW, now=NOW)
    (alarm,) = outbox.due(NOW)
    assert (alarm.machine, alarm.log, alarm.sha256) == ("m", LOG.file, LOG.sha256)
    assert (alarm.verdict, alarm.reason, alarm.version) == ("set_aside", "bad", 1)
    assert (alarm.at, alarm.turn) == (NOW, 0)
    assert outbox.counts(NOW) == {"m": (1, 0)}
    for _ in range(2):
        outbox.sent(alarm, now=NOW)
        outbox.fill(["set_aside"], since=NOW, now=NOW)
        assert outbox.due(NOW + LONGEST_DELAY) == ()
        assert outbox.counts(NOW) == {}


@pytest.mark.slow
def test_what_is_older_is_left_out(registry: Registry, outbox: Outbox) -> None:
    (alarm,) = outbox.due(NOW)
    outbox.fill(["none"], since=NOW + MINUTE, now=NOW)
    assert outbox.due(NOW) == (alarm,)
    outbox.fill(["none"], since=NOW, now=NOW)
    assert len(outbox.due(NOW)) == 2


def test_one_worker_at_a_time_has_it_in_hand(outbox: Outbox) -> None:
    (alarm,) = outbox.due(NOW)
    assert outbox.take(alarm, until=NOW + MINUTE, now=NOW)
    assert not outbox.take(alarm, until=NOW + MINUTE, now=NOW)
    assert outbox.due(NOW) == ()
    assert outbox.counts(NOW) == {}  # it is about to arrive
    assert outbox.counts(NOW + MINUTE) == {"m": (1, 0)}  # its worker has died
    assert outbox.take(alarm, until=NOW + 2 * MINUTE, now=NOW + MINUTE)
    outbox.give_back(alarm, now=NOW + MINUTE)
    assert outbox.due(NOW + MINUTE) == (alarm,)


def test_a_refused_alarm_waits_and_is_given_up(outbox: Outbox) -> None:
    (alarm,) = outbox.due(NOW)
    assert outbox.refused(alarm, now=NOW) == NOW + FIRST_DELAY
    assert outbox.due(NOW) == ()
    assert outbox.due(NOW + FIRST_DELAY) == (alarm,)
    assert outbox.refused(alarm, now=NOW) == NOW + 2 * FIRST_DELAY
    assert outbox.counts(NOW) == {"m": (1, 0)}
    assert outbox.give_up(before=NOW, now=NOW) == ()
    assert outbox.give_up(before=NOW + MINUTE, now=NOW) == (alarm,)
    assert outbox.give_up(before=NOW + MINUTE, now=NOW) == ()
    assert outbox.due(NOW + LONGEST_DELAY) == ()
    assert outbox.counts(NOW) == {"m": (0, 1)}
    assert not outbox.take(alarm, until=NOW + LONGEST_DELAY, now=NOW + LONGEST_DELAY)


def test_a_refusal_that_comes_too_late_changes_nothing(outbox: Outbox) -> None:
    (alarm,) = outbox.due(NOW)
    outbox.sent(alarm, now=NOW)
    outbox.refused(alarm, now=NOW)
    assert outbox.counts(NOW) == {}


def test_waits_double_up_to_some_hours() -> None:
    assert [wait(n) / FIRST_DELAY for n in range(4)] == [1, 2, 4, 8]
    assert wait(1000) == LONGEST_DELAY
