"""Alarms reach a webhook once, and a dead one stops nothing."""

import json
import threading
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from typing import Any

import pytest
from prometheus_client.parser import text_string_to_metric_families

from tests.workbench.jobs.machines import in_force, machine
from tests.workbench.jobs.worker import clock, ignore, judge, settings
from workbench.jobs.alarms import BadWebhook, Webhook, send_alarms
from workbench.jobs.metrics import Figures, write_metrics
from workbench.jobs.passes import Pass
from workbench.registry.queue import Queue
from workbench.registry.store import Registry


class Listener(HTTPServer):
    """Takes alarms; answers with each of `answers` in turn, then with 200."""

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), Handler)
        self.taken: list[dict[str, Any]] = []
        self.keys: list[str | None] = []
        self.answers: list[int] = []


class Handler(BaseHTTPRequestHandler):
    server: Listener

    def do_POST(self) -> None:
        body = self.rfile.read(int(self.headers["Content-Length"]))
        status = self.server.answers.pop(0) if self.server.answers else 200
        if status == 200:
            self.server.taken.append(json.loads(body))
            self.server.keys.append(self.headers["Idempotency-Key"])
        self.send_response(status)
        self.end_headers()

    def log_message(self, format: str, *args: object) -> None:
        """Nothing on the terminal."""


@pytest.fixture
def listener() -> Iterator[Listener]:
    server = Listener()
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield server
    server.shutdown()
    thread.join()
    server.server_close()


@pytest.fixture
def judged(registry: Registry, tmp_path: Path) -> Registry:
    """A registry with a quiet log, a drifted one and a bad one."""
    in_force(registry, "a")
    machine(tmp_path / "m", "a", {"1.csv": "quiet", "2.csv": "drift", "3.csv": "bad"})
    Pass(registry, judge, settings("w"), clock, ignore).run(tmp_path / "m")
    return registry


def webhook(server: Listener) -> Webhook:
    return Webhook(f"http://127.0.0.1:{server.server_port}/alarm", longest_wait=0.01)


def test_alarms_are_sent_once_although_the_server_stumbles(
    judged: Registry, listener: Listener
) -> None:
    queue, now = Queue(judged.database), datetime.now(UTC)
    listener.answers = [503, 500]
    assert send_alarms(queue, webhook(listener), now=now, report=ignore) == 2
    assert send_alarms(queue, webhook(listener), now=now, report=ignore) == 0
    assert {(a["machine"], a["log"], a["verdict"]) for a in listener.taken} == {
        ("a", "2.csv", "promoted"),
        ("a", "3.csv", "set_aside"),
    }
    assert len(set(listener.keys)) == 2


def test_a_dead_webhook_is_told_of_and_tried_again(judged: Registry, listener: Listener) -> None:
    queue, now = Queue(judged.database), datetime.now(UTC)
    told: list[str] = []
    dead = Webhook("http://127.0.0.1:9/", timeout=0.5, longest_wait=0.01)
    sent = send_alarms(queue, dead, now=now, report=lambda event, **_: told.append(event))
    assert (sent, told) == (0, ["webhook_failed"])
    listener.answers = [500] * 3
    assert send_alarms(queue, webhook(listener), now=now, report=ignore) == 0
    assert send_alarms(queue, webhook(listener), now=now, report=ignore) == 2
    assert send_alarms(queue, webhook(listener), now=now + timedelta(days=2), report=ignore) == 0


@pytest.mark.parametrize("url", ["", "file:///etc", "example.org/x", "http://"])
def test_an_address_that_is_none(url: str) -> None:
    with pytest.raises(BadWebhook, match="needed"):
        Webhook(url)


def test_metrics_are_what_the_registry_holds(judged: Registry, tmp_path: Path) -> None:
    figures = Figures(judged)
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
    }
