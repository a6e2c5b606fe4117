"""The page put together: its routes, what they share, and what an error becomes."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

from markupsafe import escape
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import HTMLResponse, JSONResponse, Response
from starlette.routing import Mount
from starlette.staticfiles import StaticFiles

from identification.errors import UserError
from workbench.page import drops, health, machine, visitors, work
from workbench.page.asked import Asked, Server, Visitor
from workbench.page.guard import Guard
from workbench.page.helpers import Helpers
from workbench.page.settings import PageSettings, handed_over
from workbench.page.visitors import Doorkeeper, Moment
from workbench.registry.access import Access
from workbench.registry.store import Registry
from workbench.registry.values import BadRegistry, RegistryAway

HERE = Path(__file__).parent
ASSETS = HERE.parent / "assets"
TITLES = {
    400: "That cannot be",
    401: "A token is needed",
    403: "Not allowed",
    404: "Not found",
    405: "Not that way",
    413: "Too large",
    429: "Too often",
    503: "The registry does not answer",
}


def served() -> Guard:
    """The application by the settings that were handed over to this process."""
    return application(handed_over())


def application(settings: PageSettings, helpers: Helpers | None = None) -> Guard:
    """The application on its registry; raises BadRegistry and RegistryAway.

    helpers: processes for heavy evaluations, by default of its own.
    """
    registry = Registry(settings.where)
    helpers = helpers or Helpers()

    @asynccontextmanager
    async def life(_app: Starlette) -> AsyncIterator[None]:
        async with helpers:
            yield
        registry.close()

    app = Starlette(
        routes=[
            *machine.FLEET_ROUTES, *machine.MACHINE_ROUTES, *drops.DROP_ROUTES, *work.WORK_ROUTES,
            *visitors.SIGN_IN_ROUTES, *health.HEALTH_ROUTES,
            Mount("/static/assets", StaticFiles(directory=ASSETS)),
            Mount("/static", StaticFiles(directory=HERE / "static")),
        ],
        exception_handlers={HTTPException: _said, UserError: _said},
        lifespan=life,
    )  # fmt: skip
    app.state.server, app.state.moment = Server(settings, registry, helpers), Moment()
    keeper = Doorkeeper(Access(registry.database), open_reading=settings.open_reading)
    app.state.doorkeeper = keeper
    return Guard(app, settings)


async def _said(request: Request, error: Exception) -> Response:
    """One line, as the one who asks takes it: a page, a part of one, or JSON."""
    status, said, headers = 400, str(error), dict[str, str]()
    if isinstance(error, HTTPException):
        status, said, headers = error.status_code, error.detail, dict(error.headers or {})
    elif isinstance(error, RegistryAway):
        status, headers = 503, {"Retry-After": "10"}
    elif isinstance(error, BadRegistry) and request.method in ("GET", "HEAD"):
        status = 404
    if "application/json" in request.headers.get("accept", ""):
        return JSONResponse({"error": said}, status, headers)
    if request.headers.get("hx-request"):
        return HTMLResponse(str(escape(said)), status, headers)
    visitor = await run_in_threadpool(_known, request)
    title = TITLES.get(status, "Something is wrong")
    page = Asked(request, visitor).show("error", status=status, title=title, said=said)
    page.headers.update(headers)
    return page


def _known(request: Request) -> Visitor:
    """Who asks, for the head of an error's page; whatever goes wrong with that is nobody."""
    asked: Visitor | None = getattr(request.state, "visitor", None)
    if asked is not None:  # a token is not tried twice
        return asked
    try:
        keeper: Doorkeeper = request.app.state.doorkeeper
        return keeper.visitor(request, to_change=False)
    except (HTTPException, UserError):
        return Visitor()
