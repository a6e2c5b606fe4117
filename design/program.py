"""A controller's step as a short program: what it takes, gives, keeps and does, in order.

It is read out of the simulation's own compiled kernels (`design.kernel_reader`), so that there is
one description of a controller; the languages of machines are written from it. Every operation is
rounded by itself, in the order of the program.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

Kind = Literal["real", "integer", "boolean"]
# min(a, b) is b where b < a, else a; max(a, b) is b where b > a, else a, as in Python.
Operator = Literal[
    "+", "-", "*", "/", "min", "max", "abs", "negative",
    "<", "<=", ">", ">=", "==", "!=", "and", "or", "not",
]  # fmt: skip
LOGICAL: tuple[Operator, ...] = ("<", "<=", ">", ">=", "==", "!=", "and", "or", "not")


@dataclass(frozen=True)
class Number:
    """A number as it is written; an int is an integer."""

    value: float


@dataclass(frozen=True)
class Constant:
    """A number with a name."""

    name: str
    value: float


@dataclass(frozen=True)
class Variable:
    """An input, a state or a local value."""

    name: str
    kind: Kind = "real"


@dataclass(frozen=True)
class Element:
    """An entry, counted from 0, of a table or of a state that is an array."""

    array: str
    index: "Expression"


@dataclass(frozen=True)
class Operation:
    """An operator on one, two or (and, or) more expressions."""

    operator: Operator
    arguments: "tuple[Expression, ...]"


Expression = Number | Constant | Variable | Element | Operation


@dataclass(frozen=True)
class Assign:
    """target := value."""

    target: Variable | Element
    value: Expression


@dataclass(frozen=True)
class Choice:
    """One or the other, by a condition."""

    condition: Expression
    then: "tuple[Statement, ...]"
    otherwise: "tuple[Statement, ...]"


@dataclass(frozen=True)
class Repeat:
    """The body for index = 0 ... count - 1."""

    index: Variable
    count: int
    body: "tuple[Statement, ...]"


@dataclass(frozen=True)
class Remark:
    """What the statements behind it do."""

    text: str


Statement = Assign | Choice | Repeat | Remark


@dataclass(frozen=True)
class Signal:
    """An input or the output: its name, unit and meaning."""

    name: str
    unit: str
    meaning: str


@dataclass(frozen=True)
class State:
    """What is kept from step to step: its name, kind and meaning.

    at_rest: its entries, divided by the position, where the machine has stood at a position; a
    scalar has one. array: whether its entries are counted.
    """

    name: str
    kind: Kind
    at_rest: tuple[float, ...]
    array: bool
    meaning: str


@dataclass(frozen=True)
class Table:
    """Constants that are counted."""

    name: str
    values: tuple[float, ...]
    meaning: str


@dataclass(frozen=True)
class NamedConstant:
    """A constant with its unit and meaning."""

    name: str
    value: float
    unit: str
    meaning: str


@dataclass(frozen=True)
class Program:
    """A controller's step, run every h [s]; its position controller at every `ratio`-th one."""

    name: str
    h: float
    ratio: int
    inputs: tuple[Signal, ...]
    output: Signal
    constants: tuple[NamedConstant, ...]
    tables: tuple[Table, ...]
    states: tuple[State, ...]
    locals: tuple[Variable, ...]
    statements: tuple[Statement, ...]


def kind_of(value: Expression) -> Kind:
    """What an expression gives."""
    match value:
        case Number(number):
            return "integer" if isinstance(number, int) else "real"
        case Variable(_, kind):
            return kind
        case Operation(operator, arguments):
            return "boolean" if operator in LOGICAL else kind_of(arguments[0])
        case _:
            return "real"


def parts(value: Expression) -> Iterator[Expression]:
    """The expression and all inside it."""
    yield value
    if isinstance(value, Operation):
        for one in value.arguments:
            yield from parts(one)
    elif isinstance(value, Element):
        yield from parts(value.index)


def flat(statements: tuple[Statement, ...]) -> Iterator[Statement]:
    """The statements and all inside them."""
    for one in statements:
        yield one
        if isinstance(one, Choice):
            yield from flat(one.then)
            yield from flat(one.otherwise)
        elif isinstance(one, Repeat):
            yield from flat(one.body)


def expressions(statements: tuple[Statement, ...]) -> Iterator[Expression]:
    """Every expression in the statements, with all inside it."""
    for one in flat(statements):
        if isinstance(one, Assign):
            yield from parts(one.target)
            yield from parts(one.value)
        elif isinstance(one, Choice):
            yield from parts(one.condition)
