"""What changes a machine: kept, promoted, rolled back; and its controllers as code."""

import io
import json
import zipfile
from datetime import UTC, datetime
from typing import Any

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from workbench.files import REPORT_FILE
from workbench.page import version_views
from workbench.page.dropped import card_of, log_of, refuse_machine, store_files
from workbench.page.pages import go, part, registry_of
from workbench.page.version_views import EXPORTS
from workbench.page.visitors import Visitor, changing, form_of, reading
from workbench.page.work import result_file
from workbench.registry.access import audit
from workbench.registry.bench import Bench
from workbench.registry.errors import BadRegistry
from workbench.registry.values import Candidate

LONGEST_REASON = 500


def add_machine(request: Request, visitor: Visitor) -> Response:
    """Keep what came of a dropped log as a machine with an active version."""
    settings, registry = request.app.state.settings, registry_of(request)
    task = Bench(registry.database).task(request.path_params["task"])
    machine, reason = _text(request, "machine"), _text(request, "reason")
    log, card = log_of(settings.root, task.upload), card_of(settings.root, task.upload)
    refuse_machine(settings.root, machine, card)
    made: dict[str, Any] = {"model": _read(request, "model")}
    for kind in ("design", "validation"):
        try:
            made[kind] = _read(request, kind)
        except HTTPException:
            made[kind] = None
    now = datetime.now(UTC)
    version = registry.add(machine, Candidate(**made), reason=reason, by=visitor.name, now=now)
    report = f"version-{version.number}-{task.kind}.html", result_file(request, REPORT_FILE)
    store_files(settings.root, machine, log, card, report)
    current = registry.active_version(machine)
    if current is None or current.number != version.number:
        registry.promote(machine, version.number, reason=reason, by=visitor.name, now=now)
    detail = f"version {version.number}, from {log.name}: {reason}"
    audit(registry.database, "machine_kept", machine, detail, by=visitor.name, now=now)
    return go(request, f"/machine/{part(machine)}")


def promote(request: Request, visitor: Visitor) -> Response:
    """Activate a version."""
    machine, number = request.path_params["machine"], _text(request, "number")
    if not number.isascii() or not number.isdigit():
        raise HTTPException(400, "Which version? Choose one.")
    reason, now, registry = _text(request, "reason"), datetime.now(UTC), registry_of(request)
    registry.promote(machine, int(number), reason=reason, by=visitor.name, now=now)
    detail = f"version {number}: {reason}"
    audit(registry.database, "promoted", machine, detail, by=visitor.name, now=now)
    return go(request, f"/machine/{part(machine)}")


def rollback(request: Request, visitor: Visitor) -> Response:
    """Activate the version before."""
    machine, reason = request.path_params["machine"], _text(request, "reason")
    now, registry = datetime.now(UTC), registry_of(request)
    decision = registry.rollback(machine, reason=reason, by=visitor.name, now=now)
    detail = f"version {decision.number}: {reason}"
    audit(registry.database, "rolled_back", machine, detail, by=visitor.name, now=now)
    return go(request, f"/machine/{part(machine)}")


def export(request: Request, _visitor: Visitor) -> Response:
    """A version's controller as code for its machine, packed."""
    target = request.query_params.get("to", "")
    if target not in EXPORTS:
        raise HTTPException(404, f"The target is one of {', '.join(EXPORTS)}.")
    machine, number = request.path_params["machine"], request.path_params["number"]
    registry = registry_of(request)
    design = registry.document(registry.version(machine, number), "design")
    files = request.app.state.helpers(version_views.export_files, json.dumps(design), target)
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    name = f"version-{number}-{target}.zip"
    headers = {"Content-Disposition": f'attachment; filename="{name}"'}
    return Response(packed.getvalue(), headers=headers, media_type="application/zip")


def _read(request: Request, kind: str) -> Any:
    return json.loads(result_file(request, f"{kind}.json").read_text("utf-8"))


def _text(request: Request, name: str) -> str:
    found = " ".join(str(form_of(request).get(name, "")).split())[:LONGEST_REASON]
    if not found:
        raise BadRegistry(f"the {name} is missing; say it in a few words")
    return found


ACTION_ROUTES = [
    Route("/work/{task:int}/keep", changing(add_machine), methods=["POST"]),
    Route("/machine/{machine}/promote", changing(promote), methods=["POST"]),
    Route("/machine/{machine}/rollback", changing(rollback), methods=["POST"]),
    Route("/machine/{machine}/version/{number:int}/export", reading(export)),
]
