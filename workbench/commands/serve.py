"""`workbench serve`: the page of a maintenance team, its servers and its workers."""

import sys
from dataclasses import replace

from workbench import options
from workbench.page.settings import PageSettings, refuse_missing


@options.command(
    json=options.EVENTS,
    done="stopped",
    epilog="Example: workbench serve --registry fleet.db --machines machines",
)
def command(given: PageSettings) -> int:
    """Serve the page: the fleet, each machine, and a place to drop a log.

    It binds to the loopback unless --host says otherwise. Reading is open or needs a token;
    changing always needs one ('workbench token add NAME --role change'). Ends on Ctrl-C or SIGTERM;
    a server or worker that dies is started again. Needs the extra 'page'.
    """
    refuse_missing()
    from workbench.jobs.events import reporter
    from workbench.page.serving import serve
    from workbench.registry.database import location

    where, machines = location(given.where), given.machines.absolute()
    return serve(replace(given, where=where, machines=machines), reporter(sys.stderr, "serve"))
