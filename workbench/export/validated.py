"""What `workbench validate` has said of a design: read from the validations that lie near it."""

import json
from pathlib import Path

from workbench.documents.design import Design
from workbench.documents.design_file import design_digest
from workbench.files import RESULT_BYTES


def validation_line(found: Design, design_file: Path) -> str:
    """What the newest validation of this very design says that whoever puts it on a machine has to
    know; "" where it passed. Looked for beside its file and in the folders beside that one's."""
    folder = design_file.resolve().parent
    near = {*folder.glob("validation.json"), *folder.parent.glob("*/validation.json")}
    own = design_digest(found)
    for path in sorted(near, key=lambda one: one.stat().st_mtime, reverse=True):
        validation = _read(path)
        if validation.get("design") != own:
            continue
        if validation.get("passed"):
            return ""
        where = f"{path.parent.name}/{path.name}"
        return f"its validation did NOT pass ({where}): do not run it on the machine before it does"
    return "no validation of this design lies near it: workbench validate MODEL DESIGN checks it"


def _read(path: Path) -> dict[str, object]:
    """A file that may be anything."""
    try:
        if path.stat().st_size > RESULT_BYTES:
            return {}
        found = json.loads(path.read_text("utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}
