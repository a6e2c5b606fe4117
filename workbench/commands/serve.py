"""`workbench serve`: the page of a maintenance team, its servers and its workers."""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import click

from workbench import options
from workbench.signature import option

MEGA = 1e6


def _prefix(ctx: click.Context, param: click.Parameter, value: str) -> str:
    text = value.rstrip("/")
    if text and (
        not text.startswith("/")
        or "//" in text
        or not text.isascii()
        or any(c in text for c in " ?#%\\\"'<>")
    ):
        raise click.UsageError(f"--prefix {value!r}: a path needed, as /servo.", ctx)
    return text


@dataclass(frozen=True)
class ServeOptions:
    """What the command line says of the page."""

    where: str | None = options.REGISTRY_OPTION
    machines: Path = options.MACHINES_OPTION
    host: str = option("Address to bind to.", default="127.0.0.1")
    port: int = option("", type=click.IntRange(0, 65535), default=8000)
    names: tuple[str, ...] = option(
        "Name under which the page is asked for, beside localhost; may be repeated.",
        "--name", metavar="HOST",
    )  # fmt: skip
    prefix: str = option(
        "Path below which a proxy serves the page.",
        default="", show_default=False, metavar="/PATH", callback=_prefix,
    )  # fmt: skip
    reading: Literal["open", "token"] | None = option(
        "Who may read.  [default: open on the loopback, else token]"
    )
    secure: bool = option("The proxy speaks https: send cookies by it alone.")
    silent_days: float = option(
        "A machine without a log for so long counts as not heard from.",
        type=options.POSITIVE, default=7.0, metavar="D",
    )  # fmt: skip
    most_megabytes: float = option(
        "Largest log that may be dropped.", type=options.POSITIVE, default=200.0, metavar="MB"
    )
    servers: int = option(
        "Processes that answer.", type=click.IntRange(1, 64), default=2, metavar="N"
    )
    workers: int = option(
        "Processes that identify and trace; more by 'workbench work'.",
        type=click.IntRange(0, 64), default=1, metavar="N",
    )  # fmt: skip


@options.command(
    json=options.EVENTS,
    done="stopped",
    epilog="Example: workbench serve --registry fleet.db --machines machines",
)
def command(given: ServeOptions) -> int:
    """Serve the page: the fleet, each machine, and a place to drop a log.

    It binds to the loopback unless --host says otherwise. Reading is open or needs a token;
    changing always needs one ('workbench token add NAME --role change'). Ends on Ctrl-C or SIGTERM;
    a server or worker that dies is started again. Needs the extra 'page'.
    """
    from workbench.page.settings import refuse_missing

    refuse_missing()
    from workbench.jobs.events import reporter
    from workbench.page.serving import serve
    from workbench.page.settings import LOOPBACK, PageSettings
    from workbench.registry.database import location

    local = given.host in LOOPBACK
    settings = PageSettings(
        where=location(given.where),
        machines=str(given.machines.absolute()),
        host=given.host,
        port=given.port,
        prefix=given.prefix,
        names=given.names,
        open_reading=local if given.reading is None else given.reading == "open",
        silent_days=given.silent_days,
        most_bytes=round(given.most_megabytes * MEGA),
        secure=given.secure,
        servers=given.servers,
        workers=given.workers,
    )
    return serve(settings, reporter(sys.stderr, "serve"))
