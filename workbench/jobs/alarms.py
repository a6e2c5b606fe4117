"""Alarms: what a webhook is sent, until it has taken it; one that is not taken delays itself alone.

A webhook's address holds secrets (user, password, a token in its path or query), and so do the
texts of errors that quote it: only `Webhook.shown` is ever shown.
"""

import json
import logging
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import timedelta
from http import HTTPStatus
from urllib.parse import quote

import httpx
from tenacity import Retrying, retry_if_exception_type, stop_after_attempt, wait_random_exponential

from design.judgement import ALARMING
from identification.errors import UserError
from workbench.jobs.passes import Clock, Report
from workbench.registry.outbox import Outbox
from workbench.registry.values import Alarm
from workbench.verdicts import counted

GIVEN_UP_AFTER = timedelta(days=1)  # an alarm older than this is given up
IN_HAND = timedelta(minutes=2)  # for so long no other worker sends an alarm that one has taken
IN_A_ROW = 3  # alarms that do not get through, after which the others are left
BUSY_STATUSES = (408, 425, 429)  # refusals that are worth another try at once, as those from 500 on
PRINTABLE = "".join(map(chr, range(0x21, 0x7F)))


class BadWebhook(UserError):
    """An address to which no alarm can be sent."""


class Refused(Exception):
    """The webhook has answered, and not taken the alarm; its text is safe to be shown."""


class Busy(Refused):
    """The same, in a way that another try may change."""


class Unreachable(Exception):
    """No answer has come; its text is safe to be shown."""


@dataclass(frozen=True)
class Webhook:
    """Where alarms are sent as JSON by POST; timeout [s] of one try, budget [s] of a pass."""

    url: str = field(repr=False)
    timeout: float = 5.0
    tries: int = 3
    longest_wait: float = 2.0
    budget: float = 30.0

    def __post_init__(self) -> None:
        try:
            found = httpx.URL(self.url)
            found.host.encode("idna")
        except (httpx.InvalidURL, ValueError):  # the latter of what cannot be encoded
            found = httpx.URL("")
        if not 0 < (found.port or 80) < 65536:
            found = httpx.URL("")
        if found.scheme not in ("http", "https") or not found.host:
            raise BadWebhook(
                "--webhook: not an address (not shown, as it may hold a password); http://... or"
                " https://... needed"
            )

    @property
    def shown(self) -> str:
        """The address as far as it is no secret."""
        found = httpx.URL(self.url)
        return f"{found.scheme}://{found.netloc.decode()}/..."

    def send(self, alarm: Alarm, client: httpx.Client) -> None:
        """Send one alarm; raises Refused or Unreachable where it is not taken after all tries.

        It may arrive twice, where an answer is lost: the key distinguishes one alarm from another.
        """
        again = Retrying(
            retry=retry_if_exception_type((Busy, Unreachable)),
            stop=stop_after_attempt(self.tries),
            wait=wait_random_exponential(multiplier=0.2, max=self.longest_wait),
            reraise=True,
        )
        again(self._post, json.dumps(alarm_document(alarm)), key(alarm), client)

    def _post(self, content: str, idempotency: str, client: httpx.Client) -> None:
        headers = {"Content-Type": "application/json", "Idempotency-Key": idempotency}
        try:
            # The answer's body is of no use and may be without end, so it is not read.
            with client.stream("POST", self.url, content=content, headers=headers) as answer:
                status = answer.status_code
        except httpx.TimeoutException:
            raise Unreachable(f"no answer within {self.timeout:g} s") from None
        except (httpx.NetworkError, httpx.RemoteProtocolError, httpx.ProxyError) as error:
            raise Unreachable(_cause(error)) from None
        if not 200 <= status < 300:
            kind = Busy if status >= 500 or status in BUSY_STATUSES else Refused
            raise kind(_phrase(status))


@dataclass
class Delivery:
    """What became of the alarms: taken by the webhook, still waiting, given up in this pass.

    reason: why the last one that failed was not taken.
    """

    sent: int = 0
    waiting: int = 0
    given_up: int = 0
    reason: str | None = None


def alarm_document(alarm: Alarm) -> dict[str, str | int | None]:
    """What a webhook is sent."""
    sent = {key: one for key, one in vars(alarm).items() if key not in ("log_id", "turn")}
    for key in ("machine", "log", "reason"):  # a file name's odd bytes have no form in UTF-8
        sent[key] = sent[key].encode("utf-8", "backslashreplace").decode("utf-8")
    return {**sent, "at": alarm.at.isoformat()}


def key(alarm: Alarm) -> str:
    """What identifies the alarm; in ASCII, as a header has to be."""
    name = alarm.machine
    if not (name.isascii() and name.isprintable() and name == name.strip()):
        name = quote(name.encode("utf-8", "surrogatepass"), safe=PRINTABLE.replace("%", ""))
    again = f":{alarm.turn}" if alarm.turn else ""
    return f"{name}:{alarm.sha256}{again}"


def send_alarms(
    outbox: Outbox,
    webhook: Webhook,
    *,
    clock: Clock,
    report: Report,
    stop: Callable[[], bool] = lambda: False,
) -> Delivery:
    """Send what is due, and say what became of it.

    An alarm that is refused waits longer each time, and no other waits for it. Where the webhook
    cannot be reached, or takes too long for all of them, the rest is left for the next pass.
    """
    now = clock()
    outbox.fill(ALARMING, since=now - GIVEN_UP_AFTER, now=now)
    lost = outbox.give_up(before=now - GIVEN_UP_AFTER, now=now)
    for alarm in lost:
        report(
            "alarm_given_up",
            machine=alarm.machine,
            file=alarm.log,
            verdict=alarm.verdict,
            reason=f"not taken by {webhook.shown} within {counted(GIVEN_UP_AFTER.days, 'day')}",
        )
    logging.getLogger("httpx").setLevel(logging.WARNING)  # else it logs whole addresses
    done = Delivery(given_up=len(lost))
    unreached = _Sending(outbox, webhook, clock, report, stop, done).send(outbox.due(now))
    done.waiting = sum(count for count, _ in outbox.counts(clock()).values())
    if unreached:
        report("webhook_failed", webhook=webhook.shown, reason=done.reason, waiting=done.waiting)
    return done


@dataclass(frozen=True)
class _Sending:
    """One pass' way through the alarms; done: what has become of them so far."""

    outbox: Outbox
    webhook: Webhook
    clock: Clock
    report: Report
    stop: Callable[[], bool]
    done: Delivery

    def send(self, alarms: tuple[Alarm, ...]) -> bool:
        """Whether the webhook was not reached with one of them; the rest is then left."""
        if not alarms:
            return False
        end = time.monotonic() + self.webhook.budget
        try:
            client = httpx.Client(timeout=self.webhook.timeout)
        except Exception as error:  # of a proxy or certificates that the environment names
            self.done.reason = f"no connection: {type(error).__name__}"
            return True
        missed, unreached = 0, False
        with client:
            for alarm in alarms:
                if self.stop() or missed >= IN_A_ROW:
                    break
                if time.monotonic() >= end:
                    self.done.reason = self.done.reason or "too slow for all of them in one pass"
                    break
                if self.outbox.take(alarm, until=self.clock() + IN_HAND, now=self.clock()):
                    missed = 0 if self._answered(alarm, client) else missed + 1
                    unreached = unreached or missed > 0
        return unreached

    def _answered(self, alarm: Alarm, client: httpx.Client) -> bool:
        """Whether the webhook has answered, be it to refuse the alarm."""
        try:
            self.webhook.send(alarm, client)
        except Unreachable as error:
            self.done.reason = str(error)
            self.outbox.give_back(alarm, now=self.clock())
            return False
        except Refused as error:
            self.done.reason = str(error)
        except Exception as error:  # one alarm on which we fail must not stop the others
            # Where it happened, without the error's text, which may quote the address.
            shown = "".join(traceback.format_tb(error.__traceback__))
            self.report("fault_of_ours", machine=alarm.machine, file=alarm.log, traceback=shown)
            self.done.reason = f"fault of ours: {type(error).__name__}"
        else:
            self.done.sent += 1
            self.outbox.sent(alarm, now=self.clock())
            return True
        next_at = self.outbox.refused(alarm, now=self.clock())
        self.report("alarm_refused", machine=alarm.machine, file=alarm.log, reason=self.done.reason,
                    webhook=self.webhook.shown, next_at=next_at.isoformat())  # fmt: skip
        return True


def _phrase(status: int) -> str:
    """The status in words of ours: those of the answer may be anything."""
    try:
        return f"answered {status} {HTTPStatus(status).phrase}"
    except ValueError:
        return f"answered {status}"


def _cause(error: Exception) -> str:
    """Why a connection failed: what the system says, never what quotes the address."""
    found: BaseException | None = error
    while found is not None:
        if isinstance(found, OSError) and found.strerror:
            return f"{type(error).__name__}: {found.strerror}"
        found = found.__cause__ or found.__context__
    return type(error).__name__
