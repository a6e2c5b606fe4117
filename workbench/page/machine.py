"""The fleet, a line a machine; and a machine: parameters over time as charts, what was decided and
why, alarms, logs, versions, reports; what changes it, and its controllers as code."""

import io
import json
import zipfile
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, get_args

import numpy as np
from starlette.exceptions import HTTPException
from starlette.responses import Response
from starlette.routing import Route

from design.judgement import ALARMING
from design.machine.difference import as_read, difference
from design.machine.readable import shown_unit
from design.measured.axis_lights import newest_lights
from identification.arrays import Array
from identification.errors import UserError
from workbench.jobs.options import clock
from workbench.page import inspection
from workbench.page.asked import STATE_WORDS, Asked, download, part
from workbench.page.inspection import EXPORTS
from workbench.page.visitors import cached, changing, reading
from workbench.page.work import report_response
from workbench.registry.access import Access
from workbench.registry.overview import FLEET_ORDERS, INTERVAL_DEVIATIONS, FleetAsked, fleet_page
from workbench.registry.results import TestedLog, condition, last_logs
from workbench.registry.values import Kind, Version
from workbench.report.chart import Area, Chart, Line, Panel, chart_html

LAST_LOGS, MORE_LOGS = 60, 1000
LAST_CHANGES = 200


def machine(asked: Asked) -> Response:
    registry, name = asked.registry, asked["machine"]
    state = registry.machine(name)
    versions = registry.versions(name)
    last = MORE_LOGS if asked.query("logs") == "all" else LAST_LOGS
    logs = last_logs(asked.database, name, last)
    current = state.in_force.number if state.in_force else None
    accepted = registry.accepted_version(name)
    sound = last_logs(asked.database, name, LAST_LOGS, sound=True)
    axis = newest_lights(logs[:LAST_LOGS], sound, accepted.number if accepted else None)
    other = next((v.number for v in reversed(versions) if v.number != current), None)
    drawn = parameter_charts(list(reversed(logs[:LAST_LOGS])))
    return asked.show(
        "machine", title=name, state=state, versions=list(reversed(versions)),
        decisions=list(reversed(registry.decisions(name))), logs=logs, other=other,
        alarms=[one for one in logs if one.verdict in ALARMING], exports=EXPORTS,
        condition=condition(asked.database, name), total=state.logs,
        reports=[path.name for path in _reports(asked)], axis=axis, accepted=accepted,
        charts="".join(str(chart_html(one)) for one in drawn),
    )  # fmt: skip


def compare(asked: Asked) -> Response:
    """Two versions side by side: every number, the margins, the step responses."""
    registry, name = asked.registry, asked["machine"]
    numbers = [asked.query(key) for key in ("a", "b")]
    if not all(text.isascii() and text.isdigit() for text in numbers):
        raise HTTPException(400, "Choose two versions.")
    versions = [registry.version(name, int(text)) for text in numbers]
    before, after = (registry.documents(one) for one in versions)
    designs = [
        (one.number, json.dumps(found["design"]))
        for one, found in zip(versions, (before, after), strict=True)
        if found["design"] is not None
    ]
    try:
        loops = asked.server.helpers(inspection.loops, designs[: len(set(numbers))])
    except UserError as error:
        return asked.show("said", said=str(error), bad=True)
    names = (f"version {numbers[0]}", f"version {numbers[1]}")
    lines, said = as_read(difference(before, after), names)
    return asked.show("compare", lines=lines, said=said, numbers=numbers, loops=loops)


def report(asked: Asked) -> Response:
    design = json.dumps(asked.registry.document(_version(asked), "design"))
    return report_response(asked.server.helpers(inspection.design_page, design))


def stored_page(asked: Asked) -> Response:
    """A report in the machine's folder."""
    asked.registry.machine(asked["machine"])
    for path in _reports(asked):
        if path.name == asked["file"]:
            return report_response(path.read_text("utf-8"))
    raise HTTPException(404, "No such report.")


def document(asked: Asked) -> Response:
    kind = asked["kind"]
    if kind not in get_args(Kind):
        raise HTTPException(404, "No such document.")
    found = json.dumps(asked.registry.document(_version(asked), kind), indent=2)
    return download(found, f"{kind}-{asked['number']}.json", "application/json")


def export(asked: Asked) -> Response:
    """A version's controller as code for its machine, packed."""
    target = asked.query("to")
    if target not in EXPORTS:
        raise HTTPException(404, f"The target is one of {', '.join(EXPORTS)}.")
    design = json.dumps(asked.registry.document(_version(asked), "design"))
    files = asked.server.helpers(inspection.export_files, design, target)
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    name = f"version-{asked['number']}-{target}.zip"
    return download(packed.getvalue(), name, "application/zip")


def promote(asked: Asked) -> Response:
    number = asked.text("number")
    if not number.isascii() or not number.isdigit():
        raise HTTPException(400, "Which version? Choose one.")
    name, reason, by = asked["machine"], asked.text("reason"), asked.visitor.name
    asked.registry.promote(name, int(number), reason=reason, by=by, now=clock())
    asked.audit("promoted", name, f"version {number}: {reason}")
    return asked.go(f"/machine/{part(name)}")


def rollback(asked: Asked) -> Response:
    """Activate the version before."""
    name, reason, by = asked["machine"], asked.text("reason"), asked.visitor.name
    decision = asked.registry.rollback(name, reason=reason, by=by, now=clock())
    asked.audit("rolled_back", name, f"version {decision.number}: {reason}")
    return asked.go(f"/machine/{part(name)}")


def changes(asked: Asked) -> Response:
    """The last changes that somebody made through the page, or of its tokens."""
    found = Access(asked.database).audited(LAST_CHANGES)
    return asked.show("changes", title="Changes", changes=found)


def _version(asked: Asked) -> Version:
    return asked.registry.version(asked["machine"], asked["number"])


def _reports(asked: Asked) -> list[Path]:
    name = asked["machine"]
    if name in (".", "..") or "/" in name or "\0" in name:
        return []
    return sorted((asked.root / name / "reports").glob("*.html"))


MACHINE_ROUTES = [
    Route("/audit", reading(changes)),
    Route("/machine/{machine}", reading(cached(machine))),
    Route("/machine/{machine}/compare", reading(compare)),
    Route("/machine/{machine}/promote", changing(promote), methods=["POST"]),
    Route("/machine/{machine}/report/{file}", reading(stored_page)),
    Route("/machine/{machine}/rollback", changing(rollback), methods=["POST"]),
    Route("/machine/{machine}/version/{number:int}/export", reading(export)),
    Route("/machine/{machine}/version/{number:int}/report", reading(report)),
    Route("/machine/{machine}/version/{number:int}/{kind}.json", reading(document)),
]


MOST_PARAMETERS = 8
FEWEST_LOGS = 2
PARAMETER_HEIGHT = 190
STEP_WIDTH = 1e-6  # of the time that the chart shows
SPANS = ((86400.0, "days"), (3600.0, "hours"), (60.0, "minutes"), (1.0, "seconds"))


def parameter_charts(logs: Sequence[TestedLog]) -> list[Chart]:
    """The parameters that the logs identify, the one that moved most first; none of a single log.

    logs: the oldest first.
    """
    history = [one for one in logs if one.parameters]
    if len(history) < FEWEST_LOGS:
        return []
    x, label = _times([one.recorded_at for one in history])
    found: dict[str, dict[int, Mapping[str, Any]]] = {}
    for k, one in enumerate(history):
        for parameter in one.parameters:
            found.setdefault(str(parameter["name"]), {})[k] = parameter
    names = sorted(found, key=lambda name: _moved(found[name]), reverse=True)
    panels = [_panel(name, found[name], x, label) for name in names[:MOST_PARAMETERS]
              if len(found[name]) >= FEWEST_LOGS]  # fmt: skip
    return [Chart("parameters", "parameters over the last logs", panels, columns=2)]


def _panel(name: str, history: Mapping[int, Mapping[str, Any]], x: Array, label: str) -> Panel:
    at = np.array(sorted(history))
    place = x[at]

    def column(key: str) -> Array:
        return np.array(
            [np.nan if history[k].get(key) is None else history[k][key] for k in at], float
        )

    unit, factor = shown_unit(str(history[int(at[0])].get("unit", "")))
    before, after, low, high = (factor * column(key) for key in ("before", "after", "low", "high"))
    # Each log was tested against the model that is active since the log before it; a step has two
    # places, since the chart draws one value at each.
    steps = np.repeat(place, 2)[:-1]
    steps[1::2] += STEP_WIDTH * (place[-1] - place[0])
    return Panel(
        label, f"{name} [{unit}]",
        [Line("active model", steps, np.repeat(before, 2)[1:], "reference", "dashed"),
         Line("by each log", place, after, "measured", "dots")],
        areas=[Area("95 %", place, low, high, "band")], height=PARAMETER_HEIGHT,
    )  # fmt: skip


def _moved(history: Mapping[int, Mapping[str, Any]]) -> tuple[float, float]:
    """How far a parameter has gone from its first active value beyond the log's interval, at most;
    of those within it, how near they came to its edge."""
    first = float(history[min(history)].get("before") or 0.0)
    gone = [(abs(float(one["after"]) / first - 1.0) if first else 0.0, float(one.get("sd") or 0.0))
            for one in history.values()]  # fmt: skip
    beyond = max(change - INTERVAL_DEVIATIONS * sd for change, sd in gone)
    return max(beyond, 0.0), max(change / sd if sd > 0.0 else 0.0 for change, sd in gone)


def _times(seconds: Sequence[float]) -> tuple[Array, str]:
    """When the logs were recorded, back from the last one; their numbers where times do not say.

    Equal times are set apart by a little, so that no log hides another.
    """
    at = np.array(seconds) - seconds[-1]
    span = -float(at[0])
    if span <= 0.0 or np.any(np.diff(at) < 0.0):
        return np.arange(1.0, len(seconds) + 1.0), "log"
    size, unit = next((one for one in SPANS if span > 2.0 * one[0]), SPANS[-1])
    return at / size + 1e-6 * np.arange(len(at)), f"{unit} before the last log"


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


FLEET_ROUTES = [Route("/", reading(cached(fleet)))]
