"""An export says whether its design has passed a validation."""

import json
from pathlib import Path
from typing import Any

import pytest

from workbench.export import validated as module
from workbench.export.validated import validation_line

DESIGN: Any = object()


@pytest.fixture
def design(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The file of a design whose digest is "own"."""
    monkeypatch.setattr(module, "design_digest", {DESIGN: "own"}.get)
    folder = tmp_path / "tuned"
    folder.mkdir()
    return folder / "design.json"


def validated(design: Path, folder: str, passed: bool, of: str = "own") -> None:
    """A validation of the design in a folder beside its own."""
    path = design.parent.parent / folder / "validation.json"
    path.parent.mkdir(exist_ok=True)
    path.write_text(json.dumps({"passed": passed, "design": of}), "utf-8")


def test_one_that_passed_is_not_spoken_of(design: Path) -> None:
    validated(design, "loop", True)
    assert validation_line(DESIGN, design) == ""


def test_one_that_failed_is_reported_first(design: Path) -> None:
    validated(design, "loop", False)
    said = validation_line(DESIGN, design)
    assert said.startswith("its validation did NOT pass (loop/validation.json)")


def test_one_of_another_design_counts_for_nothing(design: Path) -> None:
    validated(design, "loop", True, of="another")
    assert validation_line(DESIGN, design).startswith("no validation of this design")


@pytest.mark.parametrize("text", ["", "[]", "{", '{"design": 1}'])
def test_a_file_that_is_none_counts_for_nothing(design: Path, text: str) -> None:
    (design.parent / "validation.json").write_text(text, "utf-8")
    assert validation_line(DESIGN, design).startswith("no validation of this design")
