"""A controller as C99: one header, one source, no allocation, no dependency; and as an FMU 3.0 for
co-simulation with that source, which the importer compiles."""

import hashlib
import io
import zipfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib.metadata import version
from typing import Any

from design.program import Program, Variable
from workbench.export.exported import Exported, Precision
from workbench.export.filled import filled, heading_of, rows
from workbench.export.syntax import INDENT, Syntax, braced

# Python's names that are keywords of C, and one of a function of its library.
C_KEYWORDS = (
    "auto", "case", "char", "const", "default", "do", "double", "enum", "extern", "float", "goto",
    "inline", "int", "long", "register", "restrict", "short", "signed", "sizeof", "static",
    "struct", "switch", "typedef", "union", "unsigned", "void", "volatile", "free",
)  # fmt: skip


@dataclass(frozen=True)
class C(Syntax):
    """C99; states are members of a structure `s`."""

    def number(self, value: float) -> str:
        suffix = "f" if self.precision == "single" else ""
        return repr(self.rounded(value)) + suffix

    def assigned(self, target: str, value: str) -> str:
        return f"{target} = {value};"

    def chosen(self, condition: str, then: list[str], otherwise: list[str]) -> list[str]:
        head = [f"if ({condition}) {{", *braced(then)]
        return [*head, "}"] if not otherwise else [*head, "} else {", *braced(otherwise), "}"]

    def repeated(self, index: str, count: int, body: list[str]) -> list[str]:
        return [f"for ({index} = 0; {index} < {count}; ++{index}) {{", *braced(body), "}"]

    def remark(self, text: str) -> str:
        return f"/* {text.replace('*/', '* /')} */"


def c_syntax(program: Program, precision: Precision) -> C:
    """C for this program: its functions for min, max and abs bear its name."""
    short = program.name
    return C(
        precision=precision,
        symbols={
            "+": "+", "-": "-", "*": "*", "/": "/", "negative": "-", "not": "!", "and": "&&",
            "or": "||", "==": "==", "!=": "!=", "<": "<", "<=": "<=", ">": ">", ">=": ">=",
        },
        functions={"min": f"{short}_min", "max": f"{short}_max", "abs": f"{short}_abs"},
        names={word: f"{word}_" for word in C_KEYWORDS},
        states=frozenset(one.name for one in program.states),
        state_prefix="s->",
    )  # fmt: skip


TYPES = {"real": "real", "integer": "int", "boolean": "int"}


def c_files(what: Exported) -> dict[str, str]:
    """The header and the source, by file name."""
    program = what.program
    c = c_syntax(program, what.precision)
    test = what.test
    common: dict[str, Any] = {
        **heading_of(what),
        "period": c.number(program.h),
        "real": "float" if what.precision == "single" else "double",
        "inputs": program.inputs,
        "output": program.output,
        "position_unit": program.inputs[0].unit,
        "samples": len(test.outputs),
        "states": [
            {
                "type": "int" if one.kind == "integer" else f"{program.name}_real",
                "declared": one.name + (f"[{len(one.at_rest)}]" if one.array else ""),
                "meaning": one.meaning,
            }
            for one in program.states
        ],
    }
    reset = [line for one in program.states for line in c.reset(one)]
    source = filled(
        "controller.c",
        **common,
        zero=c.number(0.0),
        constants=[{**vars(one), "value": c.number(one.value)} for one in program.constants],
        tables=[
            {"name": one.name, "meaning": one.meaning, **_numbers(one.values, c)}
            for one in program.tables
        ],
        starts=[
            {"name": one.name, **_numbers(one.at_rest, c)}
            for one in program.states
            if one.array and any(one.at_rest)
        ],
        helpers=list(_helpers(what, c)),
        reset=reset,
        loops=any(line.startswith("for (j ") for line in reset),
        locals=_declared_locals((*program.locals, Variable(program.output.name)), c),
        step=c.lines(program.statements),
        test_inputs=rows(
            "{" + ", ".join(c.number(v) for v in row) + "}" for row in test.inputs.tolist()
        ),
        test_outputs=rows(c.number(v) for v in test.outputs.tolist()),
    )
    return {f"{program.name}.h": filled("controller.h", **common), f"{program.name}.c": source}


def _numbers(values: tuple[float, ...], c: C) -> dict[str, object]:
    return {"size": len(values), "lines": rows(c.number(v) for v in values)}


def _declared_locals(variables: tuple[Variable, ...], c: C) -> list[str]:
    """Declarations, one a kind."""
    kinds: dict[str, list[str]] = {}
    for one in variables:
        kinds.setdefault(TYPES[one.kind], []).append(c.name(one.name))
    lines = []
    for kind, names in kinds.items():
        first, *others = rows(names)
        lines += [f"{kind} {first}", *(INDENT + line for line in others)]
        lines[-1] += ";"
    return lines


def _helpers(what: Exported, c: C) -> Iterator[str]:
    """Functions that the step uses. They are Python's min and max, which the simulation has."""
    used = "\n".join(c.lines(what.program.statements))
    bodies = {
        "min": ("real a, real b", "b < a ? b : a"),
        "max": ("real a, real b", "b > a ? b : a"),
        "abs": ("real a", f"a > {c.number(0.0)} ? a : {c.number(0.0)} - a"),
    }
    for key, (given, body) in bodies.items():
        function = c.functions[key]
        if f"{function}(" in used:
            yield f"static real {function}({given})\n{{\n    return {body};\n}}"


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
        **heading_of(what),
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
