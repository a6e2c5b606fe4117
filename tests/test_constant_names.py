"""A constant's name means one thing in all three packages; what two modules share is imported."""

import ast
from collections.abc import Iterator
from pathlib import Path

from tests.test_lengths import ROOT, files, tree

TOLERATED = {"EFFECT"}  # every effect's file has one, by contract


def assigned(path: Path) -> Iterator[str]:
    """Names that the module gives a value."""
    for node in tree(path).body:
        if isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            for one in (part for target in targets for part in ast.walk(target)):
                if isinstance(one, ast.Name) and isinstance(one.ctx, ast.Store):
                    yield one.id


def test_no_constant_is_defined_in_two_modules() -> None:
    places: dict[str, set[str]] = {}
    for path in files():
        for name in filter(str.isupper, assigned(path)):
            places.setdefault(name, set()).add(path.relative_to(ROOT).as_posix())
    assert len(places) > 500
    twice = {name: found for name, found in places.items() if len(found) > 1}
    assert twice.keys() == TOLERATED, twice
