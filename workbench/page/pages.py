"""Templates into answers: every text of a log, a card or a file is escaped on its way."""

import math
from collections.abc import Mapping
from datetime import UTC, datetime
from functools import cache
from typing import Any
from urllib.parse import quote, urlencode

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape
from starlette.requests import Request
from starlette.responses import HTMLResponse, RedirectResponse, Response

from workbench.page.visitors import Visitor
from workbench.registry.store import Registry

STATE_WORDS = {
    "in_tune": "in tune",
    "drifting": "drifting",
    "structure": "structure changed",
    "log_bad": "log bad",
    "not_judged": "inconclusive",
    "no_log": "no log yet",
    "silent": "not heard from",
}
SPARK_WIDTH, SPARK_HEIGHT, SPARK_EDGE = 96.0, 22.0, 2.0


def show(
    request: Request, visitor: Visitor, template: str, *, status: int = 200, **values: Any
) -> Response:
    """The template `<template>.html.j2` as an answer; `url` in it knows the prefix."""
    filled = environment().get_template(f"{template}.html.j2")
    prefix = request.app.state.settings.prefix
    text = filled.render(
        visitor=visitor, url=lambda path, **query: address_of(prefix, path, query), **values,
    )  # fmt: skip
    return HTMLResponse(text, status)


def registry_of(request: Request) -> Registry:
    """The registry that the page is of."""
    found: Registry = request.app.state.registry
    return found


def go(request: Request, path: str, **query: Any) -> Response:
    """Send the browser to another page, by htmx too."""
    to = address_of(request.app.state.settings.prefix, path, query)
    if request.headers.get("hx-request"):
        return Response(status_code=204, headers={"HX-Redirect": to})
    return RedirectResponse(to, 303)


def address_of(prefix: str, path: str, query: Mapping[str, Any]) -> str:
    """The address of a page, its path given in parts that need no quoting but for names."""
    asked = {key: value for key, value in query.items() if value not in (None, "", False)}
    return prefix + path + (f"?{urlencode(asked)}" if asked else "")


def part(name: str) -> str:
    """A name as one part of an address."""
    return quote(name, safe="")


@cache
def environment() -> Environment:
    """The templates, with the filters that they use."""
    out = Environment(
        loader=PackageLoader("workbench.page"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    out.filters.update(
        ago=ago, moment=moment, number=number, percent=percent, part=part, spark=spark,
        words=lambda state: STATE_WORDS.get(state, state.replace("_", " ")), megabytes=megabytes,
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
    return f"{100.0 * value:+.2g} %".replace("-", "−")


def megabytes(size: int) -> str:
    """A size that a person reads."""
    return f"{size / 1e6:.1f} MB" if size >= 1e6 else f"{size / 1e3:.1f} kB"


def spark(values: list[float], said: str) -> Markup:
    """Values as a small line with its last point, in their own range; said: what it is."""
    if len(values) < 2:
        return Markup("")
    low, high = min(values), max(values)
    span = high - low or abs(high) or 1.0
    step = (SPARK_WIDTH - 2 * SPARK_EDGE) / (len(values) - 1)
    room = SPARK_HEIGHT - 2 * SPARK_EDGE
    at = [
        (SPARK_EDGE + k * step, SPARK_EDGE + room * (1.0 - (value - low) / span))
        for k, value in enumerate(values)
    ]
    points = " ".join([f"{x:.1f},{y:.1f}" for x, y in at])
    return Markup(
        f'<svg class="spark" viewBox="0 0 {SPARK_WIDTH:g} {SPARK_HEIGHT:g}" role="img"'
        f' aria-label="{escape(said)}"><polyline points="{points}"/>'
        f'<circle cx="{at[-1][0]:.1f}" cy="{at[-1][1]:.1f}" r="2"/></svg>'
    )
