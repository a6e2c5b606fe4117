"""A kernel's cache on disk counts while all that the kernel is made of is as it was."""

import importlib
import linecache
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from identification.compiled import kernel_pointer

FILES = {
    "rig/__init__.py": "",
    "rig/friction/__init__.py": "",
    "rig/friction/levels.py": "LEVEL = 3.0\nUNUSED = 1.0\nBOTH = (1.0, 2.0)\n",
    "rig/friction/shape.py": """
        from identification.compiled import compiled
        from rig.friction.levels import BOTH, LEVEL

        @compiled
        def shape(v):
            return LEVEL * v + BOTH[1]
        """,
    "rig/runs/__init__.py": "",
    "rig/runs/step.py": """
        from identification.compiled import compiled
        import rig.friction.shape as friction

        GAIN = 1.0

        @compiled
        def step(v):
            return GAIN * friction.shape(v)
        """,
    "rig/runs/record.py": """
        from typing import NamedTuple
        from identification.compiled import compiled

        class Memory(NamedTuple):
            here: float
            before: float

        @compiled
        def older(m: Memory):
            return m.before
        """,
    "rig/runs/beside.py": "GAIN = 1.0\n",
    "rig/run.py": """
        from identification.compiled import compiled
        from rig.runs.beside import GAIN
        from rig.runs.record import Memory, older
        from rig.runs.step import step

        UNHEARD = GAIN

        @compiled
        def run(v, m: Memory):
            return step(v) + LATER + older(m)

        LATER = 0.5

        def value(t, y, v, F, u, d, z, c, f, s, p):
            return step(v)
        """,
}


def written(folder: Path, name: str, text: str) -> None:
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = text.splitlines()
    indent = min((len(x) - len(x.lstrip()) for x in lines if x.strip()), default=0)
    path.write_text("\n".join(line[indent:] for line in lines) + "\n")


Load = Callable[[], Any]


@pytest.fixture
def load(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Load]:
    """A function that imports the package anew, as the next process does."""
    for name, text in FILES.items():
        written(tmp_path, name, text)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(sys, "dont_write_bytecode", True)  # a clock's second holds two edits

    def forgotten() -> None:
        for name in [m for m in sys.modules if m.partition(".")[0] == "rig"]:
            del sys.modules[name]
        importlib.invalidate_caches()
        linecache.clearcache()

    def anew() -> Any:
        forgotten()
        return importlib.import_module("rig.run")

    yield anew
    forgotten()


def result(module: Any) -> tuple[float, bool]:
    """What the kernel gives at v = 2, and whether it came from the disk."""
    record = sys.modules["rig.runs.record"]
    out = module.run(2.0, record.Memory(here=0.0, before=0.0))
    hits, misses = module.run.stats.cache_hits, module.run.stats.cache_misses
    assert sum(hits.values()) + sum(misses.values()) == 1
    return out, bool(hits)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "before", "after", "expected"),
    [
        ("rig/run.py", "LATER = 0.5", "LATER = 1.5", 9.5),
        ("rig/runs/step.py", "GAIN = 1.0", "GAIN = 2.0", 16.5),
        ("rig/friction/shape.py", "LEVEL * v", "LEVEL * v * v", 14.5),
        ("rig/friction/levels.py", "LEVEL = 3.0", "LEVEL = 4.0", 10.5),
        ("rig/friction/levels.py", "(1.0, 2.0)", "(1.0, 4.0)", 10.5),
        ("rig/runs/record.py", "return m.before", "return m.before + 1.0", 9.5),
    ],
)
def test_an_edit_below_recompiles(
    load: Load, tmp_path: Path, name: str, before: str, after: str, expected: float
) -> None:
    assert result(load()) == (8.5, False)
    assert result(load()) == (8.5, True)
    text = FILES[name]
    assert before in text
    written(tmp_path, name, text.replace(before, after))
    assert result(load()) == (expected, False)
    assert result(load()) == (expected, True)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "more"),
    [
        ("rig/friction/levels.py", "UNUSED = 2.0\n"),
        ("rig/runs/beside.py", "GAIN = 5.0\n"),
        ("rig/friction/__init__.py", '"""Friction."""\n'),
    ],
)
def test_an_edit_elsewhere_recompiles_nothing(
    load: Load, tmp_path: Path, name: str, more: str
) -> None:
    assert result(load()) == (8.5, False)
    written(tmp_path, name, FILES[name] + more)
    assert result(load()) == (8.5, True)


def test_a_field_that_changes_its_place_recompiles(load: Load, tmp_path: Path) -> None:
    assert result(load()) == (8.5, False)
    name = "rig/runs/record.py"
    swapped = FILES[name].replace("here: float", "x").replace("before: float", "here: float")
    written(tmp_path, name, swapped.replace("x\n", "before: float\n", 1))
    assert result(load()) == (8.5, False)


def test_the_kernel_of_an_effect_follows_what_it_calls(load: Load, tmp_path: Path) -> None:
    assert kernel_pointer(load().value, "mine", False).cache_hits == 0
    assert kernel_pointer(load().value, "mine", False).cache_hits == 1
    name = "rig/friction/levels.py"
    written(tmp_path, name, FILES[name] + "MORE = 1.0\n")
    assert kernel_pointer(load().value, "mine", False).cache_hits == 1
    written(tmp_path, name, FILES[name].replace("LEVEL = 3.0", "LEVEL = 4.0"))
    assert kernel_pointer(load().value, "mine", False).cache_hits == 0
