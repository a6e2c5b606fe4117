"""A controller as C99: one header, one source, no allocation, no dependency; and what an FMU 3.0
for co-simulation holds beside that source, which the importer compiles."""

import hashlib
from collections.abc import Mapping
from importlib.metadata import version
from typing import Any

from design.generated.exported import Exported, Precision, heading_of, rows
from design.generated.filled import Filled
from design.generated.syntax import INDENT, Syntax, arrays_of
from design.program import Program, Variable

# Python's names that are keywords of C, and one of a function of its library.
C_KEYWORDS = (
    "auto", "case", "char", "const", "default", "do", "double", "enum", "extern", "float", "goto",
    "inline", "int", "long", "register", "restrict", "short", "signed", "sizeof", "static",
    "struct", "switch", "typedef", "union", "unsigned", "void", "volatile", "free",
)  # fmt: skip


def c_syntax(program: Program, precision: Precision) -> Syntax:
    """C for this program: its functions for min, max and abs bear its name."""
    short = program.name
    return Syntax(
        precision=precision,
        symbols={
            "+": "+", "-": "-", "*": "*", "/": "/", "negative": "-", "not": "!", "and": "&&",
            "or": "||", "==": "==", "!=": "!=", "<": "<", "<=": "<=", ">": ">", ">=": ">=",
        },
        functions={"min": f"{short}_min", "max": f"{short}_max", "abs": f"{short}_abs"},
        names={word: f"{word}_" for word in C_KEYWORDS},
        literal=(lambda digits: f"{digits}f") if precision == "single" else str,
        assign="{} = {};",
        choice=("if ({}) {{", "} else {", "}"),
        loop=("for ({0} = 0; {0} < {1}; ++{0}) {{", "}"),
        comment=("/*", "*/"),
        states=frozenset(one.name for one in program.states),
        state_prefix="s->",
    )  # fmt: skip


TYPES = {"real": "real", "integer": "int", "boolean": "int"}


def c_files(what: Exported, filled: Filled) -> dict[str, str]:
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
    step = c.lines(program.statements)
    source = filled(
        "controller.c",
        **common,
        zero=c.number(0.0),
        constants=[{**vars(one), "value": c.number(one.value)} for one in program.constants],
        arrays=[
            {"name": name, "meaning": said, "size": len(own), "lines": rows(map(c.number, own))}
            for name, said, own in arrays_of(program)
        ],
        used=[key for key, name in c.functions.items() if f"{name}(" in "\n".join(step)],
        reset=reset,
        loops=any(line.startswith("for (j ") for line in reset),
        locals=_declared_locals((*program.locals, Variable(program.output.name)), c),
        step=step,
        test_inputs=rows(
            "{" + ", ".join(c.number(v) for v in row) + "}" for row in test.inputs.tolist()
        ),
        test_outputs=rows(c.number(v) for v in test.outputs.tolist()),
    )
    return {f"{program.name}.h": filled("controller.h", **common), f"{program.name}.c": source}


def _declared_locals(variables: tuple[Variable, ...], c: Syntax) -> list[str]:
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


def fmu_texts(what: Exported, filled: Filled) -> dict[str, str]:
    """The files inside the FMU, which holds no binary, by their paths."""
    program, files = what.program, c_files(what, filled)
    variables = _variables(what)
    token = hashlib.sha256("".join(files.values()).encode()).hexdigest()
    common: dict[str, Any] = {
        **heading_of(what),
        "inputs": program.inputs,
        "variables": variables,
        "token": token,
    }
    position = next(at for at, one in enumerate(program.inputs) if one.name == "y")
    used = {one["unit"] for one in variables}
    description = filled(
        "modelDescription.xml",
        markup=True,
        **common,
        version=version("servo-workbench"),
        units={unit: base for unit, base in BASE_UNITS.items() if unit in used},
    )
    return {
        "modelDescription.xml": description,
        "sources/buildDescription.xml": filled("buildDescription.xml", markup=True, **common),
        "sources/fmu.c": filled("fmu.c", **common, position=position),
        **{f"sources/{name}": text for name, text in files.items()},
    }


def _variables(what: Exported) -> list[dict[str, Any]]:
    """Inputs, the command, and what is worth watching inside; place: where the value of each
    stands in an instance."""
    program, keys = what.program, ("causality", "name", "meaning", "unit", "place")
    signals = [("input", one, f"input[{at}]") for at, one in enumerate(program.inputs)]
    every = [
        *((causality, one.name, one.meaning, one.unit, place)
          for causality, one, place in (*signals, ("output", program.output, "output"))),
        *(("local", one.name, one.meaning, "", f"state.{one.name}") for one in program.states
          if one.kind == "real" and not one.array),
    ]  # fmt: skip
    return [dict(zip(keys, one, strict=True), reference=at) for at, one in enumerate(every, 1)]
