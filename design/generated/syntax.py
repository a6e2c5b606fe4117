"""A program's statements in the syntax of C and of Structured Text."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from design.generated.exported import Precision
from design.program import (
    Assign,
    Choice,
    Constant,
    Element,
    Expression,
    Number,
    Operation,
    Operator,
    Program,
    Remark,
    Repeat,
    State,
    Statement,
    Variable,
)
from identification.errors import BadModel

INDENT = "    "
AT_POSITION_1 = "_at_1"  # behind a state's name: its entries where it has stood at position 1
# How tightly an operator binds; one of the same rank on the right is put in parentheses.
RANK: Mapping[Operator, int] = {
    "or": 1, "and": 2, "==": 3, "!=": 3, "<": 4, "<=": 4, ">": 4, ">=": 4,
    "+": 5, "-": 5, "*": 6, "/": 6, "not": 7, "negative": 7,
}  # fmt: skip
ATOM = 8
MIXED = ("and", "or", "<", "<=", ">", ">=")  # put in parentheses within any other


@dataclass(frozen=True)
class Syntax:
    """How a language writes a program.

    symbols: of its operators; functions: for min, max and abs; names: for what it would take for
    something else; literal: of a number in Python's digits. assign: of target and value; choice:
    head with the condition, else, end; loop: head with index, count and last index, end; comment:
    begin, end; state_prefix: what stands before a state.
    """

    precision: Precision
    symbols: Mapping[Operator, str]
    functions: Mapping[str, str]
    names: Mapping[str, str]
    literal: Callable[[str], str]
    assign: str
    choice: tuple[str, str, str]
    loop: tuple[str, str]
    comment: tuple[str, str]
    states: frozenset[str] = frozenset()
    state_prefix: str = ""

    def number(self, value: float) -> str:
        """A number of the program's precision as a literal; raises BadModel where it is none."""
        found = float(np.float32(value)) if self.precision == "single" else float(value)
        if not math.isfinite(found):
            raise BadModel(f"{value:g} has no form in {self.precision} precision")
        return self.literal(repr(found))

    def name(self, name: str) -> str:
        """A name as the language takes it."""
        own = self.names.get(name, name)
        return self.state_prefix + own if name in self.states else own

    def reset(self, one: State) -> list[str]:
        """Lines that put a state at rest at y."""
        place, y = self.name(one.name), self.name("y")
        if one.array:
            moved = f"{self.name(one.name + AT_POSITION_1)}[j] * {y}"
            value = moved if any(one.at_rest) else self.number(0.0)
            body = [INDENT + self.assign.format(f"{place}[j]", value)]
            return self._repeated("j", len(one.at_rest), body)
        still = "0" if one.kind == "integer" else self.number(0.0)
        at = one.at_rest[0]
        value = {0.0: still, 1.0: y}.get(at, f"{self.number(at)} * {y}")
        return [self.assign.format(place, value)]

    def lines(self, statements: Sequence[Statement], depth: int = 0) -> list[str]:
        """The statements, indented by `depth`."""
        return [INDENT * depth + line for one in statements for line in self._written(one)]

    def _repeated(self, index: str, count: int, body: Sequence[str]) -> list[str]:
        head, end = self.loop
        return [head.format(index, count, count - 1), *body, end]

    def _written(self, one: Statement) -> Iterator[str]:
        match one:
            case Assign(target, value):
                yield self.assign.format(self.expression(target), self.expression(value))
            case Choice(condition, then, otherwise):
                head, between, end = self.choice
                yield head.format(self.expression(condition))
                yield from self.lines(then, 1)
                yield from [between, *self.lines(otherwise, 1)] if otherwise else []
                yield end
            case Repeat(index, count, body):
                yield from self._repeated(self.name(index.name), count, self.lines(body, 1))
            case Remark(text):
                begin, end = self.comment
                said = " ".join(text.split()).replace(end, " ".join(end))
                yield f"{begin} {said} {end}"

    def expression(self, value: Expression) -> str:
        """The expression, in parentheses only where its order needs them."""
        return self._ranked(value)[0]

    def _ranked(self, value: Expression) -> tuple[str, int]:
        match value:
            case Number(number):
                if isinstance(number, int):
                    return str(number), ATOM
                return self.number(number), ATOM if number >= 0.0 else RANK["negative"]
            case Constant(name) | Variable(name):
                return self.name(name), ATOM
            case Element(array, index):
                return f"{self.name(array)}[{self.expression(index)}]", ATOM
            case Operation("min" | "max" | "abs" as operator, arguments):
                given = ", ".join(self.expression(one) for one in arguments)
                return f"{self.functions[operator]}({given})", ATOM
            case Operation(operator, (inner,)):
                return self.symbols[operator] + self._inside(inner, ATOM), RANK[operator]
            case Operation(operator, (first, *others)):
                rank = RANK[operator]
                parts = [self._inside(first, rank), *(self._inside(o, rank + 1) for o in others)]
                return f" {self.symbols[operator]} ".join(parts), rank
        raise BadModel(f"{value} has no form in a program")

    def _inside(self, value: Expression, least: int) -> str:
        """The expression, in parentheses where it binds less than `least`."""
        said, rank = self._ranked(value)
        mixed = isinstance(value, Operation) and value.operator in MIXED
        return f"({said})" if rank < least or mixed else said


def arrays_of(program: Program) -> list[tuple[str, str, tuple[float, ...]]]:
    """Name, meaning and entries of the tables, and of arrays that at position 1 are not 0."""
    at_rest = [
        (one.name + AT_POSITION_1, f"{one.name} where the machine has stood at position 1",
         one.at_rest)
        for one in program.states
        if one.array and any(one.at_rest)
    ]  # fmt: skip
    return [*((one.name, one.meaning, one.values) for one in program.tables), *at_rest]
