"""Reads a compiled kernel's Python source into the statements of a `Program`.

What is known when the program is made (which controller, how many coefficients) is worked out
here; what is left is the arithmetic of one step. Calls of other kernels are read in place, local
values keep their names, loops stay loops.
"""

import ast
import inspect
import math
import operator
import textwrap
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from types import FunctionType
from typing import Any

from design.program import (
    Assign,
    Choice,
    Constant,
    Element,
    Expression,
    Number,
    Operation,
    Operator,
    Remark,
    Repeat,
    Statement,
    Variable,
    kind_of,
    parts,
)
from identification.errors import BadModel

OPERATORS: dict[type[ast.AST], tuple[Operator, Callable[[Any, Any], Any]]] = {
    ast.Add: ("+", operator.add),
    ast.Sub: ("-", operator.sub),
    ast.Mult: ("*", operator.mul),
    ast.Div: ("/", operator.truediv),
    ast.Lt: ("<", operator.lt),
    ast.LtE: ("<=", operator.le),
    ast.Gt: (">", operator.gt),
    ast.GtE: (">=", operator.ge),
    ast.Eq: ("==", operator.eq),
    ast.NotEq: ("!=", operator.ne),
}
EXPRESSIONS = (Number, Constant, Variable, Element, Operation)


@dataclass(frozen=True)
class NamedArray:
    """An array that a kernel is given: a table, which has `values`, or a state.

    slots: the names of its entries where each has one; integer: whether it holds counts.
    """

    name: str
    size: int
    meaning: str
    values: tuple[float, ...] = ()
    slots: tuple[str, ...] = ()
    integer: bool = False

    def entry(self, index: Any) -> Expression:
        """The entry at a known or unknown index."""
        if not self.slots:
            return Element(self.name, as_expression(index))
        slot = self.slots[index]
        if self.values:
            return Constant(slot, self.values[index])
        return Variable(slot, "integer" if self.integer else "real")


@dataclass
class Frame:
    """A kernel that is being read: what its names mean, and the variables of its own."""

    function: FunctionType
    means: dict[str, Any]
    own: dict[str, Variable] = field(default_factory=dict)


class KernelReader:
    """Reads kernels one behind the other: `statements`, and their `locals` by name.

    inputs: names that no statement gives a value; taken: those of constants, tables and states.
    """

    def __init__(self, inputs: Iterable[str], taken: Iterable[str]) -> None:
        self.statements: list[Statement] = []
        self.locals: dict[str, Variable] = {}
        self._inputs = set(inputs)
        self._taken = {name.lower() for name in (*self._inputs, *taken)}
        self._in_use: set[str] = set()
        self._written: list[str] = []

    def read(self, kernel: Any, arguments: Sequence[Any]) -> Any:
        """What the kernel returns for these arguments, its statements put behind the others.

        Raises BadModel where it does what no program can say.
        """
        function = getattr(kernel, "py_func", None)
        if not isinstance(function, FunctionType):
            raise BadModel(f"{getattr(kernel, '__name__', kernel)!r} has no form in a program")
        (tree,) = ast.parse(textwrap.dedent(inspect.getsource(function))).body
        assert isinstance(tree, ast.FunctionDef)
        names = [one.arg for one in tree.args.args]
        frame = Frame(function, dict(zip(names, arguments, strict=True)))
        written = len(self._written)
        result = self._block(tree.body, frame)
        self._in_use -= {one.name for one in frame.own.values()}
        self._refuse_changed(arguments, written)
        return result

    def _block(self, body: Sequence[ast.stmt], frame: Frame) -> Any:
        """What the statements return, None where they do not."""
        for at, one in enumerate(body):
            rest = body[at + 1 :]
            match one:
                case ast.If(test=test, body=then, orelse=otherwise):
                    condition = self._value(test, frame)
                    if (known := known_value(condition)) is not None:
                        return self._block([*(then if known else otherwise), *rest], frame)
                    if any(isinstance(inner, ast.Return) for inner in ast.walk(one)):
                        ends = [
                            self._ending([*branch, *rest], frame) for branch in (then, otherwise)
                        ]
                        return self._either(condition, frame.function.__name__, ends, frame)
                    self._choice(condition, (then, otherwise), frame)
                case ast.Return(value=value):
                    name = frame.function.__name__
                    return None if value is None else self._value(value, frame, name)
                case _:
                    self._statement(one, frame)
        return None

    def _ending(self, body: Sequence[ast.stmt], frame: Frame) -> Callable[[], Any]:
        return lambda: self._block(body, frame)

    def _statement(self, one: ast.stmt, frame: Frame) -> None:
        match one:
            case ast.Assign(targets=[target], value=value):
                name = target.id if isinstance(target, ast.Name) else "chosen"
                self._assign(target, self._value(value, frame, name), frame)
            case ast.AugAssign(target=target, op=op, value=value):
                loaded = ast.parse(ast.unparse(target), mode="eval").body
                self._assign(target, self._value(ast.BinOp(loaded, op, value), frame), frame)
            case ast.For(target=ast.Name(id=name), iter=ast.Call(args=[count]), body=body):
                self._repeat(name, known_value(self._value(count, frame)), body, frame)
            case ast.Expr(value=ast.Constant()):
                pass
            case ast.Expr(value=value):
                self._value(value, frame)
            case _:
                raise _unsayable(one, frame)

    def _assign(self, target: ast.expr, value: Any, frame: Frame) -> None:
        match target:
            case ast.Tuple(elts=targets):
                for at, each in enumerate(targets):
                    written = len(self._written)
                    self._assign(each, value[at], frame)
                    self._refuse_changed(value[at + 1 :], written)
            case ast.Name(id=name):
                given = isinstance(value, Constant) or not isinstance(value, EXPRESSIONS)
                if given or (isinstance(value, Variable) and value.name in self._inputs):
                    frame.means[name] = value
                else:
                    frame.means[name] = self._variable(name, value, frame)
            case ast.Subscript(value=array, slice=index):
                place = self._value(array, frame).entry(self._value(index, frame))
                self._emit(place, as_expression(value))
            case _:
                raise _unsayable(target, frame)

    def _variable(self, name: str, value: Any, frame: Frame) -> Variable:
        """The value as a variable of the kernel's own."""
        value = as_expression(value)
        if name not in frame.own:
            kind, free, number = kind_of(value), name, 1
            while not self._free(free, kind):
                number += 1
                free = f"{name}_{number}"
            frame.own[name] = self.locals.setdefault(free, Variable(free, kind))
            self._in_use.add(free)
        if frame.own[name] != value:
            self._emit(frame.own[name], value)
        return frame.own[name]

    def _free(self, name: str, kind: str) -> bool:
        """Whether a new variable may have the name, upper and lower case being the same."""
        other = {one.lower(): one for one in self.locals}.get(name.lower(), name)
        if name.lower() in self._taken or name in self._in_use or other != name:
            return False
        return name not in self.locals or self.locals[name].kind == kind

    def _repeat(self, name: str, count: Any, body: Sequence[ast.stmt], frame: Frame) -> None:
        """A loop; a single round is read in place."""
        if not isinstance(count, int):
            raise BadModel(f"a loop of {count} rounds has no form in a program")
        if count == 1:
            frame.means[name] = 0
            self._block(body, frame)
        if count <= 1:
            return
        index = Variable(name, "integer")
        if not self._free(name, index.kind):
            raise BadModel(f"the index {name!r} of a loop has another meaning")
        self.locals[name] = index
        self._in_use.add(name)
        before = {**frame.means, name: index}
        frame.means = dict(before)
        inside = self._read(self._ending(body, frame))
        self._in_use.remove(name)
        if any(frame.means[key] != value for key, value in before.items()):
            raise BadModel("a loop that changes what is known has no form in a program")
        self.statements.append(Repeat(index, count, inside))

    def _choice(
        self, condition: Expression, branches: Sequence[Sequence[ast.stmt]], frame: Frame
    ) -> None:
        """A condition whose branches both go on behind it."""
        start, ends = frame.means, []
        blocks = []
        for body in branches:
            frame.means = dict(start)
            blocks.append(self._read(self._ending(body, frame)))
            ends.append(frame.means)
        frame.means = {name: ends[0][name] for name in ends[0] if name in ends[1]}
        for name in [key for key in frame.means if ends[0][key] != ends[1][key]]:
            for at, end in enumerate(ends):
                blocks[at] += self._read(lambda n=name, e=end: self._variable(n, e[n], frame))  # type: ignore[misc]
            frame.means[name] = frame.own[name]
        self.statements.append(Choice(condition, blocks[0], blocks[1]))

    def _either(
        self, condition: Expression, name: str, values: Sequence[Callable[[], Any]], frame: Frame
    ) -> Variable:
        """One value or the other, under a name of the kernel's own."""
        start, blocks = frame.means, []
        for value in values:
            frame.means = dict(start)
            blocks.append(self._read(lambda v=value: self._variable(name, v(), frame)))  # type: ignore[misc]
        frame.means = start
        self.statements.append(Choice(condition, blocks[0], blocks[1]))
        return frame.own[name]

    def _read(self, read: Callable[[], object]) -> tuple[Statement, ...]:
        """The statements that come with reading something."""
        outside, self.statements = self.statements, []
        read()
        inside, self.statements = self.statements, outside
        return tuple(inside)

    def _emit(self, target: Expression, value: Expression) -> None:
        assert isinstance(target, Variable | Element)
        self._written.append(_named(target))
        self.statements.append(Assign(target, value))

    def _refuse_changed(self, values: Iterable[Any], since: int) -> None:
        """Raises BadModel where a value that is still to be used was written over."""
        reads = {
            _named(part)
            for value in values
            if isinstance(value, EXPRESSIONS)
            for part in parts(value)
            if isinstance(part, Variable | Element)
        }
        if changed := reads & set(self._written[since:]):
            raise BadModel(f"{', '.join(sorted(changed))}: used after it has changed")

    def _value(self, node: ast.expr, frame: Frame, name: str = "chosen") -> Any:
        """What an expression is: known, or to be worked out by the program.

        name: of the variable that takes it where it depends on a condition.
        """
        match node:
            case ast.Constant(value=value):
                return value
            case ast.Name(id=each):
                return (
                    frame.means[each] if each in frame.means else frame.function.__globals__[each]
                )
            case ast.Attribute(value=value, attr=attribute):
                return getattr(self._value(value, frame), attribute)
            case ast.Subscript(value=value, slice=index):
                array, at = self._value(value, frame), self._value(index, frame)
                return array.entry(at) if isinstance(array, NamedArray) else array[at]
            case ast.Tuple(elts=each):
                return tuple(self._values(each, frame))
            case ast.BinOp(left=left, op=op, right=right) if type(op) in OPERATORS:
                return _combined(OPERATORS[type(op)], *self._values((left, right), frame))
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                value = self._value(operand, frame)
                return Operation("negative", (value,)) if isinstance(value, EXPRESSIONS) else -value
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                value = self._value(operand, frame)
                known = known_value(value)
                return Operation("not", (value,)) if known is None else not known
            case ast.IfExp(test=test, body=then, orelse=otherwise):
                condition = self._value(test, frame)
                if (known := known_value(condition)) is not None:
                    return self._value(then if known else otherwise, frame, name)
                ends = [lambda n=each: self._value(n, frame) for each in (then, otherwise)]
                return self._either(condition, name, ends, frame)
            case ast.Compare() | ast.BoolOp():
                return self._condition(node, frame)
            case ast.Call(func=ast.Name(id=called), args=given):
                return self._call(called, self._values(given, frame), frame)
        raise _unsayable(node, frame)

    def _values(self, nodes: Sequence[ast.expr], frame: Frame) -> list[Any]:
        """The values of expressions, one after the other."""
        found: list[Any] = []
        for node in nodes:
            written = len(self._written)
            found.append(self._value(node, frame))
            self._refuse_changed(found[:-1], written)
        return found

    def _condition(self, node: ast.Compare | ast.BoolOp, frame: Frame) -> Any:
        """A comparison, a chain of them, or what `and` and `or` make of conditions."""
        if isinstance(node, ast.BoolOp):
            both = isinstance(node.op, ast.And)
            found = []
            for one in node.values:
                value = self._value(one, frame)
                known = known_value(value)
                if known is None:
                    found.append(value)
                elif known is not both:
                    return known
        else:
            both, ends = True, [node.left, *node.comparators]
            values = self._values(ends, frame)
            found = [
                _combined(OPERATORS[type(op)], values[at], values[at + 1])
                for at, op in enumerate(node.ops)
            ]
            if all(isinstance(one, bool) for one in found):
                return all(found)
        if len(found) < 2:
            return found[0] if found else both
        return Operation("and" if both else "or", tuple(found))

    def _call(self, called: str, given: list[Any], frame: Frame) -> Any:
        match called, given:
            case "float", [value]:
                return value
            case "len", [NamedArray(size=size)]:
                return size
            case "abs", [value]:
                return Operation("abs", (as_expression(value),))
            case ("min" | "max") as limit, [value, bound]:
                # A bound that nothing reaches bounds nothing.
                if known_value(bound) == (math.inf if limit == "min" else -math.inf):
                    return value
                return Operation(limit, (as_expression(value), as_expression(bound)))
        kernel = frame.function.__globals__.get(called)
        outside, self.statements = self.statements, []
        result = self.read(kernel, given)
        inside, self.statements = self.statements, outside
        if inside:
            self.statements += [Remark(_purpose(kernel, given)), *inside]
        return result


def _purpose(kernel: Any, given: Sequence[Any]) -> str:
    """What a call is for: by the first array that it is given, or in the kernel's own words."""
    arrays = (one.meaning for one in given if isinstance(one, NamedArray) and one.meaning)
    return next(arrays, (inspect.getdoc(kernel.py_func) or "").partition("\n\n")[0])


def known_value(value: Any) -> Any:
    """The number or truth that is known of a value; None where the program has to work it out."""
    match value:
        case bool() | int() | float():
            return value
        case Constant(value=number) | Number(value=number):
            return number
        case Operation(operator="negative", arguments=(inner,)):
            number = known_value(inner)
            return None if number is None else -number
    return None


def as_expression(value: Any) -> Expression:
    """A value as the program takes it; raises BadModel where it is no number."""
    if isinstance(value, EXPRESSIONS):
        return value
    if isinstance(value, int | float) and not isinstance(value, bool):
        return Number(value)
    raise BadModel(f"{value!r} has no form in a program")


def _combined(how: tuple[Operator, Callable[[Any, Any], Any]], left: Any, right: Any) -> Any:
    """Two values under an operator: worked out where both are plain, or compared where known."""
    symbol, work_out = how
    if not (isinstance(left, EXPRESSIONS) or isinstance(right, EXPRESSIONS)):
        return work_out(left, right)
    known = (known_value(left), known_value(right))
    if None not in known and symbol not in "+-*/":
        return bool(work_out(*known))
    return Operation(symbol, (as_expression(left), as_expression(right)))


def _named(target: Variable | Element) -> str:
    return target.name if isinstance(target, Variable) else target.array


def _unsayable(node: ast.AST, frame: Frame) -> BadModel:
    return BadModel(f"{frame.function.__name__}: {ast.unparse(node)!r} has no form in a program")
