"""Output: folders whole or not at all, strict JSON, plain tables, mute progress."""

import json
import math
import sys
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from types import MappingProxyType

import click
import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

from workbench import options
from workbench.output import BadOutput, OutputFolder, dumps, emit, progress, strict
from workbench.screen import JSON, is_given, screen, tabled

NOW = datetime(2024, 5, 6, 7, 8, 9, tzinfo=UTC)
JSON_LIKE = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
)


@pytest.fixture(autouse=True)
def at_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def tree(folder: Path) -> dict[str, str]:
    return {
        str(p.relative_to(folder)): p.read_text() if p.is_file() else "/"
        for p in sorted(folder.rglob("*"))
    }


def test_default_folder_is_named_by_time_and_command() -> None:
    with OutputFolder("identify", now=NOW) as folder:
        folder.write_json("model.json", {"m": 1.0})
        (folder.path / "parts").mkdir()
        folder.write("parts/report.html", "µ")
        assert not folder.final.exists()
    assert folder.final == Path("runs/20240506-070809-identify")
    assert tree(folder.final) == {
        "model.json": '{\n  "m": 1.0\n}\n',
        "parts": "/",
        "parts/report.html": "µ",
    }
    assert list(Path("runs").iterdir()) == [folder.final]


def test_runs_of_the_same_second_get_folders_of_their_own() -> None:
    with OutputFolder("demo", now=NOW) as first, OutputFolder("demo", now=NOW) as second:
        first.write("a", "1")
        second.write("a", "2")
    assert second.final == Path("runs/20240506-070809-demo")
    assert first.final == Path("runs/20240506-070809-demo-2")
    assert (first.final / "a").read_text() == "1"
    assert (second.final / "a").read_text() == "2"


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt, SystemExit])
@pytest.mark.parametrize("out", [None, Path("new"), Path("deep/er/new"), Path("old")])
def test_failure_leaves_no_trace(
    tmp_path: Path, error: type[BaseException], out: Path | None
) -> None:
    Path("old").mkdir()
    Path("old/model.json").write_text("kept")
    before = tree(tmp_path)

    def fail() -> None:
        with OutputFolder("identify", out, now=NOW) as folder:
            folder.write("model.json", "half")
            raise error

    with pytest.raises(error):
        fail()
    assert tree(tmp_path) == before


def test_result_without_json_form_leaves_no_trace(tmp_path: Path) -> None:
    with (
        pytest.raises(TypeError, match="object has no form in JSON"),
        OutputFolder("identify", now=NOW) as folder,
    ):
        folder.write_json("model.json", {"m": object()})
    assert tree(tmp_path) == {}


def test_existing_folder_keeps_foreign_files() -> None:
    old = Path("old")
    (old / "parts").mkdir(parents=True)
    (old / "notes.txt").write_text("mine")
    (old / "parts/a").write_text("1")
    (old / "model.json").write_text("1")
    with OutputFolder("identify", old, now=NOW) as folder:
        (folder.path / "parts").mkdir()
        folder.write("parts/b", "2")
        folder.write("model.json", "2")
        assert (old / "model.json").read_text() == "1"
    expected = {"model.json": "2", "notes.txt": "mine", "parts/a": "1", "parts/b": "2"}
    assert tree(old) == {**expected, "parts": "/"}


def test_folder_in_the_place_of_a_result_is_refused(tmp_path: Path) -> None:
    Path("old/model.json").mkdir(parents=True)
    before = tree(tmp_path)
    with (
        pytest.raises(BadOutput, match="is a folder"),
        OutputFolder("identify", Path("old"), now=NOW) as folder,
    ):
        folder.write("a.csv", "1")
        folder.write("model.json", "1")
    assert tree(tmp_path) == before


def test_out_that_is_a_file_is_refused() -> None:
    Path("old").write_text("mine")
    with pytest.raises(BadOutput, match="is a file"):
        OutputFolder("identify", Path("old"), now=NOW).__enter__()
    with pytest.raises(BadOutput, match="--out old/below: cannot be made there"):
        OutputFolder("identify", Path("old/below"), now=NOW).__enter__()
    assert Path("old").read_text() == "mine"


@pytest.mark.parametrize("target", ["nowhere", "new"])
def test_out_that_is_a_link_to_nothing_is_refused(tmp_path: Path, target: str) -> None:
    Path("new").symlink_to(target)
    with pytest.raises(BadOutput, match="--out new is a link that leads nowhere"):
        OutputFolder("identify", Path("new"), now=NOW).__enter__()
    assert [path.name for path in tmp_path.iterdir()] == ["new"]


def test_name_too_long_leaves_no_trace(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="too long"):
        OutputFolder("identify", Path("new") / ("x" * 250), now=NOW).__enter__()
    assert tree(tmp_path) == {}


@dataclass(frozen=True)
class Estimate:
    value: float
    unit: str


@pytest.mark.parametrize(
    ("value", "plain"),
    [
        (math.nan, None),
        ([math.inf, -math.inf, 1.5], [None, None, 1.5]),
        (np.float64(2.5), 2.5),
        (np.float32(math.nan), None),
        (np.int64(3), 3),
        (np.bool_(True), True),
        (np.array([[1.0, math.nan]]), [[1.0, None]]),
        (MappingProxyType({"m": (1, 2)}), {"m": [1, 2]}),
        (Estimate(math.inf, "kg"), {"value": None, "unit": "kg"}),
        (Path("a/b"), "a/b"),
        (NOW, "2024-05-06T07:08:09+00:00"),
    ],
)
def test_strict_gives_plain_types(value: object, plain: object) -> None:
    assert strict(value) == plain
    assert json.loads(dumps(value)) == plain


@pytest.mark.parametrize("value", [1j, b"bytes", {"a": object()}, {1, 2}])
def test_strict_refuses_what_json_cannot_say(value: object) -> None:
    with pytest.raises(TypeError, match="no form in JSON"):
        strict(value)


@given(JSON_LIKE)
def test_dumps_never_writes_nan(value: object) -> None:
    def refuse(name: str) -> None:
        raise AssertionError(name)

    assert json.loads(dumps(value), parse_constant=refuse) == strict(value)


def test_emit_json_builds_no_table(capsys: pytest.CaptureFixture[str]) -> None:
    @options.command()
    def command() -> None:
        emit({"m": math.nan}, lambda: pytest.fail("table built"))

    command.main(["--json"], standalone_mode=False)
    assert json.loads(capsys.readouterr().out) == {"m": None}


def test_emit_shows_units_as_they_are(capsys: pytest.CaptureFixture[str]) -> None:
    rows = [("dv_p", "0.001 [m/s] :m:")]
    emit({}, lambda: screen(tabled(("name", "value [m/s]"), rows)))
    shown = capsys.readouterr().out
    assert "value [m/s]" in shown
    assert "0.001 [m/s] :m:" in shown


def test_options_reach_the_command() -> None:
    @options.command()
    def command(out: Path | None = options.OUT_OPTION) -> None:
        click.echo(f"{is_given(JSON)} {out!r}")

    def run(*arguments: str) -> str:
        return CliRunner().invoke(command, arguments, catch_exceptions=False).output.strip()

    assert run() == "False None"
    assert run("--json", "--out", "a/b", "--debug") == f"True {Path('a/b')!r}"
    assert "runs/<time>-<command>" in run("--help")


@pytest.mark.parametrize(("terminal", "as_json"), [(False, False), (True, True)])
def test_progress_is_mute(
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    terminal: bool,
    as_json: bool,
) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: terminal)

    @options.command()
    def command() -> None:
        with progress("fit", 3) as advance:
            advance(1)

    command.main(["--json"] if as_json else [], standalone_mode=False)
    assert capsys.readouterr() == ("", "")


@pytest.mark.slow
def test_progress_shows_on_a_terminal(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    monkeypatch.setenv("TERM", "xterm")
    with progress("fit of nine", 3) as advance:
        advance(3)
    shown = capsys.readouterr()
    assert shown.out == ""
    assert "fit of nine" in shown.err
    assert "100%" in shown.err
