"""Functions short enough to be read at once and called without counting arguments.

The linter counts branches, this counts lines and arguments.
"""

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[1]
MOST_LINES, MOST_ARGUMENTS = 60, 8
COMPILED = {
    "compiled",
    "compiled_exact",
    "compiled_inline",
    "compiled_fast",
}  # kernels take what they need
EQUATIONS = {"value", "evolve", "initial"}  # of an effect; compiled under one signature


def too_long(path: Path) -> Iterator[str]:
    """Functions of the file, kernels apart, that have more lines."""
    for node, decorators in functions(path):
        lines = (node.end_lineno or node.lineno) - node.lineno + 1
        if lines > MOST_LINES and not decorators & COMPILED:
            yield f"{path.relative_to(ROOT).as_posix()}: {node.name} has {lines}"


def too_wide(path: Path) -> Iterator[str]:
    """Functions of the file that take more arguments.

    Apart from kernels, equations of effects, and commands, whose arguments are their options.
    """
    for node, decorators in functions(path):
        given = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
        count = sum(one.arg not in ("self", "cls") for one in given)
        equation = path.parent.name == "effects" and node.name in EQUATIONS
        command = any(name.endswith(".command") for name in decorators)
        if count > MOST_ARGUMENTS and not (decorators & COMPILED or equation or command):
            yield f"{path.relative_to(ROOT).as_posix()}: {node.name} takes {count}"


@cache
def tree(path: Path) -> ast.Module:
    """The file's syntax."""
    return ast.parse(path.read_text("utf-8"))


def functions(path: Path) -> Iterator[tuple[ast.FunctionDef | ast.AsyncFunctionDef, set[str]]]:
    """Functions of the file with the names of their decorators."""
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            called = (d.func if isinstance(d, ast.Call) else d for d in node.decorator_list)
            yield node, {ast.unparse(name) for name in called}


def files() -> list[Path]:
    """The files of the three packages and of the studies."""
    folders = ("identification", "design", "workbench", "studies")
    every = [path for name in folders for path in (ROOT / name).rglob("*.py")]
    return [path for path in every if "migrations" not in path.parts]  # lists of tables


def test_no_function_is_longer_than_a_screen() -> None:
    assert len(files()) > 200
    assert [line for path in files() for line in too_long(path)] == []


def test_no_function_takes_more_arguments_than_can_be_kept_apart() -> None:
    assert [line for path in files() for line in too_wide(path)] == []
