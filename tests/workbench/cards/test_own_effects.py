"""A user's own effects: found, compiled, simulated; and every broken file in one line."""

import ctypes
import os
import subprocess
import sys
from importlib import metadata
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import workbench.cards.own_effects
from identification.effects._library import built_in
from identification.errors import BadModel
from workbench.cards.own_effects import GROUP, library, load_effect

MAGNET = (
    "\n".join(
        line.removeprefix("    ")
        for line in (workbench.cards.own_effects.__doc__ or "").split("it can too:")[1].splitlines()
    )
    .split("`identification/")[0]
    .strip()
    + "\n"
)
ROOT = Path(__file__).resolve().parents[3]


def written(folder: Path, text: str = MAGNET, name: str = "magnet.py") -> Path:
    folder.mkdir(exist_ok=True)
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def refused(folder: Path, text: str) -> str:
    path = written(folder, text)
    with pytest.raises(BadModel) as caught:
        library([folder])
    said = str(caught.value)
    assert said.startswith(str(path))
    assert "\n" not in said
    return said


def test_the_documented_example_joins_the_library(tmp_path: Path) -> None:
    written(tmp_path)
    written(tmp_path, "1/0\n", "_draft.py")
    found = library([tmp_path, tmp_path])
    assert list(found) == [*built_in(), "magnet"]
    assert found["magnet"].value(0, 0, 0, 0, 0, 1, 0, 0, 0, (), (8.0, 0.02)) == 8.0
    assert found["magnet"].addresses[0] != 0
    assert list(library()) == list(built_in())


@pytest.mark.parametrize(
    ("old", "new", "needed"),
    [
        ("value=value", "value=valu", ", line 23: NameError: name 'valu' is not defined"),
        ("import math", "import mathh", ", line 3: ModuleNotFoundError: No module named 'mathh'"),
        ("return p", "retur n", ", line 10: SyntaxError: invalid syntax"),
        ("import math", "raise SystemExit(3)", ", line 3: SystemExit: 3"),
        ("EFFECT =", "EFECT =", ": no EFFECT of type"),
        ("5.0,", "5e9,", "effect 'magnet': F_m: typical and default must lie in [0, 1000]"),
        ('"magnet"', '"spring"', ": its key 'spring' is taken by an effect that ships"),
        ("math.exp", "math.expp", ", line 8: effect 'magnet' does not compile (module 'math' has"),
        ("-y / p[1]", "str(y)", ", line 10: effect 'magnet' does not compile"),
        ("return p[0] *", "return foo(y) *", "does not compile (NameError: name 'foo'"),
        ("s, p)", "s)", ", line 8: effect 'magnet' does not compile (Signature mismatch"),
    ],
)
def test_a_broken_file_is_named_with_line_and_cause(
    tmp_path: Path, old: str, new: str, needed: str
) -> None:
    assert MAGNET.count(old) >= 1
    assert needed in refused(tmp_path, MAGNET.replace(old, new, 1))


def test_two_files_of_one_key_are_refused(tmp_path: Path) -> None:
    one = written(tmp_path / "a")
    written(tmp_path / "b")
    with pytest.raises(BadModel, match=f"key 'magnet' is taken by {one}; rename one"):
        library([tmp_path / "a", tmp_path / "b"])


def test_folders_that_hold_no_effects(tmp_path: Path) -> None:
    with pytest.raises(BadModel, match="no such folder"):
        library([tmp_path / "none"])
    with pytest.raises(BadModel, match="no effect in it"):
        library([tmp_path])
    with pytest.raises(BadModel, match="is a file"):
        library([written(tmp_path)])


def test_a_changed_file_is_read_anew(tmp_path: Path) -> None:
    path = written(tmp_path)
    assert load_effect(path).value(0, 0, 0, 0, 0, 1, 0, 0, 0, (), (8.0, 0.02)) == 8.0
    written(tmp_path, MAGNET.replace("return p[0]", "return -1.0 * p[0]"))
    again = load_effect(path)
    assert again.value(0, 0, 0, 0, 0, 1, 0, 0, 0, (), (8.0, 0.02)) == -8.0
    kernel: Any = again.pointers[0].ctypes
    p = (ctypes.c_double * 8)(8.0, 0.02)
    assert kernel(0, 0, 0, 0, 0, 1, 0, 0, 0, p, p) == -8.0


def test_a_sign_changed_within_the_same_second_counts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    path = written(tmp_path)
    at = path.stat().st_mtime_ns
    load_effect(path)
    text = MAGNET.replace("return p[0] *", "return -p[0]*")
    assert len(text) == len(MAGNET)
    assert text != MAGNET
    written(tmp_path, text)
    os.utime(path, ns=(at, at))
    assert load_effect(path).value(0, 0, 0, 0, 0, 1, 0, 0, 0, (), (8.0, 0.02)) == -8.0


def test_without_a_place_for_a_cache_it_works_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from numba.core import caching

    path = written(tmp_path / "own")
    for one in ("InTreeCacheLocator", "UserWideCacheLocator", "IPythonCacheLocator"):
        monkeypatch.setattr(getattr(caching, one), "from_function", lambda *_: None)
    effect = load_effect(path)
    assert effect.addresses[0] != 0
    assert not list((tmp_path / "own").rglob("*.nbi"))


@pytest.mark.slow
def test_kernels_are_cached_for_the_next_process(tmp_path: Path) -> None:
    path = written(tmp_path / "own")
    code = "import sys, pathlib; from workbench.cards.own_effects import library\n"
    code += "effect = library([pathlib.Path(sys.argv[1])])['magnet']\n"
    code += "print(effect.pointers[0].cache_hits)"
    hits = [
        subprocess.run(
            [sys.executable, "-c", code, str(path.parent)],
            capture_output=True, text=True, check=True, cwd=ROOT,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
        ).stdout.strip()
        for _ in range(2)
    ]  # fmt: skip
    assert hits == ["0", "1"]


def test_effects_of_installed_packages_join_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    effect = load_effect(written(tmp_path))

    def pointing(loaded: object) -> Any:
        def load() -> object:
            if isinstance(loaded, Exception):
                raise loaded
            return loaded

        return SimpleNamespace(name="m", dist=SimpleNamespace(name="magnets"), load=load)

    def with_point(loaded: object) -> None:
        def points(*, group: str) -> list[Any]:
            assert group == GROUP
            return [pointing(loaded)]

        monkeypatch.setattr(workbench.cards.own_effects, "entry_points", points)

    with_point(effect)
    assert library()["magnet"] is effect
    with_point(sys.modules[effect.value.__module__])
    assert library()["magnet"] is effect
    for loaded, needed in (
        (ImportError("no such thing"), "ImportError: no such thing"),
        (3, "is int, an Effect needed"),
        (os, "no EFFECT of type"),
        (built_in()["spring"], "its key 'spring' is taken"),
    ):
        with_point(loaded)
        with pytest.raises(BadModel, match=f"entry point 'm' of magnets: .*{needed}"):
            library()
    assert metadata.entry_points(group=GROUP) is not None
