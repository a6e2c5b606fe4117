"""Who asks: a token in a cookie or a header, what it allows, and how often it may be tried; signing
in with one, and out.

Many who read the same page at once do not each ask the database: answers are kept for a moment.
"""

import hashlib
import hmac
import time
from collections import OrderedDict, deque
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from functools import wraps
from threading import Lock

from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from workbench.page.asked import Asked, Visitor
from workbench.registry.access import Access

TOKEN_COOKIE = "workbench_token"
CSRF_FIELD, CSRF_HEADER = "csrf", "x-csrf"
WRONG_TRIES, WRONG_SPAN = 10, 60.0  # wrong tokens of one address in so many seconds
CHANGES, CHANGES_SPAN = 120, 60.0  # changes by one token
MOST_KEYS = 10_000  # addresses that are remembered
SEEN_FOR = 2.0  # s that a token is taken without asking the registry again, to read only
LONGEST_TOKEN = 200

Handler = Callable[[Request], Awaitable[Response]]
Endpoint = Callable[[Asked], Response]


@dataclass
class Limiter:
    """At most `most` events of one key within `span` seconds."""

    most: int
    span: float
    _events: "OrderedDict[str, deque[float]]" = field(default_factory=OrderedDict)
    _lock: Lock = field(default_factory=Lock)

    def full(self, key: str, now: float) -> bool:
        """Whether the key has had its share."""
        with self._lock:
            return len(self._recent(key, now)) >= self.most

    def count(self, key: str, now: float) -> None:
        """One more event of the key."""
        with self._lock:
            self._recent(key, now).append(now)
            while len(self._events) > MOST_KEYS:
                self._events.popitem(last=False)

    def _recent(self, key: str, now: float) -> deque[float]:
        events = self._events.setdefault(key, deque(maxlen=self.most))
        self._events.move_to_end(key)
        while events and events[0] < now - self.span:
            events.popleft()
        return events


class Doorkeeper:
    """Identifies who asks by their token.

    open_reading: whether somebody without one may read.
    """

    def __init__(self, access: Access, *, open_reading: bool) -> None:
        self._access = access
        self._open = open_reading
        self.wrong = Limiter(WRONG_TRIES, WRONG_SPAN)
        self.changes = Limiter(CHANGES, CHANGES_SPAN)
        self._known: dict[str, tuple[float, Visitor]] = {}

    def visitor(self, request: Request, *, to_change: bool) -> Visitor:
        """Who asks; raises HTTPException where the token is none, or too many were tried."""
        nobody = Visitor(role="read" if self._open else None)
        request.state.visitor = Visitor()  # until more is known, also for an error's page
        in_header = bearer(request)
        secret = in_header or request.cookies.get(TOKEN_COOKIE, "")
        at, found = self._known.get(secret, (-SEEN_FOR, None))
        if to_change or time.monotonic() - at >= SEEN_FOR:
            found = self.known(secret, address(request)) if secret else None
        if found is None and in_header:
            raise HTTPException(401, "This token is none, or was revoked.")
        request.state.stale = found is None and secret != ""
        request.state.visitor = found or nobody
        return found or nobody

    def known(self, secret: str, where: str) -> Visitor | None:
        """The visitor of that token; None where it is none. Raises HTTPException after too many."""
        now = time.monotonic()
        if self.wrong.full(where, now):
            raise HTTPException(
                429, "Too many wrong tokens from here; wait a minute.", {"Retry-After": "60"}
            )
        token = self._access.of(secret) if len(secret) <= LONGEST_TOKEN else None
        if token is None:
            self.wrong.count(where, now)
            return None
        found = Visitor(token.name, token.role, csrf_of(secret))
        if len(self._known) > MOST_KEYS:
            self._known.clear()
        self._known[secret] = (now, found)
        return found


def reading(endpoint: Endpoint) -> Handler:
    """The endpoint for whoever may read; it runs in a thread."""

    @wraps(endpoint)
    async def guarded(request: Request) -> Response:
        def answer() -> Response:
            visitor = request.app.state.doorkeeper.visitor(request, to_change=False)
            if visitor.role is None:
                raise HTTPException(401, "Reading needs a token.")
            return endpoint(Asked(request, visitor))

        response = await run_in_threadpool(answer)
        if getattr(request.state, "stale", False):  # a revoked token is not sent again and again
            response.delete_cookie(TOKEN_COOKIE, path=cookie_path(request))
        return response

    return guarded


def changing(endpoint: Endpoint) -> Handler:
    """The endpoint for whoever may change, its form read; it runs in a thread.

    A browser has to show that the form is ours: by its csrf field, and by where it comes from.
    """

    @wraps(endpoint)
    async def guarded(request: Request) -> Response:
        visitor = await run_in_threadpool(changer, request)
        check_site(request)
        async with request.form(max_files=1, max_fields=500) as form:
            check_csrf(request, visitor, str(form.get(CSRF_FIELD, "")))
            return await run_in_threadpool(endpoint, Asked(request, visitor, form))

    return guarded


def changer(request: Request) -> Visitor:
    """Who asks for a change; raises HTTPException where they may not."""
    keeper: Doorkeeper = request.app.state.doorkeeper
    visitor = keeper.visitor(request, to_change=True)
    if not visitor.changes:
        status = 403 if visitor.name else 401
        raise HTTPException(status, "A change needs a token with the role 'change'.")
    now = time.monotonic()
    if keeper.changes.full(visitor.name, now):
        raise HTTPException(429, "Too many changes; wait a minute.", {"Retry-After": "60"})
    keeper.changes.count(visitor.name, now)
    return visitor


def check_site(request: Request) -> None:
    """Raises HTTPException where a browser says that another site sends the form."""
    site = request.headers.get("sec-fetch-site")
    if site not in (None, "same-origin", "none"):
        raise HTTPException(403, "This form was sent by another site.")


def check_csrf(request: Request, visitor: Visitor, given: str) -> None:
    """Raises HTTPException where a form of a browser is not one that we have made."""
    if bearer(request):  # no browser sends that by itself
        return
    given = given or request.headers.get(CSRF_HEADER, "")
    if not hmac.compare_digest(given.encode(), visitor.csrf.encode()):
        raise HTTPException(403, "This form is from another session; load the page again.")


def csrf_of(secret: str) -> str:
    """What a form of this token's holder carries; nobody without the token can make it."""
    return hmac.new(secret.encode(), b"csrf", hashlib.sha256).hexdigest()


def bearer(request: Request) -> str:
    """The token of the Authorization header, or nothing."""
    kind, _, secret = request.headers.get("authorization", "").partition(" ")
    return secret.strip() if kind.lower() == "bearer" else ""


def address(request: Request) -> str:
    """Where a request comes from."""
    return request.client.host if request.client else ""


def cookie_path(request: Request) -> str:
    """Below which the browser sends the cookie."""
    return f"{request.app.state.server.settings.prefix}/"


ANSWER_LIFETIME = 1.0  # s
MOST_ANSWERS = 200


class Moment:
    """The answers of a server in the last second, by address and by who asks."""

    def __init__(self) -> None:
        self._answers: dict[tuple[str, ...], tuple[float, Response]] = {}
        self._lock = Lock()

    def answer(self, endpoint: Endpoint, asked: Asked) -> Response:
        """The endpoint's answer, or the one it has just given to the same question.

        One at a time, so that many who come together wait for the first of them.
        """
        url, part = asked.request.url, asked.request.headers.get("hx-target", "")
        key = (url.path, url.query, part, asked.visitor.name)
        with self._lock:
            at, found = self._answers.get(key, (0.0, None))
            if found is None or time.monotonic() - at > ANSWER_LIFETIME:
                if len(self._answers) >= MOST_ANSWERS:
                    self._answers.clear()
                found = endpoint(asked)
                self._answers[key] = time.monotonic(), found
        kept = {"content-type": found.headers["content-type"]}  # others are added for each visitor
        return Response(found.body, found.status_code, kept)


def cached(endpoint: Endpoint) -> Endpoint:
    """The endpoint, its answers to those who only read kept for a moment."""

    @wraps(endpoint)
    def answered(asked: Asked) -> Response:
        if asked.visitor.changes:
            return endpoint(asked)
        moment: Moment = asked.request.app.state.moment
        return moment.answer(endpoint, asked)

    return answered


STAYS = 12 * 3600  # s that a browser keeps the token


async def sign_in(request: Request) -> Response:
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
    Route("/sign-in", sign_in),
    Route("/sign-in", enter, methods=["POST"]),
    Route("/sign-out", leave, methods=["POST"]),
]
