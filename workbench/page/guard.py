"""What stands before every request: its host, its path below a prefix, its size; and what goes
with every answer, so that no browser runs what is not ours."""

from collections.abc import MutableMapping
from typing import Any

from starlette.datastructures import Headers, MutableHeaders
from starlette.exceptions import HTTPException
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from workbench.page.health import counted
from workbench.page.settings import PageSettings

POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:;"
    " connect-src 'self'; form-action 'self'; base-uri 'none'; frame-ancestors 'none'"
)
SAFE_HEADERS = {
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "same-origin",
    "X-Frame-Options": "DENY",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), geolocation=(), microphone=()",
}
FORM_BYTES = 100_000  # of a form without a file
UPLOAD_PATH = "/drop"


class Guard:
    """The application behind its guard."""

    def __init__(self, app: ASGIApp, settings: PageSettings) -> None:
        self._app = app
        self._settings = settings

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request; anything that is no HTTP goes through."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        if _host(headers.get("host", "")) not in self._settings.hosts:
            said = "This page is not served under that name; start it with --name NAME.\n"
            await PlainTextResponse(said, 421)(scope, receive, _with_headers(send, scope))
            return
        below = _below(scope, self._settings.prefix)
        dropping = str(below["path"]).rstrip("/") == UPLOAD_PATH
        most = self._settings.most_bytes if dropping else FORM_BYTES
        declared = headers.get("content-length", "0")
        if not declared.isdigit() or int(declared) > most + FORM_BYTES:
            refusal = PlainTextResponse(_too_large_text(most), 413, {"Connection": "close"})
            await refusal(below, receive, _with_headers(send, below))
            return
        await self._limited(below, receive, _with_headers(send, below), most + FORM_BYTES)

    async def _limited(self, scope: Scope, receive: Receive, send: Send, most: int) -> None:
        """The answer to a body that may be longer than its sender has said."""
        seen = 0

        async def limited() -> Message:
            nonlocal seen
            message = await receive()
            seen += len(message.get("body", b""))
            if seen > most:
                raise HTTPException(413, _too_large_text(most))
            return message

        await self._app(scope, limited, counted(send, scope["method"]))


def _too_large_text(most: int) -> str:
    return f"More than {most / 1e6:.4g} MB; cut the log, or raise --most-megabytes.\n"


def _host(text: str) -> str:
    """The name without its port."""
    name, colon, port = text.rpartition(":")
    return name.lower() if colon and port.isdigit() else text.lower()


def _below(scope: Scope, prefix: str) -> Scope:
    """The request as it is without the prefix, which a proxy may or may not have taken off."""
    path = scope["path"]
    inside = prefix and (path == prefix or path.startswith(f"{prefix}/"))
    out: MutableMapping[str, Any] = dict(scope)
    out["path"] = (path[len(prefix) :] or "/") if inside else path
    out["root_path"] = ""
    return out


def _with_headers(send: Send, scope: Scope) -> Send:
    is_static = str(scope["path"]).startswith("/static/")

    async def sending(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            headers.setdefault("Content-Security-Policy", POLICY)
            headers.setdefault("Cache-Control", "max-age=86400" if is_static else "no-store")
            for name, value in SAFE_HEADERS.items():
                headers[name] = value
        await send(message)

    return sending
