"""`workbench export`: a design -> code for the machine; a model -> tables for its control."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from workbench import options
from workbench.output import OutputFolder, emit, results
from workbench.signature import argument, option

if TYPE_CHECKING:
    from design.generated.compensation import Encoder
    from design.generated.exported import Exported
    from workbench.screen import Screen

TARGETS = ("c", "st", "plcopen", "fmu", "json", "mat")
TABLES = ("friction-table", "cogging-table", "backlash", "csv")  # of a model
OF_BOTH = ("c", "st")  # of a design its controller, of a model its feed-forward
CONTROLS = ("twincat", "codesys", "linuxcnc", "sinumerik")
SINGLE = ("c", "st", "plcopen")  # targets that have single precision too
NO_MEANING = "{} has no meaning for this file and --to; leave it out."
WHAT_NEXT = {
    "c": "compile it with -ffp-contract=off and call {name}_self_test() once: 0 where all is well",
    "st": "import it; FB_{name}_test.passed says whether the controller computes as it should",
    "plcopen": "import it as PLCopen XML; FB_{name}_test.passed says whether it computes as it"
    " should",
    "fmu": "it holds C source: compile it by your tool, or by 'fmpy compile'",
    "json": "what it holds is said in the manual: Contract, design.json",
    "mat": "load it; {name}.law has R, S, T, W",
}


@dataclass(frozen=True)
class ExportOptions:
    """What the command line says of an export."""

    file: Path = argument("DESIGN|MODEL")
    targets: tuple[str, ...] = option(
        "Language or format; may be given several times. Of a model: its tables, and as c and st"
        " its feed-forward.",
        "--to", type=click.Choice((*TARGETS, *TABLES)), required=True,
    )  # fmt: skip
    controller: str | None = option(
        "Which one; 'present' is the machine's own, of its card.  [default: the recommended one]",
        type=click.Choice(["rst", "pid", "p-pi", "present"]),
    )  # fmt: skip
    compensator: bool | None = option(
        "With the friction compensator beside it.  [default: as recommended; of another"
        " controller with, of the present one and of a P-PI, which feeds friction forward,"
        " without]",
        "--compensator/--no-compensator", default=None,
    )  # fmt: skip
    schedule: bool | None = option(
        "With its gain schedule.  [default: where the design recommends it]",
        "--schedule/--no-schedule", default=None,
    )  # fmt: skip
    precision: Literal["double", "single"] = option(
        f"Of the numbers ({', '.join(SINGLE)}).", default="double"
    )
    name: str | None = option("Of the code: prefix, block, file.  [default: the card's name]")
    controls: tuple[str, ...] = option(
        "Whose tables; may be given several times.  [default: each that needs no further number]",
        "--control", type=click.Choice(CONTROLS),
    )  # fmt: skip
    speed: str | None = option(
        'Highest speed of the tables, "500 mm/s" or "20 rad/s".  [default: that of the logs]',
        metavar="V",
    )
    per_turn: str | None = option(
        'Of the axis in one turn of its motor, "10 mm" or "36 deg".  [default: a linear motor, or'
        " the motor's shaft itself]",
        metavar="TRAVEL",
    )
    rated: str | None = option(
        'Rated torque of the motor, "2.4 N m" ("250 N" of a linear one), in which TwinCAT CNC'
        " counts.",
        metavar="TORQUE",
    )
    encoder: "Encoder | None" = option(
        "By which the control positions: before the play, or the logs' transducer behind it.",
        type=click.Choice(["motor", "load"]),
    )  # fmt: skip
    out: Path | None = options.OUT_OPTION


@options.command(
    epilog="Example: workbench export runs/.../design.json --to c --to st --out code; workbench"
    " export runs/.../model.json --to friction-table --control sinumerik",
)
def command(given: ExportOptions) -> int:
    """Write a design's controller as code, or a model's friction as the tables of its control.

    The code takes the measured position, its reference and, above a force loop, the measured
    force, and gives the command with its limit and anti-windup, as the simulation does, in every
    bit (c, fmu) or within rounding (st, plcopen). Each file holds a vector that tests it on the
    machine.

    The tables are those of which a control compensates friction, cogging and backlash, in its own
    units; what a table cannot hold is said in newtons.
    """
    if _is_of_model(given.file, given.targets):
        options.refuse_given(NO_MEANING, "controller", "compensator", "schedule", "precision")
        return _tables(given)
    options.refuse_given(NO_MEANING, "controls", "speed", "per_turn", "rated", "encoder")
    from design.generated.exported import exported
    from workbench.documents.result_files import read_design
    from workbench.export.targets import writers
    from workbench.export.validated import validation_line

    targets, precision = dict.fromkeys(given.targets), given.precision
    wide = [target for target in targets if target not in SINGLE]
    if precision == "single" and wide:
        raise click.UsageError(f"--precision single is for {', '.join(SINGLE)}, not {wide[0]}.")
    found = read_design(given.file)
    what = exported(
        found, given.controller, compensated=given.compensator, scheduled=given.schedule,
        precision=precision,
        name=given.name,
    )  # fmt: skip
    checked = validation_line(found, given.file)
    what = replace(what, remarks=(checked, *what.remarks)) if checked else what
    now = datetime.now()
    files: dict[str, str | bytes] = {}
    for target in targets:
        files |= writers(now)[target](what)
    with OutputFolder("export", given.out, now=now) as folder:
        for each, content in files.items():
            folder.write(each, content)
    program, end = what.program, folder.final
    document = {
        "name": program.name,
        "controller": what.controller,
        "compensator": what.loop.compensation is not None,
        "precision": what.precision,
        "h": program.h,
        "inputs": program.inputs,
        "output": program.output,
        "remarks": what.remarks,
        "files": tuple(files),
        "out": end,
    }
    emit(document, lambda: _screen(what, targets, tuple(files), end))
    return 0


def _is_of_model(file: Path, targets: tuple[str, ...]) -> bool:
    """Whether the targets are a model's; of those that both have the file decides."""
    from identification.errors import BadModel
    from workbench.documents.reading import read_document
    from workbench.documents.result_files import MODEL_SCHEMA

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


def _tables(given: ExportOptions) -> int:
    from design.generated.compensation import Compensation
    from design.generated.tables import tables, tables_document
    from workbench.documents.result_files import read_model
    from workbench.export.filled import filled
    from workbench.export.table_targets import tables_asked, tables_screen

    model = read_model(given.file)
    asked = tables_asked(
        model.display, given.name, given.speed, given.per_turn, given.rated, given.encoder
    )
    what = Compensation(model, asked)
    found = tables(what, given.targets, given.controls, filled)
    with results("export", given.out) as folder:
        for one in found.files:
            folder.write(one.name, one.text)
    end = folder.final
    emit({**tables_document(what, found), "out": end}, lambda: tables_screen(what, found, end))
    return 0


def _screen(
    what: "Exported", targets: Mapping[str, None], files: tuple[str, ...], folder: Path
) -> "Screen":
    """What was written and what to do with it, for a terminal."""
    from design.generated.exported import title_of
    from workbench.output import written
    from workbench.report.design_tables import of_the_model
    from workbench.screen import listed, screen

    program = what.program
    given = ", ".join(f"{one.name} [{one.unit}]" for one in program.inputs)
    return screen(
        of_the_model(what.design.lacks) + title_of(what),
        f"every {program.h:.6g} s: {given} -> {program.output.name} [{program.output.unit}]",
        listed(f"remark: {one}" for one in what.remarks),
        written(folder, *files),
        listed(f"{target}: {WHAT_NEXT[target].format(name=program.name)}" for target in targets),
    )
