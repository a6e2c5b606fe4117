"""A request as the page's functions take it: who asks, what the server has, and how to answer."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

from starlette.requests import Request
from starlette.responses import HTMLResponse, RedirectResponse, Response

from workbench.jobs.options import clock
from workbench.page.dropped import Drop
from workbench.page.helpers import Helpers
from workbench.page.pages import environment
from workbench.page.settings import PageSettings
from workbench.registry.access import note
from workbench.registry.bench import Bench
from workbench.registry.database import Database
from workbench.registry.store import Registry
from workbench.registry.values import BadRegistry, Role

ANYBODY = ""
LONGEST_REASON = 500


@dataclass(frozen=True)
class Visitor:
    """Who asks, by the name of the token, and what that allows; csrf: belongs into forms."""

    name: str = ANYBODY
    role: Role | None = None
    csrf: str = ""

    @property
    def changes(self) -> bool:
        """Whether the visitor may change things."""
        return self.role == "change"


@dataclass(frozen=True)
class Server:
    """What every answer is made with; helpers: processes for heavy looks at logs."""

    settings: PageSettings
    registry: Registry
    helpers: Helpers


@dataclass(frozen=True)
class Asked:
    """A request and who makes it; form: what it brings where it is to change something."""

    request: Request
    visitor: Visitor
    form: Mapping[str, Any] | None = None

    @property
    def server(self) -> Server:
        """What the answer is made with."""
        found: Server = self.request.app.state.server
        return found

    @property
    def registry(self) -> Registry:
        return self.server.registry

    @property
    def database(self) -> Database:
        return self.server.registry.database

    @property
    def bench(self) -> Bench:
        """The uploads and the tasks on them."""
        return Bench(self.database)

    @property
    def drop(self) -> Drop:
        """The dropped log that the address names."""
        return self.drop_of(self["upload"])

    def drop_of(self, upload: str) -> Drop:
        return Drop(self.root, upload)

    @property
    def root(self) -> Path:
        """The folder of machines."""
        return self.server.settings.machines

    def __getitem__(self, name: str) -> Any:
        """A part of the address."""
        return self.request.path_params[name]

    def query(self, name: str) -> str:
        """What the address asks for by that name, or nothing."""
        return self.request.query_params.get(name, "")

    def given(self, name: str) -> Any:
        """A field of the form, or nothing."""
        return (self.form or {}).get(name, "")

    def text(self, name: str) -> str:
        """A field that has to be filled, in one line; raises BadRegistry where it is not."""
        found = " ".join(str(self.given(name)).split())[:LONGEST_REASON]
        if not found:
            raise BadRegistry(f"the {name} is missing; say it in a few words")
        return found

    @property
    def by_htmx(self) -> bool:
        """Whether a part of a page asks."""
        return bool(self.request.headers.get("hx-request"))

    def show(self, template: str, *, status: int = 200, **values: Any) -> Response:
        """The template `<template>.html.j2` as an answer; `url` in it knows the prefix."""
        filled = environment().get_template(f"{template}.html.j2")
        return HTMLResponse(filled.render(visitor=self.visitor, url=self.url, **values), status)

    def go(self, path: str) -> Response:
        """Send the browser to another page, by htmx too."""
        if self.by_htmx:
            return Response(status_code=204, headers={"HX-Redirect": self.url(path)})
        return RedirectResponse(self.url(path), 303)

    def url(self, path: str, **query: Any) -> str:
        """The address of a page, its path given in parts that need no quoting but for names."""
        asked = {key: value for key, value in query.items() if value not in (None, "", False)}
        return self.server.settings.prefix + path + (f"?{urlencode(asked)}" if asked else "")

    def audit(self, kind: str, subject: str, detail: str) -> None:
        """Write what the visitor has changed into the audit."""
        with self.database.writing() as session:
            note(session, kind, subject, detail, by=self.visitor.name, now=clock())


def download(content: str | bytes, name: str, media_type: str) -> Response:
    """A file that the browser stores."""
    headers = {"Content-Disposition": f'attachment; filename="{name}"'}
    return Response(content, headers=headers, media_type=media_type)
