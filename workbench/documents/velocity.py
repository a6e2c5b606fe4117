"""Model and design of a rig whose velocity follows the command, as they are written and read."""

from pathlib import Path

from design.machine.velocity import VelocityDesign, VelocityModel
from identification.errors import BadModel
from workbench.documents.reading import read_document, read_result

VELOCITY_MODEL = "velocity-model/1"
VELOCITY_DESIGN = "velocity-design/1"


def is_velocity_model(path: Path) -> bool:
    """Whether the file holds a model of such a rig; False too where it is no result at all."""
    try:
        return read_document(path).get("schema") == VELOCITY_MODEL
    except BadModel:
        return False


def read_velocity_model(path: Path) -> VelocityModel:
    """The model in the file; raises BadModel in one line where it is none."""
    return read_result(path, VelocityModel, VELOCITY_MODEL)


def read_velocity_design(path: Path) -> VelocityDesign:
    """The design in the file; raises BadModel in one line where it is none."""
    found = read_result(path, VelocityDesign, VELOCITY_DESIGN)
    for name, one in found.controller.items():
        if one.value is None:
            raise BadModel(f"{path}: [controller.{name}] is null; a number needed")
    return found
