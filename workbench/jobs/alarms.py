"""Alarms: what a webhook is told, until it has taken it; a dead one stops nothing."""

from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any

import httpx
from tenacity import Retrying, retry_if_exception_type, stop_after_attempt, wait_random_exponential

from identification.errors import UserError
from workbench.jobs.passes import Report
from workbench.registry.queue import Queue
from workbench.registry.values import Outcome, Verdict

ALARMING: tuple[Verdict, ...] = ("structure", "promoted", "refused", "set_aside")
KEPT = timedelta(days=1)  # an alarm older than this is not sent any more


class BadWebhook(UserError):
    """An address to which no alarm can be sent."""


@dataclass(frozen=True)
class Webhook:
    """Where alarms are sent as JSON by POST; timeout [s] of one try."""

    url: str
    timeout: float = 5.0
    tries: int = 3
    longest_wait: float = 2.0

    def __post_init__(self) -> None:
        try:
            found = httpx.URL(self.url)
        except httpx.InvalidURL:
            found = httpx.URL("")
        if found.scheme not in ("http", "https") or not found.host:
            raise BadWebhook(f"--webhook {self.url}: http://... or https://... needed")

    def send(self, outcome: Outcome) -> None:
        """Send one alarm; raises httpx.HTTPError where it is not taken after all tries.

        It may arrive twice, where an answer is lost: the key tells one alarm from another.
        """
        again = Retrying(
            retry=retry_if_exception_type(httpx.HTTPError),
            stop=stop_after_attempt(self.tries),
            wait=wait_random_exponential(multiplier=0.2, max=self.longest_wait),
            reraise=True,
        )
        headers = {"Idempotency-Key": f"{outcome.machine}:{outcome.log.sha256}"}
        for attempt in again:
            with attempt:
                answer = httpx.post(
                    self.url, json=alarm(outcome), headers=headers, timeout=self.timeout
                )
                answer.raise_for_status()


def alarm(outcome: Outcome) -> dict[str, Any]:
    """What a webhook is told."""
    return {
        "machine": outcome.machine,
        "log": outcome.log.file,
        "sha256": outcome.log.sha256,
        "verdict": outcome.verdict,
        "reason": outcome.reason,
        "version": outcome.number,
        "at": outcome.at.isoformat(),
    }


def send_alarms(queue: Queue, webhook: Webhook, *, now: datetime, report: Report) -> int:
    """How many alarms the webhook has taken; at the first that it does not, the rest wait."""
    sent = 0
    for outcome in queue.unsent(ALARMING, since=now - KEPT):
        try:
            webhook.send(outcome)
        except httpx.HTTPError as error:
            line = " ".join(str(error).split()) or type(error).__name__
            report("webhook_failed", reason=line)
            break
        queue.sent(outcome, now=now)
        sent += 1
    return sent
