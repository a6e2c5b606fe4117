"""`workbench work`: a worker of the page, on this machine or another."""

import sys
from pathlib import Path

from workbench import options
from workbench.signature import option


@options.command(
    json=options.EVENTS,
    done="stopped, or, with --once, no task waits",
    epilog="Example: workbench work --registry postgresql://... --machines /srv/machines",
)
def command(
    where: str | None = options.REGISTRY_OPTION,
    machines: Path = options.MACHINES_OPTION,
    once: bool = option("End when no task waits."),
) -> None:
    """Identify and trace the logs that were dropped on the page, one after the other.

    Any number may run, on any machine that sees the registry and the folder. Ends on Ctrl-C or
    SIGTERM and gives back what it has in hand; one that is killed loses nothing either.
    """
    from workbench.jobs.events import reporter
    from workbench.page.settings import PageSettings
    from workbench.page.worker import run_worker
    from workbench.registry.database import location

    settings = PageSettings(location(where), machines.absolute())
    run_worker(settings, reporter(sys.stderr, "work"), once=once)
