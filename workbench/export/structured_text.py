"""A controller as function blocks of IEC 61131-3, in Structured Text and in PLCopen XML."""

from dataclasses import dataclass
from datetime import datetime
from importlib.metadata import version

from design.program import Kind
from workbench.export.exported import Exported, Precision
from workbench.export.filled import filled, heading_of, rows
from workbench.export.syntax import AT_POSITION_1, INDENT, Syntax, braced

# Words of the standard, and operators of its Instruction List, that a name here may meet.
RESERVED = ("s", "n", "d", "l", "p", "t", "in", "to", "by", "of", "on", "step", "limit", "mod")
OWN = "_1"  # behind such a name


@dataclass(frozen=True)
class StructuredText(Syntax):
    """Structured Text with the plain elements of every edition."""

    def number(self, value: float) -> str:
        digits, _, power = repr(self.rounded(value)).upper().partition("E")
        mantissa = digits if "." in digits else digits + ".0"
        return f"{mantissa}E{int(power)}" if power else mantissa

    def assigned(self, target: str, value: str) -> str:
        return f"{target} := {value};"

    def chosen(self, condition: str, then: list[str], otherwise: list[str]) -> list[str]:
        head = [f"IF {condition} THEN", *braced(then)]
        return [*head, *(["ELSE", *braced(otherwise)] if otherwise else []), "END_IF;"]

    def repeated(self, index: str, count: int, body: list[str]) -> list[str]:
        return [f"FOR {index} := 0 TO {count - 1} DO", *braced(body), "END_FOR;"]

    def remark(self, text: str) -> str:
        return f"(* {text.replace('*)', '* )')} *)"


def st_syntax(precision: Precision) -> StructuredText:
    """Structured Text in LREAL or REAL."""
    return StructuredText(
        precision=precision,
        symbols={
            "+": "+", "-": "-", "*": "*", "/": "/", "negative": "-", "not": "NOT ",
            "and": "AND", "or": "OR", "==": "=", "!=": "<>", "<": "<", "<=": "<=", ">": ">",
            ">=": ">=",
        },
        functions={"min": "MIN", "max": "MAX", "abs": "ABS"},
        names={"r": "r_ref", **{word: word + OWN for word in RESERVED}},
    )  # fmt: skip


NEVER = "begun"  # whether the block has run before
EXACT = {"double": 1e-9, "single": 1e-4}  # what a test passes, of the largest command


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


@dataclass(frozen=True)
class Block:
    """A function block: its variables by role, and its statements."""

    name: str
    inputs: tuple[Declared, ...]
    outputs: tuple[Declared, ...]
    constants: tuple[Declared, ...]
    variables: tuple[Declared, ...]
    body: tuple[str, ...]


def st_file(what: Exported) -> dict[str, str]:
    """The controller's block and the one that tests it, in one file."""
    text = filled("blocks.st", **heading_of(what), blocks=blocks(what))
    return {f"{what.program.name}.st": text}


def blocks(what: Exported) -> tuple[Block, Block]:
    """The controller's block and its test's."""
    st = st_syntax(what.precision)
    return _controller(what, st), _test(what, st)


def _types(what: Exported) -> dict[Kind, str]:
    real = "REAL" if what.precision == "single" else "LREAL"
    return {"real": real, "integer": "DINT", "boolean": "BOOL"}


def _controller(what: Exported, st: StructuredText) -> Block:
    program, types = what.program, _types(what)
    real = types["real"]
    inputs = [
        Declared(st.name(one.name), real, f"[{one.unit}] {one.meaning}") for one in program.inputs
    ]
    begin = Declared("reset", "BOOL", "TRUE: begin anew, the machine stands at y")
    constants = [
        Declared(st.name(one.name), real, f"[{one.unit}] {one.meaning}", 0, (st.number(one.value),))
        for one in program.constants
    ]
    tables = [(one.name, one.values, one.meaning) for one in program.tables]
    stood = "where the machine has stood at position 1"
    tables += [
        (one.name + AT_POSITION_1, one.at_rest, f"{one.name} {stood}")
        for one in program.states
        if one.array and any(one.at_rest)
    ]
    constants += [
        Declared(st.name(name), real, meaning, len(values), tuple(map(st.number, values)))
        for name, values, meaning in tables
    ]
    stored = [
        Declared(
            st.name(one.name), types[one.kind], one.meaning, len(one.at_rest) if one.array else 0
        )
        for one in program.states
    ]
    own = [Declared(st.name(one.name), types[one.kind], "") for one in program.locals]
    started = Declared(NEVER, "BOOL", "whether it has run before")
    if not any(one.name == "j" for one in own):
        own.append(Declared("j", types["integer"], ""))
    output = program.output
    first = [f"IF reset OR NOT {NEVER} THEN", f"{INDENT}{NEVER} := TRUE;"]
    first += [INDENT + line for one in program.states for line in st.reset(one)]
    return Block(
        f"FB_{program.name}",
        (*inputs, begin),
        (Declared(st.name(output.name), real, f"[{output.unit}] {output.meaning}"),),
        tuple(constants),
        (*stored, started, *own),
        (*first, "END_IF;", *st.lines(program.statements)),
    )


def _test(what: Exported, st: StructuredText) -> Block:
    """The block that runs the vector once and says whether the controller's block gives it."""
    program, types, test = what.program, _types(what), what.test
    real, n = types["real"], len(test.outputs)
    tables = [
        Declared(f"in_{one.name}", real, f"[{one.unit}]", n, tuple(map(st.number, column)))
        for one, column in zip(program.inputs, test.inputs.T.tolist(), strict=True)
    ]
    wanted = Declared("wanted", real, "", n, tuple(map(st.number, test.outputs.tolist())))
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
        (Declared("passed", "BOOL", "whether the block gives what the simulation gave"),
         Declared("worst", real, f"[{program.output.unit}] largest difference")),
        (*tables, wanted),
        (Declared("block", f"FB_{program.name}", ""), Declared("k", types["integer"], "")),
        body,
    )  # fmt: skip


ELEMENTARY = ("BOOL", "DINT", "REAL", "LREAL")


def plcopen_file(what: Exported, now: datetime) -> dict[str, str]:
    """A project (TC6, version 2.01) with the controller's block and the one that tests it."""
    text = filled(
        "project.xml",
        markup=True,
        **heading_of(what),
        version=version("servo-workbench"),
        now=now.isoformat(timespec="seconds"),
        elementary=ELEMENTARY,
        blocks=blocks(what),
    )
    return {f"{what.program.name}.xml": text}
