"""A controller as function blocks of IEC 61131-3, in Structured Text and in PLCopen XML."""

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version

from design.generated.exported import Exported, Precision, heading_of, rows
from design.generated.filled import Filled
from design.generated.syntax import INDENT, Syntax, arrays_of
from design.program import Kind

# Words of the standard, and operators of its Instruction List, that a name here may meet.
RESERVED = ("s", "n", "d", "l", "p", "t", "in", "to", "by", "of", "on", "step", "limit", "mod")
OWN = "_1"  # behind such a name


@dataclass(frozen=True)
class Declared:
    """A variable of a function block; size: of an array, 0 for none; values: its first ones."""

    name: str
    type: str
    meaning: str
    size: int = 0
    values: tuple[str, ...] = ()

    @property
    def line(self) -> str:
        kind = f"ARRAY[0..{self.size - 1}] OF {self.type}" if self.size else self.type
        start = ""
        if self.values:
            start = f" := [{', '.join(self.values)}]" if self.size else f" := {self.values[0]}"
        said = f" (* {self.meaning} *)" if self.meaning else ""
        whole = f"{self.name} : {kind}{start};{said}"
        if len(whole) <= 100 or not self.size:
            return whole
        values = "\n".join(f"{INDENT * 3}{line}" for line in rows(self.values))
        return f"{self.name} : {kind} := [{said}\n{values}\n{INDENT * 2}];"


def _literal(digits: str) -> str:
    mantissa, _, power = digits.upper().partition("E")
    mantissa += "" if "." in mantissa else ".0"
    return f"{mantissa}E{int(power)}" if power else mantissa


def _declared(
    st: Syntax, name: str, kind: Kind, said: str = "", values: Sequence[float] = (), size: int = 0
) -> Declared:
    """A variable of a block; values: its first ones, of an array of this size."""
    real = "REAL" if st.precision == "single" else "LREAL"
    types = {"real": real, "integer": "DINT", "boolean": "BOOL"}
    return Declared(st.name(name), types[kind], said, size, tuple(map(st.number, values)))


def st_syntax(precision: Precision) -> Syntax:
    """Structured Text in LREAL or REAL."""
    return Syntax(
        precision=precision,
        symbols={
            "+": "+", "-": "-", "*": "*", "/": "/", "negative": "-", "not": "NOT ",
            "and": "AND", "or": "OR", "==": "=", "!=": "<>", "<": "<", "<=": "<=", ">": ">",
            ">=": ">=",
        },
        functions={"min": "MIN", "max": "MAX", "abs": "ABS"},
        names={"r": "r_ref", **{word: word + OWN for word in RESERVED}},
        literal=_literal,
        assign="{} := {};",
        choice=("IF {} THEN", "ELSE", "END_IF;"),
        loop=("FOR {0} := 0 TO {2} DO", "END_FOR;"),
        comment=("(*", "*)"),
    )  # fmt: skip


NEVER = "begun"  # whether the block has run before
EXACT = {"double": 1e-9, "single": 1e-4}  # what a test passes, of the largest command


@dataclass(frozen=True)
class Block:
    """A function block: its variables by role, and its statements."""

    name: str
    inputs: tuple[Declared, ...]
    outputs: tuple[Declared, ...]
    constants: tuple[Declared, ...]
    variables: tuple[Declared, ...]
    body: tuple[str, ...]


def st_file(what: Exported, filled: Filled) -> dict[str, str]:
    """The controller's block and the one that tests it, in one file."""
    text = filled("blocks.st", **heading_of(what), blocks=blocks(what))
    return {f"{what.program.name}.st": text}


def blocks(what: Exported) -> tuple[Block, Block]:
    """The controller's block and its test's."""
    st = st_syntax(what.precision)
    return _controller(what, st), _test(what, st)


def _controller(what: Exported, st: Syntax) -> Block:
    program = what.program
    signals = {one.name: f"[{one.unit}] {one.meaning}" for one in (*program.inputs, program.output)}
    constants = [
        _declared(st, one.name, "real", f"[{one.unit}] {one.meaning}", (one.value,))
        for one in program.constants
    ]
    constants += [
        _declared(st, name, "real", said, own, len(own)) for name, said, own in arrays_of(program)
    ]
    variables = [
        _declared(st, one.name, one.kind, one.meaning, size=len(one.at_rest) if one.array else 0)
        for one in program.states
    ]
    variables.append(_declared(st, NEVER, "boolean", "whether it has run before"))
    variables += [_declared(st, one.name, one.kind) for one in program.locals]
    if not any(one.name == "j" for one in program.locals):
        variables.append(_declared(st, "j", "integer"))
    first = [f"IF reset OR NOT {NEVER} THEN", f"{INDENT}{NEVER} := TRUE;"]
    first += [INDENT + line for one in program.states for line in st.reset(one)]
    return Block(
        f"FB_{program.name}",
        (*(_declared(st, one.name, "real", signals[one.name]) for one in program.inputs),
         _declared(st, "reset", "boolean", "TRUE: begin anew, the machine stands at y")),
        (_declared(st, program.output.name, "real", signals[program.output.name]),),
        tuple(constants),
        tuple(variables),
        (*first, "END_IF;", *st.lines(program.statements)),
    )  # fmt: skip


def _test(what: Exported, st: Syntax) -> Block:
    """The block that runs the vector once and says whether the controller's block gives it."""
    program, test, n = what.program, what.test, len(what.test.outputs)
    tables = [
        _declared(st, f"in_{one.name}", "real", f"[{one.unit}]", column, n)
        for one, column in zip(program.inputs, test.inputs.T.tolist(), strict=True)
    ]
    most = max(abs(test.outputs).max(), 1.0) * EXACT[what.precision]
    given = ", ".join(f"{st.name(one.name)} := in_{one.name}[k]" for one in program.inputs)
    body = (
        "worst := 0.0;",
        f"FOR k := 0 TO {n - 1} DO",
        f"    block({given}, reset := (k = 0));",
        f"    worst := MAX(worst, ABS(block.{st.name(program.output.name)} - wanted[k]));",
        "END_FOR;",
        f"passed := worst <= {st.number(most)};",
    )
    return Block(
        f"FB_{program.name}_test",
        (),
        (_declared(st, "passed", "boolean", "whether the block gives what the simulation gave"),
         _declared(st, "worst", "real", f"[{program.output.unit}] largest difference")),
        (*tables, _declared(st, "wanted", "real", "", test.outputs.tolist(), n)),
        (Declared("block", f"FB_{program.name}", ""), _declared(st, "k", "integer")),
        body,
    )  # fmt: skip


ELEMENTARY = ("BOOL", "DINT", "REAL", "LREAL")


def plcopen_file(what: Exported, now: str, filled: Filled) -> dict[str, str]:
    """A project (TC6, version 2.01) with the controller's block and the one that tests it.

    now: date and time as ISO 8601 writes them, to the second.
    """
    text = filled(
        "project.xml",
        markup=True,
        **heading_of(what),
        version=version("servo-workbench"),
        now=now,
        elementary=ELEMENTARY,
        blocks=blocks(what),
    )
    return {f"{what.program.name}.xml": text}
