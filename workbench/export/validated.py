"""What `workbench validate` has said of a design that is exported."""

from contextlib import suppress
from pathlib import Path
from typing import Any

from design.machine.design import Design
from design.machine.documents import design_digest
from identification.errors import BadModel
from workbench.documents.reading import read_document


def validation_line(found: Design, design_file: Path) -> str:
    """What the newest validation of this very design says that whoever puts it on a machine has to
    know; "" where it passed. Looked for beside its file and in the folders beside that one's."""
    folder = design_file.resolve().parent
    near = {*folder.glob("validation.json"), *folder.parent.glob("*/validation.json")}
    own = design_digest(found)
    for path in sorted(near, key=lambda one: one.stat().st_mtime, reverse=True):
        validation = dict[str, Any]()
        with suppress(BadModel):  # a file that may be anything
            validation = read_document(path)
        if validation.get("design") != own:
            continue
        if validation.get("passed"):
            return ""
        where = f"{path.parent.name}/{path.name}"
        return f"its validation did NOT pass ({where}): do not run it on the machine before it does"
    return "no validation of this design lies near it: workbench validate MODEL DESIGN checks it"
