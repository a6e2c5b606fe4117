"""`workbench export`: a design -> code for the machine."""

from collections.abc import Mapping
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from workbench.ending import StatusCommand
from workbench.output import OutputFolder, emit, output_options

if TYPE_CHECKING:
    from workbench.export.exported import Exported
    from workbench.screen import Screen

TARGETS = ("c", "st", "plcopen", "fmu", "json", "mat")
SINGLE = ("c", "st", "plcopen")  # targets that have single precision too
WHAT_NEXT = {
    "c": "compile it with -ffp-contract=off and call {name}_self_test() once: 0 where all is well",
    "st": "import it; FB_{name}_test.passed tells whether the controller computes as it should",
    "plcopen": "import it as PLCopen XML; FB_{name}_test.passed tells whether it computes as it"
    " should",
    "fmu": "it holds C source: compile it by your tool, or by 'fmpy compile'",
    "json": "what it holds is said in the manual: Contract, design.json",
    "mat": "load it; {name}.law has R, S, T, W",
}


@click.command(
    cls=StatusCommand,
    epilog="Example: workbench export runs/.../design.json --to c --to st --out code",
)
@click.argument("design_file", metavar="DESIGN", type=click.Path(path_type=Path))
@click.option(
    "--to",
    "targets",
    type=click.Choice(TARGETS),
    multiple=True,
    required=True,
    help="Language or format; may be given several times.",
)
@click.option(
    "--controller",
    type=click.Choice(["rst", "pid", "present"]),
    help="Which one; 'present' is the machine's own, of its card.  [default: the recommended one]",
)
@click.option(
    "--compensator/--no-compensator",
    default=None,
    help="With the friction compensator beside it.  [default: as recommended; of another"
    " controller with, of the present one without]",
)
@click.option(
    "--precision",
    type=click.Choice(["double", "single"]),
    default="double",
    show_default=True,
    help=f"Of the numbers ({', '.join(SINGLE)}).",
)
@click.option("--name", help="Of the code: prefix, block, file.  [default: the card's name]")
@output_options
def command(
    design_file: Path,
    targets: tuple[str, ...],
    controller: str | None,
    compensator: bool | None,
    precision: Literal["double", "single"],
    name: str | None,
    as_json: bool,
    out: Path | None,
) -> int:
    """Write a design's controller as code for its machine.

    It takes the measured position, its reference and, above a force loop, the measured force, and
    gives the command with its limit and anti-windup, as the simulation does, in every bit (c, fmu)
    or within rounding (st, plcopen). Each file holds a vector that tests it on the machine.
    """
    from workbench.documents.design_read import read_design
    from workbench.export.exported import exported
    from workbench.export.targets import writers
    from workbench.export.validated import validation_line

    wide = [target for target in targets if target not in SINGLE]
    if precision == "single" and wide:
        raise click.UsageError(f"--precision single is for {', '.join(SINGLE)}, not {wide[0]}.")
    found = read_design(design_file)
    what = exported(found, controller, compensated=compensator, precision=precision, name=name)
    checked = validation_line(found, design_file)
    what = replace(what, remarks=(checked, *what.remarks)) if checked else what
    now = datetime.now()
    files: dict[str, str | bytes] = {}
    for target in dict.fromkeys(targets):
        files |= writers(now)[target](what)
    with OutputFolder("export", out, now=now) as folder:
        for file, content in files.items():
            folder.write(file, content)
    emit(
        _document(what, tuple(files), folder.final),
        as_json,
        lambda: _view(what, dict.fromkeys(targets), tuple(files), folder.final),
    )
    return 0


def _document(what: "Exported", files: tuple[str, ...], folder: Path) -> dict[str, object]:
    program = what.program
    return {
        "name": program.name,
        "controller": what.controller,
        "compensator": what.loop.compensation is not None,
        "precision": what.precision,
        "h": program.h,
        "inputs": program.inputs,
        "output": program.output,
        "remarks": what.remarks,
        "files": files,
        "out": folder,
    }


def _view(
    what: "Exported", targets: Mapping[str, None], files: tuple[str, ...], folder: Path
) -> "Screen":
    """What was written and what to do with it, for a terminal."""
    from workbench.export.filled import title_of
    from workbench.output import written
    from workbench.screen import listed, screen

    program = what.program
    given = ", ".join(f"{one.name} [{one.unit}]" for one in program.inputs)
    return screen(
        title_of(what),
        f"every {program.h:.6g} s: {given} -> {program.output.name} [{program.output.unit}]",
        listed(f"remark: {one}" for one in what.remarks),
        written(folder, *files),
        listed(f"{target}: {WHAT_NEXT[target].format(name=program.name)}" for target in targets),
    )
