"""A machine: parameters over time as charts, what was decided and why, alarms, logs, versions,
reports."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, get_args

import numpy as np
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from identification.arrays import Array
from identification.errors import UserError
from workbench.page import version_views
from workbench.page.pages import registry_of, show
from workbench.page.version_views import EXPORTS
from workbench.page.visitors import Visitor, briefly, reading
from workbench.page.work import report_response
from workbench.registry.difference import difference
from workbench.registry.results import TestedLog, condition, last_logs, log_count, newest_lights
from workbench.registry.values import ALARMING, Kind
from workbench.report.chart import Area, Chart, Line, Panel, chart_html

LAST_LOGS, MORE_LOGS = 60, 1000
LAST_CHANGES = 200


def machine(request: Request, visitor: Visitor) -> Response:
    """The page of a machine."""
    registry, name = registry_of(request), request.path_params["machine"]
    state = registry.machine(name)
    versions = registry.versions(name)
    last = MORE_LOGS if request.query_params.get("logs") == "all" else LAST_LOGS
    logs = last_logs(registry.database, name, last)
    current = state.in_force.number if state.in_force else None
    tested, lights = newest_lights(logs[:LAST_LOGS])
    other = next((v.number for v in reversed(versions) if v.number != current), None)
    return show(
        request, visitor, "machine", title=name, state=state, versions=list(reversed(versions)),
        decisions=list(reversed(registry.decisions(name))), logs=logs, other=other,
        alarms=[one for one in logs if one.verdict in ALARMING], exports=EXPORTS,
        condition=condition(registry.database, name), total=log_count(registry.database, name),
        reports=[path.name for path in _reports(request)], charts=_charts(logs),
        tested=tested, lights=lights,
    )  # fmt: skip


def compare(request: Request, visitor: Visitor) -> Response:
    """Two versions side by side: every number, the margins, the step responses."""
    registry, name = registry_of(request), request.path_params["machine"]
    numbers = [request.query_params.get(key, "") for key in ("a", "b")]
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
        loops = request.app.state.helpers(version_views.loops, designs[: len(set(numbers))])
    except UserError as error:
        return show(request, visitor, "said", said=str(error), bad=True)
    lines = difference(before, after)
    return show(request, visitor, "compare", lines=lines, numbers=numbers, loops=loops)


def report(request: Request, _visitor: Visitor) -> Response:
    """The report of a version's design."""
    registry = registry_of(request)
    version = registry.version(request.path_params["machine"], request.path_params["number"])
    design = json.dumps(registry.document(version, "design"))
    return report_response(request.app.state.helpers(version_views.design_page, design))


def stored_page(request: Request, _visitor: Visitor) -> Response:
    """A report in the machine's folder."""
    registry_of(request).machine(request.path_params["machine"])
    for path in _reports(request):
        if path.name == request.path_params["file"]:
            return report_response(path.read_text("utf-8"))
    raise HTTPException(404, "No such report.")


def document(request: Request, _visitor: Visitor) -> Response:
    """A version's document as it is."""
    registry, kind = registry_of(request), request.path_params["kind"]
    if kind not in get_args(Kind):
        raise HTTPException(404, "No such document.")
    number = request.path_params["number"]
    version = registry.version(request.path_params["machine"], number)
    found = json.dumps(registry.document(version, kind), indent=2)
    headers = {"Content-Disposition": f'attachment; filename="{kind}-{number}.json"'}
    return Response(found, headers=headers, media_type="application/json")


def changes(request: Request, visitor: Visitor) -> Response:
    """The last changes that somebody made through the page, or of its tokens."""
    found = request.app.state.access.audited(last=LAST_CHANGES)
    return show(request, visitor, "changes", title="Changes", changes=found)


def _charts(logs: Sequence[TestedLog]) -> str:
    shown = list(reversed(logs[:LAST_LOGS]))
    return "".join(str(chart_html(one)) for one in parameter_charts(shown))


def _reports(request: Request) -> list[Path]:
    root: Path = request.app.state.settings.root
    name = request.path_params["machine"]
    if name in (".", "..") or "/" in name or "\0" in name:
        return []
    return sorted((root / name / "reports").glob("*.html"))


MACHINE_ROUTES = [
    Route("/audit", reading(changes)),
    Route("/machine/{machine}", reading(briefly(machine))),
    Route("/machine/{machine}/compare", reading(compare)),
    Route("/machine/{machine}/report/{file}", reading(stored_page)),
    Route("/machine/{machine}/version/{number:int}/report", reading(report)),
    Route("/machine/{machine}/version/{number:int}/{kind}.json", reading(document)),
]


MOST_PARAMETERS = 8
FEWEST_LOGS = 2
PARAMETER_HEIGHT = 190
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
    names = sorted(found, key=lambda name: -_moved(found[name]))
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

    unit = str(history[int(at[0])].get("unit", ""))
    return Panel(
        label, f"{name} [{unit}]",
        [Line("active model", place, column("before"), "reference", "dashed"),
         Line("by each log", place, column("after"), "measured")],
        areas=[Area("95 %", place, column("low"), column("high"), "band")], height=PARAMETER_HEIGHT,
    )  # fmt: skip


def _moved(history: Mapping[int, Mapping[str, Any]]) -> float:
    last = history[max(history)]
    change, sd = abs(float(last.get("change") or 0.0)), float(last.get("sd") or 0.0)
    return change / sd if sd > 0.0 else 0.0


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
