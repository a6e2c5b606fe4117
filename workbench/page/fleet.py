"""The fleet: a line a machine, filtered, sorted and paged by the database."""

from collections.abc import Mapping
from datetime import UTC, datetime, timedelta
from typing import Any

from starlette.responses import Response
from starlette.routing import Route

from workbench.page.asked import Asked
from workbench.page.pages import STATE_WORDS
from workbench.page.visitors import briefly, reading
from workbench.registry.overview import FLEET_ORDERS, FleetAsked, fleet_page

LONGEST_FILTER = 100
LAST_PAGE = 1_000_000
HEADS = {
    "machine": "machine",
    "state": "state",
    "heard": "last log",
    "moved": "moved most",
}


def fleet(asked: Asked) -> Response:
    """The page, or the table alone where htmx asks for it."""
    wanted = asked_for(asked.request.query_params, asked.server.settings.silent_days)
    found = fleet_page(asked.database, wanted)
    pages = max(1, -(-found.found // wanted.per_page))
    selection = {"text": wanted.text, "state": wanted.state, "order": wanted.order,
                 "down": "1" if wanted.down else ""}  # fmt: skip
    part_only = asked.request.headers.get("hx-target") == "fleet"
    return asked.show(
        "fleet_table" if part_only else "fleet", title="Fleet", asked=wanted, found=found,
        pages=pages, selection=selection, heads=HEADS, states=STATE_WORDS,
        total=sum(found.counts.values()),
    )  # fmt: skip


def asked_for(query: Mapping[str, Any], silent_days: float) -> FleetAsked:
    """What the address asks for; what cannot be is left out."""
    page = str(query.get("page", "1"))
    state: Any = query.get("state")
    order: Any = query.get("order")
    return FleetAsked(
        silent_since=datetime.now(UTC) - timedelta(days=silent_days),
        text=str(query.get("text", ""))[:LONGEST_FILTER].replace("\0", ""),
        state=state if state in STATE_WORDS else None,
        order=order if order in FLEET_ORDERS else "state",
        down=query.get("down") == "1",
        page=min(max(int(page), 1), LAST_PAGE) if page.isascii() and page.isdigit() else 1,
    )


FLEET_ROUTES = [Route("/", reading(briefly(fleet)))]
