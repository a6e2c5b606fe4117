"""Functions short enough to be read at once: the linter counts branches, this counts lines."""

import ast
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
MOST = 60  # lines
COMPILED = ("compiled", "compiled_inline", "compiled_fast")  # kernels take what they need


def too_long(path: Path) -> Iterator[str]:
    """Functions of the file, kernels apart, that have more lines."""
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            names = {d.id for d in node.decorator_list if isinstance(d, ast.Name)}
            lines = (node.end_lineno or node.lineno) - node.lineno + 1
            if lines > MOST and not names & set(COMPILED):
                yield f"{path.relative_to(ROOT)}: {node.name} has {lines} lines"


def test_no_function_is_longer_than_a_screen() -> None:
    folders = ("identification", "design", "workbench")
    every = [path for name in folders for path in (ROOT / name).rglob("*.py")]
    files = [path for path in every if "migrations" not in path.parts]  # lists of tables
    assert len(files) > 200
    assert [line for path in files for line in too_long(path)] == []
