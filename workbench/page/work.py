"""Work on a dropped log: asked for, watched, cancelled, what came of it, and kept as a machine."""

import base64
import hashlib
import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args

from starlette.exceptions import HTTPException
from starlette.responses import FileResponse, Response
from starlette.routing import Route

from design.judgement import Candidate
from workbench.files import REPORT_FILE
from workbench.jobs.options import clock
from workbench.page.asked import Asked, part
from workbench.page.dropped import CHARTS_FILE, RESULT_FILE, refuse_machine, store_files
from workbench.page.visitors import changing, reading
from workbench.registry.tables import TaskRow
from workbench.registry.values import TaskKind

GIVEN_OUT = ("model.json", "trace.json", "design.json", "validation.json")
NO_SOURCE = "'none'"
_SCRIPT = re.compile(r"<script>(.*?)</script>", re.DOTALL)


@dataclass(frozen=True)
class Shown:
    """A task as the page shows it; result: what came of it, where it is done."""

    task: TaskRow
    result: dict[str, Any] | None = None
    files: Sequence[str] = ()


def task(asked: Asked) -> Response:
    """One task, which is asked for again while it is under way."""
    return asked.show("task", one=_shown(asked, asked.bench.task(asked["task"])))


def ask(asked: Asked) -> Response:
    """A new task; nothing where the same is under way."""
    upload, kind = asked["upload"], asked.given("kind")
    if kind not in get_args(TaskKind):
        raise HTTPException(400, "The work is identify or trace.")
    if not asked.drop.card.exists():
        raise HTTPException(400, "The card does not read the log yet; correct it first.")
    asked.bench.ask(upload, kind, by=asked.visitor.name, now=clock())
    if asked.by_htmx:
        return asked.show("tasks", tasks=shown_tasks(asked, upload), upload_id=upload)
    return asked.go(f"/drop/{upload}")


def cancel(asked: Asked) -> Response:
    """Cancel a task; its worker stops at its next check."""
    found = asked.bench.cancel(asked["task"], by=asked.visitor.name, now=clock())
    if asked.by_htmx:
        return asked.show("task", one=_shown(asked, found))
    return asked.go(f"/drop/{found.upload}")


def charts(asked: Asked) -> Response:
    """The charts of a task that is done."""
    html = _result(asked, CHARTS_FILE).read_text("utf-8")
    return asked.show("chart", html=html, said="")


def report(asked: Asked) -> Response:
    """The report of the command, in a sandbox: its scripts may run, and reach nothing of ours."""
    return report_response(_result(asked, REPORT_FILE).read_text("utf-8"))


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


def document(asked: Asked) -> Response:
    """A document of a task that is done."""
    name = asked["name"]
    if name not in GIVEN_OUT:
        raise HTTPException(404, "No such file.")
    return FileResponse(_result(asked, name), filename=name, media_type="application/json")


def keep(asked: Asked) -> Response:
    """Keep what came of a dropped log as a machine with an active version."""
    registry, task = asked.registry, asked.bench.task(asked["task"])
    machine, reason = asked.text("machine"), asked.text("reason")
    files, by = asked.drop_of(task.upload), asked.visitor.name
    log, card = files.log, files.card
    refuse_machine(asked.root, machine, card)
    model = json.loads(_result(asked, "model.json").read_text("utf-8"))
    design, validation = (
        json.loads(path.read_text("utf-8")) if path.exists() else None
        for path in (files.results(task.id) / f"{kind}.json" for kind in ("design", "validation"))
    )
    candidate, now = Candidate(model, design, validation), clock()
    version = registry.add(machine, candidate, reason=reason, by=by, now=now)
    stored = f"version-{version.number}-{task.kind}.html", _result(asked, REPORT_FILE)
    store_files(asked.root, machine, log, card, stored)
    current = registry.active_version(machine)
    if current is None or current.number != version.number:
        registry.promote(machine, version.number, reason=reason, by=by, now=now)
    asked.audit("machine_kept", machine, f"version {version.number}, from {log.name}: {reason}")
    return asked.go(f"/machine/{part(machine)}")


def shown_tasks(asked: Asked, upload: str) -> list[Shown]:
    """The tasks of an upload, the newest first, with what came of them."""
    return [_shown(asked, one) for one in reversed(asked.bench.tasks(upload))]


def _shown(asked: Asked, one: TaskRow) -> Shown:
    folder = asked.drop_of(one.upload).results(one.id)
    place = folder / RESULT_FILE
    if one.state != "done" or not place.exists():
        return Shown(one)
    files = [name for name in GIVEN_OUT if (folder / name).exists()]
    return Shown(one, json.loads(place.read_text("utf-8")), files)


def _result(asked: Asked, name: str) -> Path:
    """A file of what came of the task that the address names."""
    found = asked.bench.task(asked["task"])
    path = asked.drop_of(found.upload).results(found.id) / name
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
    Route("/work/{task:int}/keep", changing(keep), methods=["POST"]),
]
