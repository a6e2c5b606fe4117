"""`workbench export`: a design -> code for the machine; a model -> tables for its control."""

from collections.abc import Mapping
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from workbench.ending import StatusCommand
from workbench.output import OutputFolder, emit, output_options, results

if TYPE_CHECKING:
    from workbench.export.compensation import Encoder
    from workbench.export.exported import Exported
    from workbench.screen import Screen

TARGETS = ("c", "st", "plcopen", "fmu", "json", "mat")
TABLES = ("friction-table", "cogging-table", "backlash", "csv")  # of a model
OF_BOTH = ("c", "st")  # of a design its controller, of a model its feed-forward
CONTROLS = ("twincat", "codesys", "linuxcnc", "sinumerik")
SINGLE = ("c", "st", "plcopen")  # targets that have single precision too
WHAT_NEXT = {
    "c": "compile it with -ffp-contract=off and call {name}_self_test() once: 0 where all is well",
    "st": "import it; FB_{name}_test.passed says whether the controller computes as it should",
    "plcopen": "import it as PLCopen XML; FB_{name}_test.passed says whether it computes as it"
    " should",
    "fmu": "it holds C source: compile it by your tool, or by 'fmpy compile'",
    "json": "what it holds is said in the manual: Contract, design.json",
    "mat": "load it; {name}.law has R, S, T, W",
}


@click.command(
    cls=StatusCommand,
    epilog="Example: workbench export runs/.../design.json --to c --to st --out code; workbench"
    " export runs/.../model.json --to friction-table --control sinumerik",
)
@click.argument("file", metavar="DESIGN|MODEL", type=click.Path(path_type=Path))
@click.option(
    "--to",
    "targets",
    type=click.Choice((*TARGETS, *TABLES)),
    multiple=True,
    required=True,
    help="Language or format; may be given several times. Of a model: its tables, and as c and st"
    " its feed-forward.",
)
@click.option(
    "--controller",
    type=click.Choice(["rst", "pid", "p-pi", "present"]),
    help="Which one; 'present' is the machine's own, of its card.  [default: the recommended one]",
)
@click.option(
    "--compensator/--no-compensator",
    default=None,
    help="With the friction compensator beside it.  [default: as recommended; of another"
    " controller with, of the present one and of a P-PI, which feeds friction forward, without]",
)
@click.option(
    "--precision",
    type=click.Choice(["double", "single"]),
    default="double",
    show_default=True,
    help=f"Of the numbers ({', '.join(SINGLE)}).",
)
@click.option("--name", help="Of the code: prefix, block, file.  [default: the card's name]")
@click.option(
    "--control",
    "controls",
    type=click.Choice(CONTROLS),
    multiple=True,
    help="Whose tables; may be given several times.  [default: each that needs no further number]",
)
@click.option(
    "--speed",
    metavar="V",
    help='Highest speed of the tables, "500 mm/s" or "20 rad/s".  [default: that of the logs]',
)
@click.option(
    "--per-turn",
    metavar="TRAVEL",
    help='Of the axis in one turn of its motor, "10 mm" or "36 deg".  [default: a linear motor, or'
    " the motor's shaft itself]",
)
@click.option(
    "--rated",
    metavar="TORQUE",
    help='Rated torque of the motor, "2.4 N m" ("250 N" of a linear one), in which TwinCAT CNC'
    " counts.",
)
@click.option(
    "--encoder",
    type=click.Choice(["motor", "load"]),
    help="By which the control positions: before the play, or the logs' transducer behind it.",
)
@output_options
def command(
    file: Path,
    targets: tuple[str, ...],
    controller: str | None,
    compensator: bool | None,
    precision: Literal["double", "single"],
    name: str | None,
    controls: tuple[str, ...],
    speed: str | None,
    per_turn: str | None,
    rated: str | None,
    encoder: "Encoder | None",
    as_json: bool,
    out: Path | None,
) -> int:
    """Write a design's controller as code, or a model's friction as the tables of its control.

    The code takes the measured position, its reference and, above a force loop, the measured
    force, and gives the command with its limit and anti-windup, as the simulation does, in every
    bit (c, fmu) or within rounding (st, plcopen). Each file holds a vector that tests it on the
    machine.

    The tables are those of which a control compensates friction, cogging and backlash, in its own
    units; what a table cannot hold is said in newtons.
    """
    if _is_of_model(file, targets):
        _refuse_given("controller", "compensator", "precision")
        return _tables(
            file, targets, controls, (name, speed, per_turn, rated, encoder), as_json, out
        )
    _refuse_given("controls", "speed", "per_turn", "rated", "encoder")
    from workbench.documents.design_read import read_design
    from workbench.export.exported import exported
    from workbench.export.targets import writers
    from workbench.export.validated import validation_line

    wide = [target for target in targets if target not in SINGLE]
    if precision == "single" and wide:
        raise click.UsageError(f"--precision single is for {', '.join(SINGLE)}, not {wide[0]}.")
    found = read_design(file)
    what = exported(found, controller, compensated=compensator, precision=precision, name=name)
    checked = validation_line(found, file)
    what = replace(what, remarks=(checked, *what.remarks)) if checked else what
    now = datetime.now()
    files: dict[str, str | bytes] = {}
    for target in dict.fromkeys(targets):
        files |= writers(now)[target](what)
    with OutputFolder("export", out, now=now) as folder:
        for each, content in files.items():
            folder.write(each, content)
    emit(
        _document(what, tuple(files), folder.final),
        as_json,
        lambda: _view(what, dict.fromkeys(targets), tuple(files), folder.final),
    )
    return 0


def _is_of_model(file: Path, targets: tuple[str, ...]) -> bool:
    """Whether the targets are a model's; of those that both have the file decides."""
    from identification.errors import BadModel
    from workbench.documents.model_file import MODEL_SCHEMA
    from workbench.documents.reading import read_document

    tables = [target for target in targets if target in TABLES]
    code = [target for target in targets if target not in (*TABLES, *OF_BOTH)]
    if tables and code:
        raise click.UsageError(f"--to {tables[0]} is of a model, --to {code[0]} of a design.")
    if tables or code:
        return bool(tables)
    try:
        return read_document(file).get("schema") == MODEL_SCHEMA
    except BadModel:
        return False  # read as a design, which says what is wrong with it


def _refuse_given(*options: str) -> None:
    """Raises a usage error where one of these is given, which the file has no use for."""
    context = click.get_current_context()
    for option in context.command.params:
        given = context.get_parameter_source(option.name or "")
        if option.name in options and given is click.core.ParameterSource.COMMANDLINE:
            raise click.UsageError(
                f"{option.opts[0]} has no meaning for this file and --to; leave it out."
            )


def _tables(
    file: Path, targets: tuple[str, ...], controls: tuple[str, ...],
    said: "tuple[str | None, str | None, str | None, str | None, Encoder | None]",
    as_json: bool, out: Path | None,
) -> int:  # fmt: skip
    """The tables of a model; said: name, speed, per_turn, rated and encoder as they were given."""
    from workbench.documents.model_file import read_model
    from workbench.export.asked import tables_asked
    from workbench.export.compensation import Compensation
    from workbench.export.table_targets import tables
    from workbench.export.table_view import tables_document, tables_view

    model = read_model(file)
    what = Compensation(model, tables_asked(model.rotary, *said))
    found = tables(what, targets, controls)
    with results("export", out) as folder:
        for one in found.files:
            folder.write(one.name, one.text)
    emit(
        tables_document(what, found, folder.final),
        as_json,
        lambda: tables_view(what, found, folder.final),
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
