"""The templates and their filters: every text of a log, a card or a file is escaped on its way."""

import math
from datetime import UTC, datetime
from functools import cache
from urllib.parse import quote

from jinja2 import Environment
from markupsafe import Markup, escape

from workbench.cards.readable import number as written
from workbench.output import templates
from workbench.steps.axis_limits import LEAST_ROOM
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
