"""A model and a design as documents: plain values, every parameter with its unit."""

import hashlib
import json
from typing import Any

from design.machine.codec import Around, Command, written
from design.machine.design import Design
from design.machine.model import Model
from design.machine.readable import Display
from identification.log import Rig
from identification.model.karnopp import NAMES


def design_document(found: Design) -> dict[str, Any]:
    """The design as design.json writes it, the schema first, every parameter with its unit."""
    document = written(found, Around(found.display, found.command, found.output))
    return {"schema": document.pop("schema"), **document}


def design_digest(found: Design) -> str:
    """By what a validation names the design that it is of: the SHA-256 of its content."""
    text = json.dumps(design_document(found), sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()


def model_document(model: Model) -> dict[str, Any]:
    """The model as model.json writes it: the schema first, one entry an estimate."""
    document = written(model, around_of(model.rig))
    document["friction"] = {name: document["friction"][name] for name in NAMES}
    return {"schema": document.pop("schema"), **document}


def around_of(rig: Rig) -> Around:
    """What the written form of a rig's controller hangs on."""
    return Around(Display.of(rig), Command(rig.command_unit, rig.control_limit, None))
