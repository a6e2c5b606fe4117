"""Every benchmark says how it is called."""

import runpy
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[2] / "benchmarks"
WITH_ARGUMENTS = [
    one.stem for one in sorted(FOLDER.glob("*.py")) if "ArgumentParser" in one.read_text("utf-8")
]


@pytest.mark.parametrize("name", WITH_ARGUMENTS)
def test_help_is_printed(
    name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", [name, "--help"])
    with pytest.raises(SystemExit) as ended:
        runpy.run_path(str(FOLDER / f"{name}.py"), run_name="__main__")
    assert ended.value.code in (0, None)
    assert "usage" in capsys.readouterr().out
