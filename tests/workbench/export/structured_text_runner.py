"""Structured Text run here: parsed by the grammar tree-sitter-iec61131-3-st, each node translated
into a Python function. No PLC's own compiler is to be had by a package manager; this is what the
tests run."""

import math
import operator
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import tree_sitter_iec61131_3_st
from tree_sitter import Language, Node, Parser

PARSER = Parser(Language(tree_sitter_iec61131_3_st.language()))
BINARY: Mapping[str, Callable[[Any, Any], Any]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
    "=": operator.eq,
    "<>": operator.ne,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
    "AND": lambda a, b: a and b,
    "OR": lambda a, b: a or b,
}
FUNCTIONS: Mapping[str, Callable[..., Any]] = {
    "min": lambda a, b: b if b < a else a,
    "max": lambda a, b: b if b > a else a,
    "abs": abs,
    "cos": math.cos,
}
ZERO = {"LREAL": 0.0, "REAL": np.float32(0.0), "DINT": 0, "BOOL": False}
Values = dict[str, Any]
Read = Callable[[Values], Any]


def text(node: Node | None) -> str:
    """The node's text; of a name in small letters, since a name's case means nothing."""
    assert node is not None and node.text is not None
    found = node.text.decode()
    return found.lower() if node.type == "identifier" else found


def faults(node: Node) -> list[str]:
    """Places that are no Structured Text."""
    own = [f"{node.start_point}: {text(node)[:60]}"] if node.is_error or node.is_missing else []
    return own + [fault for child in node.children for fault in faults(child)]


class Blocks:
    """The function blocks of a file, by name."""

    def __init__(self, source: str) -> None:
        root = PARSER.parse(source.encode()).root_node
        assert faults(root) == []
        self.by_name = {
            text(node.child_by_field_name("name")): node
            for node in root.children
            if node.type == "function_block_declaration"
        }

    def made(self, name: str) -> "FunctionBlock":
        """A new instance of a block."""
        return FunctionBlock(self, self.by_name[name.lower()])


class FunctionBlock:
    """An instance: `values` by name in small letters; called with its inputs."""

    def __init__(self, blocks: Blocks, node: Node) -> None:
        self._blocks = blocks
        self.values: Values = {}
        self._real: Callable[[str], Any] = float
        declared = [one for part in node.children for one in part.children]
        for one in declared:
            if one.type == "variable_declaration":
                self._declare(one)
        self._body = [self._statement(one) for one in node.children_by_field_name("body")]

    def __call__(self, **inputs: Any) -> None:
        self.values.update({name.lower(): value for name, value in inputs.items()})
        for statement in self._body:
            statement(self.values)

    def _declare(self, node: Node) -> None:
        name, kind = (text(node.child_by_field_name(key)) for key in ("names", "type"))
        shape = node.child_by_field_name("type")
        assert shape is not None
        assert name not in self.values, f"{name} is declared twice"
        size = 0
        if shape.type == "array_type":
            first, last = (
                int(text(child))
                for child in shape.child_by_field_name("range").children[::2]  # type: ignore[union-attr]
            )
            assert first == 0
            size, kind = last + 1, text(shape.child_by_field_name("element_type"))
        if kind == "REAL":
            self._real = np.float32
        start = [
            self._literal(one) for one in node.children_by_field_name("initial_value")
            if one.type.endswith("_literal")
        ]  # fmt: skip
        if kind not in ZERO:
            self.values[name] = self._blocks.made(kind)
            return
        assert len(start) in (0, size or 1)
        entries = start or [ZERO[kind]] * (size or 1)
        self.values[name] = entries if size else entries[0]

    def _literal(self, node: Node) -> Any:
        if node.type == "integer_literal":
            return int(text(node))
        if node.type == "boolean_literal":
            return text(node) == "TRUE"
        assert node.type == "real_literal"
        return self._real(text(node))

    def _statement(self, node: Node) -> Callable[[Values], None]:
        match node.type:
            case "assignment_statement":
                return self._assignment(node)
            case "if_statement":
                return self._choice(node)
            case "for_statement":
                return self._loop(node)
            case "invocation_statement":
                return self._invocation(node.children[0])
            case "empty_statement" | "comment" | ";":
                return lambda values: None
        raise AssertionError(f"{node.type}: {text(node)}")

    def _assignment(self, node: Node) -> Callable[[Values], None]:
        target, value = node.child_by_field_name("left"), self._read(node, "right")
        assert target is not None
        if target.type == "identifier":
            name = text(target)
            assert name in self.values, f"{name} is not declared"
            return lambda values: values.__setitem__(name, value(values))
        array, index = text(target.child_by_field_name("object")), self._read(target, "index")
        return lambda values: values[array].__setitem__(index(values), value(values))

    def _choice(self, node: Node) -> Callable[[Values], None]:
        condition = self._read(node, "condition")
        then = [self._statement(one) for one in node.children_by_field_name("consequence")]
        last = [one for one in node.children if one.type == "else_clause"]
        otherwise = [
            self._statement(one) for part in last for one in part.children_by_field_name("body")
        ]
        assert all(one.type != "elsif_clause" for one in node.children)

        def run(values: Values) -> None:
            for one in then if condition(values) else otherwise:
                one(values)

        return run

    def _loop(self, node: Node) -> Callable[[Values], None]:
        index = text(node.child_by_field_name("control"))
        start, end = self._read(node, "start"), self._read(node, "end")
        body = [self._statement(one) for one in node.children_by_field_name("body")]
        assert index in self.values

        def run(values: Values) -> None:
            for at in range(start(values), end(values) + 1):
                values[index] = at
                for one in body:
                    one(values)

        return run

    def _invocation(self, node: Node) -> Callable[[Values], None]:
        called = text(node.child_by_field_name("function"))
        given = node.child_by_field_name("arguments")
        assert given is not None
        inputs = {
            text(one.child_by_field_name("name")): self._read(one, "value")
            for one in given.children
            if one.type == "named_argument"
        }
        return lambda values: values[called](**{n: read(values) for n, read in inputs.items()})

    def _read(self, node: Node, field: str) -> Read:
        found = node.child_by_field_name(field)
        assert found is not None
        return self._value(found)

    def _value(self, node: Node) -> Read:
        match node.type:
            case "identifier":
                name = text(node)
                assert name in self.values, f"{name} is not declared"
                return lambda values: values[name]
            case "real_literal" | "integer_literal" | "boolean_literal":
                value = self._literal(node)
                return lambda values: value
            case "parenthesized_expression":
                return self._value(node.children[1])
            case "index_expression":
                array, index = text(node.child_by_field_name("object")), self._read(node, "index")
                return lambda values: values[array][index(values)]
            case "member_access_expression":
                block, member = (
                    text(node.child_by_field_name(key)).lower() for key in ("object", "member")
                )
                return lambda values: values[block].values[member]
            case "unary_expression":
                inner = self._read(node, "operand")
                if text(node.child_by_field_name("operator")) == "NOT":
                    return lambda values: not inner(values)
                return lambda values: -inner(values)
            case "binary_expression":
                work_out = BINARY[text(node.child_by_field_name("operator"))]
                left, right = self._read(node, "left"), self._read(node, "right")
                return lambda values: work_out(left(values), right(values))
            case "call_expression":
                function = FUNCTIONS[text(node.child_by_field_name("function"))]
                given = node.child_by_field_name("arguments")
                assert given is not None
                reads = [self._value(one) for one in given.children if one.is_named]
                return lambda values: function(*(read(values) for read in reads))
        raise AssertionError(f"{node.type}: {text(node)}")
