"""Alarms reach a webhook once; one that it refuses delays itself alone, and a dead one nothing."""

import logging
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from itertools import pairwise
from pathlib import Path
from typing import Any

import httpx
import pytest
from prometheus_client.parser import text_string_to_metric_families

from design.judgement import ALARMING
from tests.workbench.jobs.listener import Listener
from tests.workbench.jobs.machines import activate, machine
from tests.workbench.jobs.worker import ignore, judge, short_pass
from workbench.jobs.alarms import (
    GIVEN_UP_AFTER,
    IN_A_ROW,
    BadWebhook,
    Delivery,
    Unreachable,
    Webhook,
    key,
    send_alarms,
)
from workbench.jobs.metrics import MachineFigures, write_metrics
from workbench.jobs.passes import Report
from workbench.registry.outbox import FIRST_DELAY, LONGEST_DELAY, Outbox
from workbench.registry.store import Registry
from workbench.registry.values import Alarm

MINUTE = timedelta(minutes=1)


@pytest.fixture
def judged(registry: Registry, tmp_path: Path) -> Registry:
    """A registry with a quiet log, a drifted one and a bad one."""
    activate(registry, "a")
    machine(tmp_path / "m", "a", {"1.csv": "quiet", "2.csv": "drift", "3.csv": "bad"})
    short_pass(registry, judge, tmp_path / "m", "w").run()
    return registry


@pytest.fixture
def fleet(registry: Registry, tmp_path: Path) -> Registry:
    """A registry with an alarm of each of ten machines, m0 to m9."""
    names = [f"m{i}" for i in range(10)]
    activate(registry, *names)
    for name in names:
        machine(tmp_path / "m", name, {"1.csv": f"bad {name}"})
    short_pass(registry, judge, tmp_path / "m", "w").run()
    return registry


class Reports(list[tuple[str, dict[str, Any]]]):
    """Events as they were reported."""

    def __call__(self, event: str, **details: object) -> None:
        self.append((event, details))

    def events(self) -> list[str]:
        return [event for event, _ in self]


def webhook(server: Listener, path: str = "/alarm") -> Webhook:
    return Webhook(f"http://127.0.0.1:{server.server_port}{path}", longest_wait=0.01)


def dead(path: str = "/") -> Webhook:
    return Webhook(f"http://127.0.0.1:9{path}", timeout=0.5, longest_wait=0.01)


def send(
    registry: Registry, to: Webhook, *, later: timedelta = timedelta(0), report: Report = ignore
) -> Delivery:
    """One pass' alarms, by a clock that is ahead."""
    outbox = Outbox(registry.database)
    return send_alarms(outbox, to, clock=lambda: datetime.now(UTC) + later, report=report)


def alarm(name: str, turn: int = 0) -> Alarm:
    at = datetime(2026, 3, 1, tzinfo=UTC)
    return Alarm(1, turn, name, f"{name}.csv", "0" * 64, "set_aside", f"{name}: bad", 1, at)


@pytest.mark.slow
def test_alarms_are_sent_once_although_the_server_stumbles(
    judged: Registry, listener: Listener
) -> None:
    listener.answers = [503, 500]
    assert send(judged, webhook(listener)) == Delivery(sent=2)
    assert send(judged, webhook(listener)) == Delivery()
    assert {(a["machine"], a["log"], a["verdict"]) for a in listener.taken} == {
        ("a", "2.csv", "promoted"),
        ("a", "3.csv", "set_aside"),
    }
    assert len(set(listener.keys)) == 2


@pytest.mark.slow
def test_a_dead_webhook_is_reported_and_tried_again(judged: Registry, listener: Listener) -> None:
    reports = Reports()
    found = send(judged, dead(), report=reports)
    assert (found.sent, found.waiting) == (0, 2)
    assert [event for event, _ in reports] == ["webhook_failed"]
    assert "Connection refused" in reports[0][1]["reason"]
    assert send(judged, webhook(listener)).sent == 2
    assert send(judged, webhook(listener), later=2 * GIVEN_UP_AFTER) == Delivery()


@pytest.mark.slow
def test_a_refused_alarm_delays_itself_alone(fleet: Registry, listener: Listener) -> None:
    listener.by_machine = {"m0": 422}
    reports = Reports()
    found = send(fleet, webhook(listener), report=reports)
    assert found == Delivery(9, 1, 0, "answered 422 Unprocessable Entity")
    assert {a["machine"] for a in listener.taken} == {f"m{i}" for i in range(1, 10)}
    assert [(event, said["machine"]) for event, said in reports] == [("alarm_refused", "m0")]
    # Another process finds it waiting, and does not try it before its time.
    listener.by_machine = {}
    with Registry(str(fleet.database.where)) as other:
        assert send(other, webhook(listener)) == Delivery(0, 1)
        assert send(other, webhook(listener), later=1.1 * FIRST_DELAY) == Delivery(1)


@pytest.mark.slow
def test_a_refused_alarm_waits_longer_each_time_and_is_given_up_after_a_day(
    fleet: Registry, listener: Listener
) -> None:
    listener.by_machine = {"m3": 400}
    reports, passed = Reports(), timedelta(0)
    tries: list[timedelta] = []
    while passed < GIVEN_UP_AFTER + 10 * MINUTE:
        before = reports.events().count("alarm_refused")
        send(fleet, webhook(listener), later=passed, report=reports)
        if reports.events().count("alarm_refused") > before:
            tries.append(passed)
        passed += 5 * MINUTE
    gaps = [after - earlier for earlier, after in pairwise(tries)]
    assert gaps == sorted(gaps) and gaps[0] <= 5 * MINUTE and gaps[-1] >= LONGEST_DELAY
    assert len(tries) < 20
    given_up = [said for event, said in reports if event == "alarm_given_up"]
    assert [said["machine"] for said in given_up] == ["m3"]
    assert send(fleet, webhook(listener), later=passed) == Delivery()


@pytest.mark.slow
def test_results_from_before_there_was_a_webhook_are_not_given_up(
    fleet: Registry, listener: Listener
) -> None:
    assert send(fleet, webhook(listener), later=2 * GIVEN_UP_AFTER) == Delivery()


@pytest.mark.slow
def test_where_nobody_answers_the_others_are_left_and_come_first_next_time(
    fleet: Registry, monkeypatch: pytest.MonkeyPatch
) -> None:
    tried: list[str] = []

    def hang(self: Webhook, alarm: Alarm, client: httpx.Client) -> None:
        tried.append(alarm.machine)
        raise Unreachable("no answer within 5 s")

    monkeypatch.setattr(Webhook, "send", hang)
    reports = Reports()
    for _ in range(3):
        assert send(fleet, dead(), report=reports) == Delivery(0, 10, 0, "no answer within 5 s")
    assert tried == [f"m{i}" for i in range(3 * IN_A_ROW)]
    assert reports.events() == ["webhook_failed"] * 3
    assert [said["waiting"] for _, said in reports] == [10] * 3
    assert send(fleet, dead(), later=GIVEN_UP_AFTER + MINUTE, report=reports).given_up == 10


@pytest.mark.slow
def test_a_pass_spends_so_much_time_on_alarms(fleet: Registry, listener: Listener) -> None:
    found = send(fleet, replace(webhook(listener), budget=0.0))
    assert found == Delivery(0, 10, 0, "too slow for all of them in one pass")
    assert send(fleet, webhook(listener)) == Delivery(10)


@pytest.mark.slow
def test_an_alarm_on_which_we_fail_does_not_stop_the_others(
    fleet: Registry, listener: Listener, monkeypatch: pytest.MonkeyPatch
) -> None:
    sent = Webhook.send

    def fail(self: Webhook, alarm: Alarm, client: httpx.Client) -> None:
        if alarm.machine == "m4":
            raise ZeroDivisionError(f"at {self.url}")
        sent(self, alarm, client)

    monkeypatch.setattr(Webhook, "send", fail)
    reports = Reports()
    found = send(fleet, webhook(listener, "/secret"), report=reports)
    assert found == Delivery(9, 1, 0, "fault of ours: ZeroDivisionError")
    assert reports.events() == ["fault_of_ours", "alarm_refused"]
    assert "in fail" in reports[0][1]["traceback"]
    assert "secret" not in repr(reports)


@pytest.mark.slow
def test_workers_at_once_send_each_alarm_once(fleet: Registry, listener: Listener) -> None:
    where = str(fleet.database.where)

    def work(_: int) -> int:
        with Registry(where) as own:
            return send(own, webhook(listener)).sent

    with ThreadPoolExecutor(4) as pool:
        assert sum(pool.map(work, range(4))) == 10
    assert sorted(a["machine"] for a in listener.taken) == [f"m{i}" for i in range(10)]


ODD = ["Pr\u00fcfstand", 'say "no"; \\', "tab\tand\x7f", "\u65e5\u672c \U0001f527", " a ",
       "\udcff", "x" * 5000, "%C3%BC", "new\nline", "\ud83d"]  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", ODD)
def test_any_name_goes_through(listener: Listener, name: str) -> None:
    with httpx.Client() as client:
        webhook(listener).send(alarm(name), client)
    (taken,) = listener.taken
    shown = name.encode("utf-8", "backslashreplace").decode()
    assert (taken["machine"], taken["reason"]) == (shown, f"{shown}: bad")
    assert listener.keys == [key(alarm(name))]


@pytest.mark.slow
def test_any_machine_goes_from_its_folder_to_the_webhook(
    registry: Registry, listener: Listener, tmp_path: Path
) -> None:
    names = ["Pr\u00fcfstand", 'a "b"', "\u65e5" * 80]
    activate(registry, *names)
    for name in names:
        machine(tmp_path / "m", name, {f"{name[:40]}\udcff.csv": f"bad {name}"})
    for count in (3, 0):
        done = short_pass(registry, judge, tmp_path / "m", "w").run()
        assert (len(done.outcomes), done.failed) == (count, {})
    assert send(registry, webhook(listener)) == Delivery(3)
    assert {taken["machine"] for taken in listener.taken} == set(names)
    assert all(taken["log"].endswith(r"\xff.csv") for taken in listener.taken)


def test_keys_tell_alarms_apart_and_stay_as_they_are() -> None:
    names = [*ODD, "bench-a", "bench b"]
    keys = [key(alarm(name, turn)) for name in names for turn in range(3)]
    assert len(set(keys)) == len(keys)
    assert all(one.isascii() and one.isprintable() and one == one.strip() for one in keys)
    assert key(alarm("bench b")) == f"bench b:{'0' * 64}"
    assert key(alarm("Pr\u00fcfstand")) == f"Pr%C3%BCfstand:{'0' * 64}"


SECRET = "http://me:geheim@127.0.0.1:{port}/services/geheim?token=geheim#geheim"


@pytest.mark.slow
@pytest.mark.parametrize("status", [200, 302, 404, 500, None])
def test_the_address_is_never_shown(
    judged: Registry, listener: Listener, caplog: pytest.LogCaptureFixture, status: int | None
) -> None:
    if status is not None:
        listener.by_machine = {"a": status}
    port = 9 if status is None else listener.server_port
    to = Webhook(SECRET.format(port=port), longest_wait=0.01)
    reports = Reports()
    with caplog.at_level(logging.INFO):
        found = send(judged, to, report=reports)
        send(judged, to, later=GIVEN_UP_AFTER + MINUTE, report=reports)
    assert found.sent == (2 if status == 200 else 0)
    shown = repr((reports, to, found)) + caplog.text
    assert "geheim" not in shown and "services" not in shown
    if status != 200:
        assert f"http://127.0.0.1:{port}/..." in shown
        assert reports.events()[-2:] == ["alarm_given_up"] * 2


@pytest.mark.parametrize(
    "url",
    ["", "file:///geheim", "example.org/geheim", "http://", "http://me:geheim@h:port/",
     "http://me:geheim@[::1", "http://xn--/geheim", "http://h/\udcffgeheim", "http://h:99999/geheim",
     f"http://{'a' * 300}/geheim", "http://h \u00f6/geheim"],
)  # fmt: skip
def test_an_address_that_is_none(url: str) -> None:
    with pytest.raises(BadWebhook, match=r"http://\.\.\. or https://\.\.\. needed") as caught:
        Webhook(url)
    assert "geheim" not in str(caught.value)


@pytest.mark.slow
def test_metrics_count_alarms(fleet: Registry, listener: Listener, tmp_path: Path) -> None:
    listener.by_machine = {"m0": 500}
    outbox, now = Outbox(fleet.database), datetime.now(UTC)
    outbox.fill(ALARMING, since=now - GIVEN_UP_AFTER - MINUTE, now=now)
    (given_up, *_) = (a for a in outbox.due(now) if a.machine == "m1")
    assert outbox.give_up(before=given_up.at + timedelta(microseconds=1), now=now)
    send(fleet, webhook(listener))
    write_metrics(tmp_path / "m.prom", MachineFigures(fleet))
    text = (tmp_path / "m.prom").read_text(encoding="utf-8")
    for name, waiting, failed in (("m0", 0, 1), ("m1", 0, 1), ("m2", 0, 0)):
        assert f'servo_workbench_alarms_waiting{{machine="{name}"}} {waiting}.0' in text
        assert f'servo_workbench_alarms_failed{{machine="{name}"}} {failed}.0' in text


@pytest.mark.slow
def test_metrics_are_what_the_registry_holds(judged: Registry, tmp_path: Path) -> None:
    figures = MachineFigures(judged)
    figures.passed(datetime(2026, 3, 1, tzinfo=UTC), 1)
    write_metrics(tmp_path / "m.prom", figures)
    text = (tmp_path / "m.prom").read_text(encoding="utf-8")
    found = {
        (sample.name.removeprefix("servo_workbench_"), *sample.labels.values()): sample.value
        for family in text_string_to_metric_families(text)
        for sample in family.samples
    }
    assert found == {
        ("registry_up",): 1.0,
        ("version_in_force", "a"): 2.0,
        ("logs_waiting", "a"): 0.0,
        ("logs_judged", "a", "none"): 1.0,
        ("logs_judged", "a", "promoted"): 1.0,
        ("logs_judged", "a", "set_aside"): 1.0,
        ("last_pass_timestamp_seconds",): datetime(2026, 3, 1, tzinfo=UTC).timestamp(),
        ("machines_failed",): 1.0,
        ("alarms_waiting", "a"): 0.0,
        ("alarms_failed", "a"): 0.0,
    }
