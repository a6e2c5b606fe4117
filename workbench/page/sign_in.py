"""Signing in with a token, and out."""

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from workbench.page.asked import Asked, Visitor
from workbench.page.visitors import TOKEN_COOKIE, address, check_site, cookie_path

STAYS = 12 * 3600  # s that a browser keeps the token


async def page(request: Request) -> Response:
    """The form; whoever has no token may see it."""
    visitor = await run_in_threadpool(
        request.app.state.doorkeeper.visitor, request, to_change=False
    )
    return Asked(request, visitor).show("sign_in", wrong="", title="Sign in")


async def enter(request: Request) -> Response:
    """Take a token and leave it with the browser, out of reach of scripts and other sites."""
    check_site(request)
    form, asked = await request.form(max_files=0, max_fields=5), Asked(request, Visitor())
    secret = str(form.get("token", "")).strip()
    found = await run_in_threadpool(request.app.state.doorkeeper.known, secret, address(request))
    if found is None:
        wrong = "This token is none, or was revoked."
        return asked.show("sign_in", status=401, wrong=wrong, title="Sign in")
    response = asked.go("/")
    response.set_cookie(
        TOKEN_COOKIE, secret, max_age=STAYS, path=cookie_path(request), httponly=True,
        samesite="strict", secure=asked.server.settings.secure,
    )  # fmt: skip
    return response


async def leave(request: Request) -> Response:
    """Forget the token."""
    check_site(request)
    response = Asked(request, Visitor()).go("/sign-in")
    response.delete_cookie(TOKEN_COOKIE, path=cookie_path(request))
    return response


SIGN_IN_ROUTES = [
    Route("/sign-in", page),
    Route("/sign-in", enter, methods=["POST"]),
    Route("/sign-out", leave, methods=["POST"]),
]
