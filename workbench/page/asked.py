"""A request as the page's functions take it: who asks, what the server has, and how to answer; the
templates and their filters: every text of a log, a card or a file is escaped on its way."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any
from urllib.parse import quote, urlencode

from jinja2 import Environment
from markupsafe import Markup, escape
from starlette.requests import Request
from starlette.responses import HTMLResponse, RedirectResponse, Response

from design.machine.readable import number as written
from design.measured.axis_limits import LEAST_ROOM
from workbench.jobs.options import clock
from workbench.output import templates
from workbench.page.dropped import Drop
from workbench.page.helpers import Helpers
from workbench.page.settings import PageSettings
from workbench.registry.access import note
from workbench.registry.bench import Bench
from workbench.registry.database import Database
from workbench.registry.store import Registry
from workbench.registry.values import BadRegistry, Role
from workbench.verdicts import in_words

STATE_WORDS = {
    "in_tune": "in tune",
    "drifting": "drift",
    "structure": in_words("structure"),
    "log_bad": f"log {in_words('set_aside')}",
    "not_judged": in_words("not_judged"),
    "no_log": "no log yet",
    "silent": "not heard from",
}
SPARK_WIDTH, SPARK_HEIGHT, SPARK_EDGE = 96.0, 22.0, 2.0


def part(name: str) -> str:
    """A name as one part of an address."""
    return quote(name, safe="")


@cache
def environment() -> Environment:
    """The templates, with the filters that they use."""
    out = templates("workbench.page")
    out.filters.update(
        ago=ago, moment=moment, number=number, percent=percent, part=part, spark=spark,
        words=lambda state: STATE_WORDS.get(state) or in_words(state), megabytes=megabytes,
    )  # fmt: skip
    return out


def moment(at: datetime | None) -> str:
    """A moment in UTC, to the minute."""
    return "–" if at is None else f"{at.astimezone(UTC):%Y-%m-%d %H:%M}"


def ago(at: datetime | None) -> str:
    """How long ago, in the largest unit that shows it."""
    if at is None:
        return "never"
    seconds = max((datetime.now(UTC) - at).total_seconds(), 0.0)
    for size, unit in ((86400.0, "d"), (3600.0, "h"), (60.0, "min")):
        if seconds >= size:
            return f"{seconds / size:.0f} {unit} ago"
    return "just now"


def number(value: float | None, digits: int = 4) -> str:
    """A number to so many digits, or a dash."""
    if value is None or not math.isfinite(value):
        return "–"
    return f"{value:.{digits}g}".replace("-", "−")


def percent(value: float | None) -> str:
    """A relative change with its sign."""
    if value is None or not math.isfinite(value):
        return "–"
    sign = "+" if value > 0 else ""
    return f"{sign}{written(100.0 * value, 2)} %".replace("-", "−")


def megabytes(size: int) -> str:
    """A size that a person reads."""
    return f"{size / 1e6:.1f} MB" if size >= 1e6 else f"{size / 1e3:.1f} kB"


def spark(values: list[float], said: str) -> Markup:
    """Values as a small line with its last point, in their own range, or that of a change which
    does not matter; said: what it is."""
    if len(values) < 2:
        return Markup("")
    low, high = min(values), max(values)
    room = LEAST_ROOM * max(abs(low), abs(high)) - 0.5 * (high - low)
    low, high = low - max(room, 0.0), high + max(room, 0.0)
    span = high - low or 1.0
    step = (SPARK_WIDTH - 2 * SPARK_EDGE) / (len(values) - 1)
    height = SPARK_HEIGHT - 2 * SPARK_EDGE
    at = [
        (SPARK_EDGE + k * step, SPARK_EDGE + height * (1.0 - (value - low) / span))
        for k, value in enumerate(values)
    ]
    points = " ".join([f"{x:.1f},{y:.1f}" for x, y in at])
    return Markup(
        f'<svg class="spark" viewBox="0 0 {SPARK_WIDTH:g} {SPARK_HEIGHT:g}" role="img"'
        f' aria-label="{escape(said)}"><polyline points="{points}"/>'
        f'<circle cx="{at[-1][0]:.1f}" cy="{at[-1][1]:.1f}" r="2"/></svg>'
    )


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
    """What every answer is made with; helpers: processes for heavy evaluations of logs."""

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
