"""What `workbench validate` has said of a design: read from the validations that lie near it."""

import hashlib
import json
from pathlib import Path

from workbench.files import RESULT_BYTES


def of_design(design_file: Path) -> dict[str, str]:
    """How a validation names the design that it is of."""
    digest = hashlib.sha256(design_file.read_bytes()).hexdigest()
    return {"file": design_file.name, "sha256": digest}


def validation_line(design_file: Path) -> str:
    """What the newest validation of this very file says that whoever puts it on a machine has to
    know; "" where it passed. Looked for beside the design and in the folders beside its own."""
    folder = design_file.resolve().parent
    near = {*folder.glob("validation.json"), *folder.parent.glob("*/validation.json")}
    own = of_design(design_file)["sha256"]
    for path in sorted(near, key=lambda one: one.stat().st_mtime, reverse=True):
        found = _read(path)
        named = found.get("design")
        if not (isinstance(named, dict) and named.get("sha256") == own):
            continue
        if found.get("passed"):
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
