"""`workbench watch`: pass after pass, by schedule and on new files, until it is stopped."""

import signal
import threading
import traceback
from contextlib import ExitStack
from datetime import timedelta
from typing import TYPE_CHECKING

import click

from workbench import options
from workbench.jobs.options import JobOptions, clock
from workbench.signature import option

if TYPE_CHECKING:
    from workbench.jobs.worker import Worker


@options.command(
    json=options.EVENTS,
    done="stopped",
    epilog="Example: workbench watch machines --cron '0 * * * *' --port 9400",
)
def command(
    given: JobOptions,
    cron: str = option(
        "When to pass, beside every change of a log file.", default="*/5 * * * *", metavar="EXPR"
    ),
    port: int | None = option(
        "Serve Prometheus metrics by HTTP.", type=click.IntRange(1, 65535), metavar="N"
    ),
    address: str = option("Where to serve them.", default="127.0.0.1"),
) -> None:
    """Do what 'workbench reidentify' does on a schedule, and soon after a log file appears.

    ROOT as there. Ends on SIGTERM or Ctrl-C after the log in hand. A registry that is away is
    tried again with every pass.
    """
    from workbench.jobs.watching import watch_machines
    from workbench.jobs.worker import worker

    stop = threading.Event()
    with ExitStack() as stack:
        found = stack.enter_context(worker(given, stop.is_set))
        if port is not None:
            stack.enter_context(_served(found, address, port))
        for number in (signal.SIGTERM, signal.SIGINT):
            before = signal.signal(number, lambda _number, _frame: stop.set())
            stack.callback(signal.signal, number, before)
        found.report("watching", root=str(given.root), cron=cron, port=port)
        watch_machines(
            given.root,
            lambda: _once(found),
            cron=cron,
            settle=timedelta(seconds=given.settle),
            clock=clock,
            stop=stop,
            report=found.report,
            marker=given.marker,
        )
        found.report("stopped")


def _once(found: "Worker") -> bool:
    """One pass; whether it has to come again soon. What it dies of is reported, and tried again."""
    from identification.errors import UserError

    try:
        judged, alarms = found.once()
    except (UserError, OSError, MemoryError) as error:
        found.report("pass_failed", reason=" ".join(str(error).split()))
        return False
    except Exception:  # a fault of ours in one pass must not end those to come
        found.report("fault_of_ours", traceback=traceback.format_exc())
        return False
    found.report("pass_done", judged=len(judged.outcomes), growing=judged.growing,
                 busy=judged.busy, failed=dict(judged.failed),
                 alarms_waiting=alarms.waiting if alarms else 0)  # fmt: skip
    return judged.growing > 0


def _served(found: "Worker", address: str, port: int) -> ExitStack:
    """The metrics served until the stack is closed; raises OSError where the port is taken."""
    from prometheus_client import start_http_server

    from workbench.jobs.metrics import collected

    server, thread = start_http_server(port, address, registry=collected(found.figures))
    stack = ExitStack()
    stack.callback(thread.join)
    stack.callback(server.server_close)
    stack.callback(server.shutdown)
    return stack
