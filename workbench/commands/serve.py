"""`workbench serve`: the page of a maintenance team, its servers and its workers."""

import sys
from pathlib import Path

import click

from workbench.ending import StatusCommand
from workbench.options import Finite, events_options, machines_option, registry_option

MEGA = 1e6


@click.command(
    cls=StatusCommand,
    done="stopped",
    epilog="Example: workbench serve --registry fleet.db --machines machines",
)
@registry_option
@machines_option
@click.option("--host", default="127.0.0.1", show_default=True, help="Address to bind to.")
@click.option("--port", type=click.IntRange(0, 65535), default=8000, show_default=True)
@click.option(
    "--name",
    "names",
    multiple=True,
    metavar="HOST",
    help="Name under which the page is asked for, beside localhost; may be repeated.",
)
@click.option(
    "--prefix",
    default="",
    metavar="/PATH",
    callback=lambda *a: _prefix(*a),
    help="Path below which a proxy serves the page.",
)
@click.option(
    "--reading",
    type=click.Choice(["open", "token"]),
    help="Who may read.  [default: open on the loopback, else token]",
)
@click.option("--secure", is_flag=True, help="The proxy speaks https: send cookies by it alone.")
@click.option(
    "--silent-days",
    type=Finite(min=0, min_open=True),
    default=7.0,
    show_default=True,
    metavar="D",
    help="A machine without a log for so long counts as not heard from.",
)
@click.option(
    "--most-megabytes",
    type=Finite(min=0, min_open=True),
    default=200.0,
    show_default=True,
    metavar="MB",
    help="Largest log that may be dropped.",
)
@click.option(
    "--servers",
    type=click.IntRange(1, 64),
    default=2,
    show_default=True,
    metavar="N",
    help="Processes that answer.",
)
@click.option(
    "--workers",
    type=click.IntRange(0, 64),
    default=1,
    show_default=True,
    metavar="N",
    help="Processes that identify and trace; more by 'workbench work'.",
)
@events_options
def command(
    where: str | None,
    machines: Path,
    host: str,
    port: int,
    names: tuple[str, ...],
    prefix: str,
    reading: str | None,
    secure: bool,
    silent_days: float,
    most_megabytes: float,
    servers: int,
    workers: int,
    as_json: bool,
) -> int:
    """Serve the page: the fleet, each machine, and a place to drop a log.

    It binds to the loopback unless --host says otherwise. Reading is open or needs a token;
    changing always needs one ('workbench token add NAME --role change'). Ends on Ctrl-C or SIGTERM;
    a server or worker that dies is started again. Needs the extra 'page'.
    """
    from workbench.page.installed import refuse_missing

    refuse_missing()
    from workbench.jobs.events import reporter
    from workbench.page.serving import serve
    from workbench.page.settings import LOOPBACK, PageSettings
    from workbench.registry.database import location

    open_reading = host in LOOPBACK if reading is None else reading == "open"
    settings = PageSettings(
        where=location(where),
        machines=str(machines.absolute()),
        host=host,
        port=port,
        prefix=prefix,
        names=names,
        open_reading=open_reading,
        silent_days=silent_days,
        most_bytes=round(most_megabytes * MEGA),
        secure=secure,
        servers=servers,
        workers=workers,
    )
    return serve(settings, reporter(sys.stderr, "serve"))


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
