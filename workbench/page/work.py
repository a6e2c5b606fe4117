"""Work on a dropped log: asked for, watched, cancelled, and what came of it."""

import base64
import hashlib
import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import FileResponse, Response
from starlette.routing import Route

from workbench.files import REPORT_FILE
from workbench.page.dropped import (
    CHARTS_FILE,
    RESULT_FILE,
    card_of,
    results_of,
)
from workbench.page.pages import go, show
from workbench.page.visitors import Visitor, changing, form_of, reading
from workbench.registry.bench import Bench, WorkItem
from workbench.registry.values import TaskKind

KINDS_OF_WORK: dict[str, TaskKind] = {"identify": "identify", "trace": "trace"}
GIVEN_OUT = ("model.json", "trace.json", "design.json", "validation.json")
NO_SOURCE = "'none'"
_SCRIPT = re.compile(r"<script>(.*?)</script>", re.DOTALL)


@dataclass(frozen=True)
class Shown:
    """A task as the page shows it; result: what came of it, where it is done."""

    task: WorkItem
    result: dict[str, Any] | None = None
    files: Sequence[str] = ()


def task(request: Request, visitor: Visitor) -> Response:
    """One task, which is asked for again while it is under way."""
    found = Bench(request.app.state.registry.database).task(request.path_params["task"])
    return _task(request, visitor, found)


def ask(request: Request, visitor: Visitor) -> Response:
    """A new task; nothing where the same is under way."""
    upload = request.path_params["upload"]
    kind = KINDS_OF_WORK.get(str(form_of(request).get("kind", "")))
    if kind is None:
        raise HTTPException(400, "The work is identify or trace.")
    if not card_of(request.app.state.settings.root, upload).exists():
        raise HTTPException(400, "The card does not read the log yet; correct it first.")
    Bench(request.app.state.registry.database).ask(
        upload, kind, by=visitor.name, now=datetime.now(UTC)
    )
    if request.headers.get("hx-request"):
        return _tasks(request, visitor, upload)
    return go(request, f"/drop/{upload}")


def cancel(request: Request, visitor: Visitor) -> Response:
    """Cancel a task; its worker stops at its next look."""
    bench = Bench(request.app.state.registry.database)
    found = bench.cancel(request.path_params["task"], by=visitor.name, now=datetime.now(UTC))
    if request.headers.get("hx-request"):
        return _task(request, visitor, found)
    return go(request, f"/drop/{found.upload}")


def charts(request: Request, visitor: Visitor) -> Response:
    """The charts of a task that is done."""
    path = result_file(request, CHARTS_FILE)
    return show(request, visitor, "chart", html=path.read_text("utf-8"), said="")


def report(request: Request, _visitor: Visitor) -> Response:
    """The report of the command, in a sandbox: its scripts may run, and reach nothing of ours."""
    return report_response(result_file(request, REPORT_FILE).read_text("utf-8"))


def report_response(html: str) -> Response:
    """A report of ours, that may run the scripts that it carries and nothing else."""
    hashes = " ".join(
        f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"
        for text in _SCRIPT.findall(html)
    )
    policy = (
        f"sandbox allow-scripts; default-src 'none'; script-src {hashes or NO_SOURCE};"
        " style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'"
    )
    return Response(html, headers={"Content-Security-Policy": policy}, media_type="text/html")


def document(request: Request, _visitor: Visitor) -> Response:
    """A document of a task that is done."""
    name = request.path_params["name"]
    if name not in GIVEN_OUT:
        raise HTTPException(404, "No such file.")
    return FileResponse(result_file(request, name), filename=name, media_type="application/json")


def _tasks(request: Request, visitor: Visitor, upload: str) -> Response:
    found = shown_tasks(request, upload)
    return show(request, visitor, "tasks", tasks=found, upload_id=upload)


def _task(request: Request, visitor: Visitor, found: WorkItem) -> Response:
    return show(request, visitor, "task", one=_shown(request, found))


def shown_tasks(request: Request, upload: str) -> list[Shown]:
    """The tasks of an upload, the newest first, with what came of them."""
    found = Bench(request.app.state.registry.database).tasks(upload)
    return [_shown(request, one) for one in reversed(found)]


def _shown(request: Request, one: WorkItem) -> Shown:
    folder = results_of(request.app.state.settings.root, one.upload, one.id)
    place = folder / RESULT_FILE
    if one.state != "done" or not place.exists():
        return Shown(one)
    files = [name for name in GIVEN_OUT if (folder / name).exists()]
    return Shown(one, json.loads(place.read_text("utf-8")), files)


def result_file(request: Request, name: str) -> Path:
    """A file of what came of the task that the address names."""
    found = Bench(request.app.state.registry.database).task(request.path_params["task"])
    path = results_of(request.app.state.settings.root, found.upload, found.id) / name
    if found.state != "done" or not path.exists():
        raise HTTPException(404, f"Task {found.id} has no {name}.")
    return path


WORK_ROUTES = [
    Route("/drop/{upload}/work", changing(ask), methods=["POST"]),
    Route("/work/{task:int}", reading(task)),
    Route("/work/{task:int}/cancel", changing(cancel), methods=["POST"]),
    Route("/work/{task:int}/charts", reading(charts)),
    Route("/work/{task:int}/report", reading(report)),
    Route("/work/{task:int}/file/{name}", reading(document)),
]
