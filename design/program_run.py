"""A `Program` run as it is written, in double or single precision, and a vector that tests it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from design.program import (
    Assign,
    Choice,
    Constant,
    Element,
    Expression,
    Number,
    Operation,
    Program,
    Repeat,
    Statement,
    Variable,
    flat,
)
from identification.arrays import Array
from identification.errors import BadModel
from identification.model.karnopp import Karnopp

SHORTEST_TEST = 120  # samples
TEST_TURNS = 24  # of the position controller, at least
TEST_PASSES = 4  # through its longest filter, at least
TEST_SPEEDS = (0.0, 3.0, 0.75, 0.25, 0.0)  # of the test's motion, in parts of the band's limits
TEST_PUSHES = (
    1.0,
    10.0,
    100.0,
    1000.0,
)  # of its error and force, the first that reaches every branch


class ProgramRun:
    """A program with its states, from rest at y_0; `step` once every h [s].

    real: np.float64 or np.float32. visited: the branches taken so far, (choice, which).
    """

    def __init__(
        self, program: Program, y_0: float = 0.0, real: type[np.floating[Any]] = np.float64
    ) -> None:
        self._program, self._real = program, real
        self.visited: set[tuple[int, bool]] = set()
        self._arrays: dict[str, list[Any]] = {
            one.name: [real(value) for value in one.values] for one in program.tables
        }
        self._values: dict[str, Any] = {one.name: real(one.value) for one in program.constants}
        for one in program.states:
            made = int if one.kind == "integer" else real
            start = [made(real(value) * real(y_0)) for value in one.at_rest]
            if one.array:
                self._arrays[one.name] = start
            else:
                self._values[one.name] = start[0]

    def step(self, *inputs: float) -> Any:
        """The output for the inputs, in the program's order."""
        for signal, value in zip(self._program.inputs, inputs, strict=True):
            self._values[signal.name] = self._real(value)
        self._run(self._program.statements)
        return self._values[self._program.output.name]

    def _run(self, statements: Sequence[Statement]) -> None:
        for one in statements:
            match one:
                case Assign(Variable(name), value):
                    self._values[name] = self._value(value)
                case Assign(Element(array, index), value):
                    self._arrays[array][self._value(index)] = self._value(value)
                case Choice(condition, then, otherwise):
                    holds = bool(self._value(condition))
                    self.visited.add((id(one), holds))
                    self._run(then if holds else otherwise)
                case Repeat(index, count, body):
                    for at in range(count):
                        self._values[index.name] = at
                        self._run(body)

    def _value(self, expression: Expression) -> Any:
        match expression:
            case Number(value):
                return value if isinstance(value, int) else self._real(value)
            case Constant(name) | Variable(name):
                return self._values[name]
            case Element(array, index):
                return self._arrays[array][self._value(index)]
            case Operation("and", arguments):
                return all(self._value(one) for one in arguments)
            case Operation("or", arguments):
                return any(self._value(one) for one in arguments)
            case Operation(operator, arguments):
                return _worked_out(operator, [self._value(one) for one in arguments])


def _worked_out(operator: str, values: list[Any]) -> Any:
    """One operation; min and max as in Python, on which all languages here agree."""
    match operator, values:
        case "abs", [a]:
            return abs(a)
        case "negative", [a]:
            return -a
        case "not", [a]:
            return not a
        case "+", [a, b]:
            return a + b
        case "-", [a, b]:
            return a - b
        case "*", [a, b]:
            return a * b
        case "/", [a, b]:
            return a / b
        case "min", [a, b]:
            return b if b < a else a
        case "max", [a, b]:
            return b if b > a else a
        case (("<" | "<=" | ">" | ">="), [a, b]):
            low, high = (a, b) if operator[0] == "<" else (b, a)
            return low < high or (len(operator) == 2 and low == high)
        case "==", [a, b]:
            return a == b
        case "!=", [a, b]:
            return a != b
    raise ValueError(f"operator {operator!r} of {len(values)} values")


@dataclass(frozen=True, eq=False)
class SelfTest:
    """Inputs (n, inputs) from rest at position 0, and the outputs (n,) that a program gives."""

    inputs: Array
    outputs: Array


def self_test(
    program: Program, p: Karnopp, e_T: float, real: type[np.floating[Any]] = np.float64
) -> SelfTest:
    """A vector that leads the program through friction's bands both ways, and to its limits.

    p: the friction, e_T [m] the error scale, by which the motion is measured. The outputs are
    those of a machine that rounds to `real`. Raises BadModel where they are no numbers.
    """
    for scale in TEST_PUSHES:
        inputs = _motion(program, p, e_T, scale)
        run = ProgramRun(program, 0.0, real)
        with np.errstate(all="ignore"):
            found = SelfTest(inputs, np.array([float(run.step(*row)) for row in inputs.tolist()]))
        if not np.all(np.isfinite(found.outputs)):
            raise BadModel(
                f"the controller gives no number after {int(np.sum(np.isfinite(found.outputs)))}"
                " samples; check its coefficients, gains and friction"
            )
        if len(run.visited) == 2 * sum(isinstance(one, Choice) for one in flat(program.statements)):
            break
    return found


def _motion(program: Program, p: Karnopp, e_T: float, scale: float) -> Array:
    """Inputs (n, inputs): rest, sliding, creep in the wide band and the narrow one, forwards and
    back; in its last part error and force are `scale` times as large."""
    turns = max([TEST_TURNS, *(TEST_PASSES * len(one.values) for one in program.tables)])
    n = max(SHORTEST_TEST, turns * program.ratio)
    part = np.arange(n) / n
    edges = np.linspace(0.0, 0.5, len(TEST_SPEEDS) + 1)
    place = np.clip(np.searchsorted(edges, part % 0.5, side="right") - 1, 0, len(TEST_SPEEDS) - 1)
    y = np.cumsum(np.where(part < 0.5, p.dv_p, p.dv_n) * np.array(TEST_SPEEDS)[place]) * program.h
    push = np.where(part < 0.8, 1.0, scale)
    side = np.where(part % 0.1 < 0.05, 1.0, -1.0)
    error = push * side * e_T * np.where(part % 0.3 < 0.15, 0.4, 6.0)
    force = push * 1.5 * np.where(np.arange(n) % 7 < 4, p.F_sp, p.F_sn) * np.cos(40.0 * part)
    columns = {"r": y + error, "y": y, "F_e": force}
    return np.array([[float(f"{v:.6g}") for v in columns[one.name]] for one in program.inputs]).T
