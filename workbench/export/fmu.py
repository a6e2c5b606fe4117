"""A controller as an FMU 3.0 for co-simulation, with its C source; the importer compiles it."""

import hashlib
import io
import zipfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib.metadata import version
from typing import Any

from workbench.export.c import c_files
from workbench.export.exported import Exported
from workbench.export.filled import filled, lead_of, title_of

EPOCH = (1980, 1, 1, 0, 0, 0)  # of the files inside, so that the same design gives the same bytes
# Units in powers of the SI's; others go without.
BASE_UNITS: Mapping[str, Mapping[str, float]] = {
    "m": {"m": 1},
    "m/s": {"m": 1, "s": -1},
    "rad": {"rad": 1},
    "rad/s": {"rad": 1, "s": -1},
    "N": {"kg": 1, "m": 1, "s": -2},
    "N m": {"kg": 1, "m": 2, "s": -2},
    "V": {"kg": 1, "m": 2, "s": -3, "A": -1},
    "A": {"A": 1},
    "%": {"factor": 0.01},
}


@dataclass(frozen=True)
class FMUVariable:
    """A variable of the model; place: where its value stands in an instance."""

    name: str
    reference: int
    causality: str
    unit: str
    meaning: str
    place: str


def fmu_file(what: Exported) -> dict[str, bytes]:
    """The FMU, which holds no binary."""
    program, files = what.program, c_files(what)
    variables = tuple(_variables(what))
    token = hashlib.sha256("".join(files.values()).encode()).hexdigest()
    common: dict[str, Any] = {
        "title": title_of(what),
        "name": program.name,
        "h": program.h,
        "inputs": program.inputs,
        "variables": variables,
        "token": token,
    }
    position = next(at for at, one in enumerate(program.inputs) if one.name == "y")
    used = {one.unit for one in variables}
    description = filled(
        "modelDescription.xml",
        markup=True,
        **common,
        lead=lead_of(what),
        version=version("servo-workbench"),
        units={unit: base for unit, base in BASE_UNITS.items() if unit in used},
    )
    inside = {
        "modelDescription.xml": description,
        "sources/buildDescription.xml": filled("buildDescription.xml", markup=True, **common),
        "sources/fmu.c": filled("fmu.c", **common, position=position),
        **{f"sources/{name}": text for name, text in files.items()},
    }
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in inside.items():
            archive.writestr(zipfile.ZipInfo(name, EPOCH), text, zipfile.ZIP_DEFLATED)
    return {f"{program.name}.fmu": packed.getvalue()}


def _variables(what: Exported) -> Iterator[FMUVariable]:
    """Inputs, the command, and what is worth watching inside."""
    program = what.program
    for at, one in enumerate(program.inputs):
        yield FMUVariable(one.name, at + 1, "input", one.unit, one.meaning, f"input[{at}]")
    output, first = program.output, len(program.inputs) + 1
    yield FMUVariable(output.name, first, "output", output.unit, output.meaning, "output")
    watched = [one for one in program.states if one.kind == "real" and not one.array]
    for at, state in enumerate(watched, first + 1):
        yield FMUVariable(state.name, at, "local", "", state.meaning, f"state.{state.name}")
