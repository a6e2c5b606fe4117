"""JSON and MAT: the program run from the file alone, and the values read back."""

import io
import json
from typing import Any

import numpy as np
import pytest
from scipy.io import loadmat

from design.generated.exported import exported
from design.servo import Compensation
from tests.workbench.export.designs import NAMES, case
from workbench.export.data import json_file, mat_file

OPERATORS: dict[str, Any] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": lambda a, b: a / b,
    "min": lambda a, b: b if b < a else a,
    "max": lambda a, b: b if b > a else a,
    "abs": abs,
    "negative": lambda a: -a,
    "not": lambda a: not a,
    "and": lambda *a: all(a),
    "or": lambda *a: any(a),
    "<": lambda a, b: a < b,
    "<=": lambda a, b: a <= b,
    ">": lambda a, b: a > b,
    ">=": lambda a, b: a >= b,
    "==": lambda a, b: a == b,
    "!=": lambda a, b: a != b,
}


def run(statements: list[Any], values: dict[str, Any]) -> None:
    """The statements, as `docs/contract.md` says what they are."""
    for kind, *rest in statements:
        if kind == "=" and isinstance(rest[0], list):
            _, array, index = rest[0]
            values[array][value(index, values)] = value(rest[1], values)
        elif kind == "=":
            values[rest[0]] = value(rest[1], values)
        elif kind == "if":
            run(rest[1] if value(rest[0], values) else rest[2], values)
        elif kind == "for":
            for at in range(rest[1]):
                values[rest[0]] = at
                run(rest[2], values)
        else:
            assert kind == "#"


def value(expression: Any, values: dict[str, Any]) -> Any:
    """The value of an expression."""
    if isinstance(expression, str):
        return values[expression]
    if not isinstance(expression, list):
        return expression
    head, *rest = expression
    if head == "[]":
        return values[rest[0]][value(rest[1], values)]
    return OPERATORS[head](*(value(one, values) for one in rest))


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_the_program_runs_from_the_file_alone(name: str) -> None:
    (text,) = json_file(exported(case(name).design, compensated=True)).values()
    found = json.loads(text)
    assert found["schema"] == "program/1"
    values: dict[str, Any] = {one["name"]: one["value"] for one in found["constants"]}
    values |= {one["name"]: list(one["values"]) for one in found["tables"]}
    for one in found["states"]:
        start = [0.0 * entry for entry in one["at_rest"]]
        whole = [int(entry) for entry in start] if one["kind"] == "integer" else start
        values[one["name"]] = whole if one["array"] else whole[0]
    for row, wanted in zip(found["test"]["inputs"], found["test"]["outputs"], strict=True):
        values |= dict(zip((one["name"] for one in found["inputs"]), row, strict=True))
        run(found["program"], values)
        assert values[found["output"]["name"]] == wanted


@pytest.mark.slow
@pytest.mark.parametrize("compensated", [True, False])
@pytest.mark.parametrize("name", ["limited", "emps"])
def test_matlab_reads_the_law_and_the_test(name: str, compensated: bool) -> None:
    what = exported(case(name).design, compensated=compensated)
    (content,) = mat_file(what).values()
    packed: Any = io.BytesIO(content)  # the stubs know paths only
    found = loadmat(packed, simplify_cells=True)[what.program.name]
    for letter in "RSTW":
        assert np.array_equal(found["law"][letter], getattr(what.loop.law, letter))
    assert found["h"] == what.loop.h and found["law"]["h"] == what.loop.law.h
    assert found["limit"] == what.loop.limit
    assert np.array_equal(found["test"]["u"], what.test.outputs)
    assert np.array_equal(found["test"]["y"], what.test.inputs[:, 1])
    if compensated:
        assert isinstance(what.loop.compensation, Compensation)
        own, filters = what.loop.compensation.compensator, what.loop.compensation.filters
        assert found["compensator"]["F_sp"] == own.friction.F_sp
        assert found["compensator"]["e_T"] == own.e_T
        assert np.array_equal(found["compensator"]["filters"]["A"]["a"], filters.velocity.a)
    else:
        assert np.size(found["compensator"]) == 0
